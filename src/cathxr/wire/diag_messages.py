"""What the page /diag measures on a device and posts: figures of the browser and its graphics, nothing of a person."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from cathxr.wire.message import Message

Text = Annotated[str, StringConstraints(max_length=300, pattern=r"^[^\x00-\x1f\x7f]*$")]
_Count = Annotated[int, Field(ge=0, le=10**9)]
_Size = Annotated[int, Field(ge=0, le=10**6)]
_Number = Annotated[float, Field(ge=-1e9, le=1e9)]


class Spread(Message):
    """How some measured times are spread, ms; over: how many were longer than one and a half times the median."""

    count: _Count
    median: _Number
    p95: _Number
    p99: _Number
    longest: _Number
    over: _Count


class HeadsetFrames(Message):
    """Frames of a session in a headset."""

    mode: Literal["vr", "ar"]
    seconds: _Number
    rate_hz: _Number | None = Field(description="What the headset said its rate is; null: it did not say.")
    intervals_ms: Spread
    script_ms: Spread | None = Field(description="JavaScript for each frame; null where it was not measured.")


class DiagLink(Message):
    """The link between the device and the server."""

    connected: bool
    round_trip_ms: Spread | None
    track_age_ms: Spread | None = Field(description="From mid-exposure to the page; null in a replay.")
    track_interval_ms: Spread | None
    skipped: _Count = Field(description="Tracks that newer ones replaced on the way.")


class DiagGraphics(Message):
    """What the graphics offer. Sizes in pixels or voxels; empty names: the browser does not say."""

    webgl2: bool
    vendor: Text
    renderer: Text
    version: Text
    max_texture: _Size
    max_texture_3d: _Size
    max_samples: _Size
    max_uniform_vectors: _Size
    extensions: Annotated[list[Text], Field(max_length=200)]


class DiagDevice(Message):
    """The browser and what it runs on."""

    user_agent: Text
    secure: bool = Field(description="Whether the page has a secure address, which WebXR needs.")
    webxr: bool
    vr: bool
    ar: bool
    screen_px: tuple[_Size, _Size]
    pixel_ratio: _Number
    cores: _Size
    memory_gb: _Number | None
    touch_points: _Size


class DiagReport(Message):
    """One measurement, as `POST /diag` takes it."""

    schema_: Literal["cathxr-diag/1"] = Field(alias="schema")
    software: Text = Field(description="What the server's hello said.")
    seconds: _Number = Field(description="How long was measured.")
    device: DiagDevice
    graphics: DiagGraphics
    frames_ms: Spread | None = Field(description="Between the page's frames.")
    draw_ms: Spread | None = Field(description="For a test picture, from asking to having it.")
    link: DiagLink
    headset: HeadsetFrames | None = Field(description="The last session in a headset on this device.")
