"""config.toml: what a person chooses about the live system. What was measured is in rig.toml."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cathxr.core import ConfigError


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class ServerConfig(_Section):
    """Where the page is served. lan_names: what else this machine is called on the network."""

    port: Annotated[int, Field(ge=0, le=65535)] = 8765
    lan: bool = False
    lan_port: Annotated[int, Field(ge=0, le=65535)] = 8766
    lan_names: list[str] = []
    force_pairing: bool = False
    browser: bool = True


class CamerasConfig(_Section):
    """The camera driver by its plug-in name, and each camera's own options (docs/formats.md lists OpenCV's)."""

    driver: str = "opencv"
    top: dict[str, Any] = {}
    front: dict[str, Any] = {}


class EncoderConfig(_Section):
    """The encoder driver by its plug-in name; without one there is no roll."""

    driver: str | None = None
    options: dict[str, Any] = {}


class StampErrorsConfig(_Section):
    """How late the simulated devices' stamps are, s, before the rig's [timing] is subtracted; None: as the rig says."""

    top: Annotated[float, Field(ge=-10, le=10)] | None = None
    front: Annotated[float, Field(ge=-10, le=10)] | None = None
    encoder: Annotated[float, Field(ge=-10, le=10)] | None = None


class TwinConfig(_Section):
    """The digital twin: a scene's name, a seed, the pictures' rate (None: the rig's, at most 30), wrong stamps.

    encoder_backlash_deg: play of the encoder's gears, at the catheter; None: the rig's, else the scene's.
    """

    scene: str = "smooth"
    seed: Annotated[int, Field(ge=0)] = 0
    rate_hz: Annotated[float, Field(gt=0, le=240)] | None = None
    stamp_error_s: StampErrorsConfig = StampErrorsConfig()
    encoder_backlash_deg: Annotated[float, Field(ge=0, le=20)] | None = None


class TrackingConfig(_Section):
    """How to track."""

    method: Literal["model", "paper"] = "model"
    points: Annotated[int, Field(ge=2, le=200)] = 50
    background_top: str | None = None
    background_front: str | None = None


class RecordingConfig(_Section):
    """Where recordings go, and whether they hold the pictures."""

    folder: str = "recordings"
    videos: bool = False


class ReplayConfig(_Section):
    """How a session is played."""

    speed: Annotated[float, Field(ge=0.01, le=100.0)] = 1.0
    loop: bool = True


class Config(_Section):
    """Everything a person chooses. `rig` and `heart` are paths; relative ones count from the file's own folder."""

    schema_: Literal["cathxr-config/1"] = Field(default="cathxr-config/1", alias="schema")
    rig: str | None = None
    heart: str | None = None
    server: ServerConfig = ServerConfig()
    cameras: CamerasConfig = CamerasConfig()
    encoder: EncoderConfig = EncoderConfig()
    twin: TwinConfig = TwinConfig()
    tracking: TrackingConfig = TrackingConfig()
    recording: RecordingConfig = RecordingConfig()
    replay: ReplayConfig = ReplayConfig()


def read_config(path: Path) -> Config:
    """Return the configuration in a file.

    Raises:
        ConfigError: the file is missing, no TOML, or says something that is not known; the sentence names the key.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(f"There is no configuration file {path}: give the path of an existing config.toml.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"The configuration file {path} cannot be read ({error}).") from error
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"The configuration file {path} is not valid TOML: {error}.") from error
    try:
        config = Config.model_validate(values)
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first(error)}") from error
    base = path.resolve().parent
    tracking = config.tracking.model_copy(
        update={
            name: _resolved(base, getattr(config.tracking, name)) for name in ("background_top", "background_front")
        }
    )
    return config.model_copy(
        update={
            "rig": _resolved(base, config.rig),
            "heart": _resolved(base, config.heart),
            "tracking": tracking,
            "recording": config.recording.model_copy(update={"folder": _resolved(base, config.recording.folder)}),
        }
    )


def _resolved(base: Path, path: str | None) -> str | None:
    return None if path is None else str(base / path)


def _first(error: ValidationError) -> str:
    """Return the first thing that is wrong, as a sentence."""
    problem = error.errors()[0]
    key = ".".join(str(part) for part in problem["loc"])
    if problem["type"] == "extra_forbidden":
        return f"the key '{key}' is unknown; remove it or correct its spelling."
    return f"{key}: {problem['msg'][0].lower()}{problem['msg'][1:]} (got {problem['input']!r})."
