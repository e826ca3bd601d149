"""Every message on the link, defined once; some are in calibration_, heart_, setup_, training_ and view_messages.

The TypeScript types and docs/wire.md are generated from all of them.

Arrays are in the units their names say, in the frame the field's description says. Angles on the wire are radians.
"""

from enum import IntEnum
from typing import Annotated, Any, Literal

from pydantic import Field

from cathxr.wire.calibration_messages import (
    CamerasState,
    IntrinsicsState,
    MarkersState,
    RollCalibrationState,
    TouchState,
)
from cathxr.wire.heart_messages import HeartSeedsState
from cathxr.wire.message import Matrix4, Message, Quaternion, Vector2, Vector3
from cathxr.wire.setup_messages import SetupState
from cathxr.wire.training_messages import TrainingOffer, TrainingState
from cathxr.wire.view_messages import ClientsMessage, Follow, FollowingMessage, LockMessage, ViewMessage, ViewReport

PROTOCOL = 1
"""The protocol's version. A client that asks for another is refused with a sentence."""

ACK_WINDOW = 12
"""Tracks in flight, at most, to a client that acknowledges; newer ones then replace the one that waits."""


class CloseCode(IntEnum):
    """Why the server closed a link."""

    GOING_AWAY = 1001
    """The server stops: try again later."""
    TOO_BIG = 1009
    """A message was larger than the server takes."""
    NO_ANSWER = 1011
    """The client did not answer the heartbeat in time: connect again."""
    PROTOCOL = 4400
    """Another protocol version: reload the page, or update the client. Do not try again."""
    MISUSE = 4408
    """Too many messages that could not be understood, or far too many messages."""
    BUSY = 4429
    """The server has as many clients as it takes: try again later."""


# --- server to client -------------------------------------------------------------------------------------------------


class Hello(Message):
    """First message on every link."""

    type: Literal["hello"] = "hello"
    protocol: int = Field(description="Protocol version of the server.")
    software: str = Field(description="Name and version of the server.")
    frames: dict[str, str] = Field(description="Each frame's axes and origin, in words.")
    units: dict[str, str] = Field(description="Unit of each kind of quantity.")
    role: Literal["viewer", "operator"] = Field(description="What this client may do now: an operator may command.")
    source: str = Field(description="What feeds the tracker: twin, cameras, or replay.")
    needs_pairing: bool = Field(description="Whether a pairing code turns this viewer into an operator.")
    client: str = Field(default="", description="This client's id among `clients`.")


class TipState(Message):
    """The tip's pose in `box`."""

    position: Vector3 = Field(description="mm, box")
    orientation_wxyz: Quaternion = Field(description="box_from_tip as a unit quaternion")


class TrackMessage(Message):
    """The catheter at one instant. When lost, points, tip, roll, yaw, pitch and sigma_mm are null."""

    type: Literal["track"] = "track"
    seq: int = Field(description="0-based index of the picture pair.")
    t: float = Field(description="Mid-exposure of the top picture, seconds of the host's monotonic clock.")
    status: Literal["tracked", "coasting", "lost"]
    reason: str = Field(description="Why it is not tracked; empty when tracked.")
    points: list[Vector3] | None = Field(description="K points, mm, box, tip first, uniform in arc length.")
    tip: TipState | None
    roll: float | None = Field(description="Unwrapped roll, rad; null where it is not valid (message `roll` says why).")
    roll_predicted: bool = Field(description="Whether it is carried on beyond the encoder's last reading.")
    yaw: float | None = Field(description="atan2(dy, dx) of the tip's tangent in box, rad.")
    pitch: float | None = Field(description="asin(dz) of the tip's tangent in box, rad.")
    sigma_mm: float | None = Field(description="Root of the trace of the tip's covariance, calibration included.")
    latency_ms: float | None = Field(description="Mid-exposure to Track, ms; null in a replay.")


class RollState(Message):
    """Whether the roll is valid, and what to do where it is not. Newest wins; whoever connects is given it.

    Without a valid roll every Track's `roll` is null, its tip's orientation takes roll as 0, and a client shows no
    beam. A system that has no encoder, or plays a recording, may never send it.
    """

    type: Literal["roll"] = "roll"
    present: bool = Field(description="Whether an encoder is connected.")
    valid: bool = Field(description="Whether its count gives the roll.")
    needs: Literal["", "confirm", "jig"] = Field(
        description="What an operator has to do: command roll_confirm, or set roll zero with the jig, then roll_zero."
    )
    sentence: str = Field(description="Why it is not valid and what to do; empty when valid or without an encoder.")
    predicted: bool = Field(description="Whether a Track since the last of these messages had a predicted roll.")


