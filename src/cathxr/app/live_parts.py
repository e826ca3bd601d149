"""Puts the live system together from a configuration: the rig, the source, the scene. Opens nothing yet."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from cathxr.app.config import Config
from cathxr.app.drawn_ahead import drawn_ahead
from cathxr.app.heart_registration import registration_of
from cathxr.app.heart_scene import heart_scene, heart_targets
from cathxr.app.plugins import make_camera, make_encoder
from cathxr.app.twin_encoder import fault_command, twin_encoder
from cathxr.core import Clock, ConfigError, DataError, Image, PixelArray, Rig, Source, Track
from cathxr.heart import HeartFolder, builtin_path, read_heart
from cathxr.registration import registration_toml
from cathxr.runtime.live import LiveOptions
from cathxr.runtime.optical import OpticalSource
from cathxr.runtime.recording import session_opener
from cathxr.runtime.replay import ReplayOptions, ReplaySource
from cathxr.storage.rig_file import example_rig, read_rig
from cathxr.storage.session import SessionReader
from cathxr.tracking import make_tracker
from cathxr.twin import TwinWorld, scene, true_rig, with_readout
from cathxr.twin.drivers import USUAL_RATE_HZ
from cathxr.vision import make_detector
from cathxr.wire.messages import SceneDescription, TwinDescription
from cathxr.wire.packed import Packed
from cathxr.wire.scene import scene_description

TWIN, CAMERAS = "twin", "cameras"


@dataclass(frozen=True, eq=False)
class LiveParts:
    """What a live system is made of. kind: "twin", "cameras" or "replay".

    picture_hz: at most so many pictures a second are asked of a camera; None: as many as the rig says.
    """

    kind: str
    rig: Rig
    source: Source[Track]
    options: LiveOptions
    scene: SceneDescription
    files: Mapping[str, Path | Packed]
    world: TwinWorld | None = None
    optical: OpticalSource | None = None
    picture_hz: float | None = None


def live_parts(source: str, config: Config, *, clock: Clock) -> LiveParts:
    """Return the parts for a source: "twin", "cameras", or a session's folder.

    Raises:
        ConfigError, DataError: one sentence about what is wrong.
    """
    if source == TWIN:
        return _twin_parts(config, clock)
    if source == CAMERAS:
        return _camera_parts(config, clock)
    return _replay_parts(Path(source), config, clock)


def _twin_parts(config: Config, clock: Clock) -> LiveParts:
    """Return the twin's box: the given rig as it is, or the example rig with its cameras moved off-nominal by seed."""
    seed = config.twin.seed
    settings = scene(config.twin.scene)
    own = with_readout(example_rig(), settings.readout_ms)
    rig = read_rig(Path(config.rig)) if config.rig else true_rig(own, seed)
    world = TwinWorld(rig, seed=seed, settings=settings, start_ns=clock.now_ns())
    errors = config.twin.stamp_error_s
    options: dict[str, dict[str, Any]] = {
        name: {"world": world, "stamp_error_s": getattr(errors, name, None)} for name in rig.cameras
    }
    for name in rig.cameras:
        if config.twin.rate_hz is not None:
            options[name]["rate_hz"] = config.twin.rate_hz
    cameras = {
        name: drawn_ahead(make_camera(TWIN, rig, name, clock=clock, options=options[name])) for name in rig.cameras
    }
    encoder, commands = None, {}
    if rig.roll is not None:
        play_deg = config.twin.encoder_backlash_deg
        encoder, port = twin_encoder(world, rig, clock=clock, play_deg=play_deg, stamp_error_s=errors.encoder)
        commands["encoder_fault"] = fault_command(port)
    optical = _optical(config, rig, cameras, encoder, clock)
    live = LiveOptions(
        world=world,
        truth=lambda t_ns, seq: world.truth(t_ns, seq=seq, points=config.tracking.points),
        open_session=_opener(config, rig, clock, TWIN),
        record_videos=config.recording.videos,
        commands=commands,
    )
    ranges = world.control_ranges
    twin = TwinDescription(
        insertion_mm=ranges["insertion_mm"],
        roll_deg=ranges["roll_deg"],
        anterior_deg=ranges["anterior_deg"],
        left_deg=ranges["left_deg"],
        manoeuvres=list(world.manoeuvres),
    )
    description, files = _scene(config, rig, TWIN, twin)
    picture_hz = config.twin.rate_hz or USUAL_RATE_HZ
    return LiveParts(TWIN, rig, optical, live, description, files, world=world, optical=optical, picture_hz=picture_hz)