class EventMessage(Message):
    """Something that happened.

    Kind `done` goes only to the client whose command was carried out: its payload is `{id, name, result}`; the result
    of `pair` is `{role: "operator"}`.
    """

    type: Literal["event"] = "event"
    t: float = Field(description="Seconds of the host's monotonic clock.")
    kind: str
    payload: dict[str, Any] = Field(default_factory=dict)


class SourceHealth(Message):
    """One source's state."""

    source: str
    running: bool
    age_s: float | None = Field(description="Since its last item; null before the first.")
    rate_hz: float
    losses: int = Field(description="Items dropped or skipped so far.")
    last_error: str | None


class HealthMessage(Message):
    """State of every source, about once a second."""

    type: Literal["health"] = "health"
    t: float
    sources: list[SourceHealth]
    skew_ms: float | None = Field(description="Front picture's instant minus the top's, latest pair.")
    clients: int = Field(description="Clients connected.")
    skipped: int = Field(description="Messages this client did not get because newer ones had come.")


class SessionMessage(Message):
    """State of the recording and of the source."""

    type: Literal["session"] = "session"
    recording: bool
    name: str | None = Field(description="Folder name of the recording in progress.")
    seconds: float = Field(description="Length of the recording so far.")


class Pong(Message):
    """Answer to a ping: lets a client estimate the host's clock."""

    type: Literal["pong"] = "pong"
    client_t: float = Field(description="The ping's own t, echoed.")
    t: float = Field(description="Seconds of the host's monotonic clock at the answer.")


class Refusal(Message):
    """Why something was refused, in a sentence for a person."""

    type: Literal["refusal"] = "refusal"
    code: Literal["protocol", "message", "role", "pairing", "command", "busy"]
    sentence: str
    id: str | None = Field(default=None, description="The refused command's id, if it had one.")


# --- client to server -------------------------------------------------------------------------------------------------


class Command(Message):
    """Asks for something; only operators may, except `pair`. Answered by an event `done` or a refusal, with its id."""

    type: Literal["command"] = "command"
    name: str = Field(max_length=64, description="pair, steer, reset_tracker, record_start, roll_confirm, …")
    args: dict[str, Any] = Field(default_factory=dict)
    id: str | None = Field(default=None, max_length=64)


class Ping(Message):
    """Heartbeat and clock probe."""

    type: Literal["ping"] = "ping"
    t: float = Field(description="The client's own clock, echoed in the pong.")


class Ack(Message):
    """Says that a track was handled: narrows the window of messages in flight."""

    type: Literal["ack"] = "ack"
    seq: int


ServerMessage = Annotated[
    Hello
    | TrackMessage
    | EventMessage
    | HealthMessage
    | SessionMessage
    | RollState
    | Pong
    | Refusal
    | IntrinsicsState
    | MarkersState
    | CamerasState
    | RollCalibrationState
    | TouchState
    | HeartSeedsState
    | ClientsMessage
    | FollowingMessage
    | ViewMessage
    | LockMessage
    | TrainingOffer
    | TrainingState
    | SetupState,
    Field(discriminator="type"),
]
ClientMessage = Annotated[Command | Ping | Ack | ViewReport | Follow, Field(discriminator="type")]


# --- GET /scene/scene.json --------------------------------------------------------------------------------------------


class PoseDescription(Message):
    """A rigid transform."""

    rotation_wxyz: Quaternion
    translation_mm: Vector3


class CameraDescription(Message):
    """One camera of the rig: OpenCV pinhole, distortion k1 k2 p1 p2 k3."""

    name: str
    size_px: tuple[int, int]
    rate_hz: float
    focal_px: Vector2
    centre_px: Vector2
    distortion: tuple[float, float, float, float, float]
    camera_from_box: PoseDescription


class PartDescription(Message):
    """One named surface in heart.glb."""

    name: str
    label: str
    node: str
    colour: str
    opacity: float = Field(default=1.0, description="How it is best shown from outside, 0 to 1.")


class RegistrationDescription(Message):
    """Where the heart is: point_ct = scale * R * point_box + t, or, where it is given, linear * point_box + t.

    The error fields are null when unknown. An affinity's scale and rotation are those nearest to its linear part: an
    orientation is turned by them.
    """

    kind: str = Field(description="placement (nothing was measured), rigid, similarity or affine.")
    ct_from_box: PoseDescription
    scale: float
    linear: tuple[Vector3, Vector3, Vector3] | None = Field(
        default=None, description="Row by row; scale, stretch and rotation in one. Null unless kind is affine."
    )
    fre_mm: float | None = Field(description="Root mean square residual of the landmarks; not the error elsewhere.")
    tre_mm: float | None = Field(description="Held-out (leave-one-out) error, root mean square.")
    predicted_tre_mm: float | None = Field(default=None, description="Expected error at the landmarks' centroid.")
    worst_tre_mm: float | None = Field(default=None, description="Greatest expected error over the heart.")
    date: str | None = Field(default=None, description="ISO date of the measurement.")


class ScaleDescription(Message):
    """How a channel's byte gives a value; c is the byte / 255.

    square: value = high * c^2. asinh: value = centre * exp(width * sinh(low + c * (high - low))).
    """

    curve: Literal["square", "asinh"]
    unit: str
    high: float
    low: float
    centre: float
    width: float


class AcousticDescription(Message):
    """The acoustic volume: RGBA of a byte each at every voxel, i fastest, for a 3D texture."""

    file: str = Field(description="4 * i * j * k bytes; goes over the link as gzip where the client takes that.")
    size: tuple[int, int, int] = Field(description="Voxels along i, j, k.")
    ct_from_voxel: Matrix4 = Field(description="Row by row: (i, j, k, 1) of a voxel's centre to mm in ct.")
    impedance: ScaleDescription = Field(description="Channel R.")
    scatter: ScaleDescription = Field(description="Channel G.")
    attenuation: ScaleDescription = Field(description="Channel B.")
    interface: ScaleDescription = Field(description="Channel A.")


class LabelDescription(Message):
    """What a value of the label volume means."""

    value: int
    name: str = Field(description="The part's key.")
    label: str = Field(description="Its name for people.")
    colour: str
    is_blood: bool = Field(description="Whether it is blood, where a catheter may be; else it is a wall.")


class LabelsDescription(Message):
    """The label volume: a byte at every voxel, i fastest, 0 for nothing; nothing all around its outside."""

    file: str = Field(description="i * j * k bytes; goes over the link as gzip where the client takes that.")
    size: tuple[int, int, int] = Field(description="Voxels along i, j, k; at most 192.")
    ct_from_voxel: Matrix4 = Field(description="Row by row: (i, j, k, 1) of a voxel's centre to mm in ct.")
    values: list[LabelDescription]


class LandmarkDescription(Message):
    """A named place of the heart, whether or not the box's region holds it. Diameter and structure: openings only."""

    name: str
    label: str = Field(description="Its name for people.")
    kind: Literal["opening", "landmark"]
    position_ct: Vector3 = Field(description="mm, ct")
    normal_ct: Vector3 | None = Field(description="Unit vector, ct, out of the structure that it is an opening of.")
    diameter_mm: float | None
    structure: str | None = Field(description="The part that it is an opening of.")


class HeartDescription(Message):
    """The heart: its files, parts, and attribution. glTF: metres, y up, (x, z, -y) / 1000 of ct."""

    glb: str
    parts: list[PartDescription]
    attribution: str
    registration: RegistrationDescription
    acoustic: AcousticDescription | None = None
    labels: LabelsDescription | None = None
    landmarks: list[LandmarkDescription] = Field(default_factory=list)


class TargetDescription(Message):
    """A place to reach: an opening or a landmark that lies in the box's region."""

    name: str
    position_mm: Vector3 = Field(description="mm, box")
    radius_mm: float
    label: str = Field(default="", description="Its name for people.")
    normal: Vector3 | None = Field(default=None, description="Unit vector, box, out of what it is an opening of.")
    diameter_mm: float | None = Field(default=None, description="Of the circle of the opening's area.")


class TwinDescription(Message):
    """What the twin lets an operator steer: (min, max) of each control, and the scripted manoeuvres."""

    insertion_mm: Vector2
    roll_deg: Vector2
    anterior_deg: Vector2
    left_deg: Vector2
    manoeuvres: list[str]


class SceneDescription(Message):
    """Everything that does not change while the server runs."""

    protocol: int
    source: str
    frames: dict[str, str]
    roi_min_mm: Vector3
    roi_max_mm: Vector3
    catheter_name: str
    catheter_diameter_mm: float
    sector_deg: float | None
    cameras: list[CameraDescription]
    heart: HeartDescription | None
    targets: list[TargetDescription]
    twin: TwinDescription | None