def _camera_parts(config: Config, clock: Clock) -> LiveParts:
    if config.rig is None:
        raise ConfigError("Real cameras need the rig they belong to: give it with --rig rig.toml.")
    rig = read_rig(Path(config.rig))
    chosen = config.cameras
    options = {"top": chosen.top, "front": chosen.front}
    missing = [name for name, each in options.items() if chosen.driver == "opencv" and "device" not in each]
    if missing:
        raise ConfigError(
            f"The configuration does not say which device the {' and the '.join(missing)} camera is: give --config "
            f"with device = 0 (or a path) under [cameras.{missing[0]}]."
        )
    cameras = {name: make_camera(chosen.driver, rig, name, clock=clock, options=options[name]) for name in options}
    encoder = None
    if config.encoder.driver is not None:
        encoder = make_encoder(config.encoder.driver, rig, clock=clock, options=config.encoder.options)
    optical = _optical(config, rig, cameras, encoder, clock)
    live = LiveOptions(open_session=_opener(config, rig, clock, CAMERAS), record_videos=config.recording.videos)
    description, files = _scene(config, rig, CAMERAS, None)
    return LiveParts(CAMERAS, rig, optical, live, description, files, optical=optical)


def _replay_parts(folder: Path, config: Config, clock: Clock) -> LiveParts:
    if not folder.exists():
        raise DataError(f"There is no source '{folder}': give twin, cameras, or the folder of a recorded session.")
    session = SessionReader(folder)
    rig = session.rig
    method = str(session.config.get("method", "model"))
    points = int(session.config.get("points", config.tracking.points))
    source = ReplaySource(
        session,
        clock=clock,
        tracker=make_tracker(method, rig, points=points),
        options=ReplayOptions(speed=config.replay.speed, loop=config.replay.loop),
    )
    live = LiveOptions(no_recording="This is a replay: what would be recorded is recorded already.")
    description, files = _scene(config, rig, "replay", None)
    return LiveParts("replay", rig, source, live, description, files)


def _optical(
    config: Config, rig: Rig, cameras: Mapping[str, Source[Image]], encoder: Any, clock: Clock
) -> OpticalSource:
    """Return the optical tracker over opened-on-demand cameras."""
    tracking = config.tracking
    detectors = {
        name: make_detector(tracking.method, rig, name, background=_background(getattr(tracking, f"background_{name}")))
        for name in cameras
    }
    tracker = make_tracker(tracking.method, rig, points=tracking.points)
    return OpticalSource(rig, cameras, detectors=detectors, tracker=tracker, clock=clock, encoder=encoder)


def _background(path: str | None) -> PixelArray | None:
    if path is None:
        return None
    picture = cv2.imread(path, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise DataError(f"The background picture {path} cannot be read: give a PNG or JPEG of the empty box.")
    return np.asarray(picture, dtype=np.uint8)


def _opener(config: Config, rig: Rig, clock: Clock, kind: str) -> Any:
    chosen = {"source": kind, "method": config.tracking.method, "points": config.tracking.points}
    if kind == TWIN:
        chosen |= {"scene": config.twin.scene, "seed": config.twin.seed}
    return session_opener(
        Path(config.recording.folder),
        rig=rig,
        config=chosen,
        clock=clock,
        videos=config.recording.videos,
        registration=tomllib.loads(registration_toml(registration_of(_heart(config)))),
    )


def _heart(config: Config) -> HeartFolder:
    return read_heart(Path(config.heart) if config.heart else builtin_path())


def _scene(
    config: Config, rig: Rig, kind: str, twin: TwinDescription | None
) -> tuple[SceneDescription, dict[str, Path | Packed]]:
    """Return the scene's description and the files it names."""
    heart = _heart(config)
    registration = registration_of(heart)
    description, files = heart_scene(heart, registration)
    targets = heart_targets(heart, registration, rig.roi)
    return scene_description(rig, kind, heart=description, targets=targets, twin=twin), files
