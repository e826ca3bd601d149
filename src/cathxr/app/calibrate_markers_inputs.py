"""The pictures of `calibrate markers`: files, or taken now from the cameras or the twin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cathxr.app.config import read_config
from cathxr.app.plugins import make_camera
from cathxr.core import Clock, ConfigError, DeviceError, EndOfStream, PixelArray, Rig
from cathxr.devices.clock import ManualClock, MonotonicClock
from cathxr.storage.pictures import check_size, read_picture

_SETTLING = 3
"""First pictures of a stream that are thrown away: drivers hand out what lay in their buffers."""
_AVERAGED = 10
_PATIENCE_S = 5.0


@dataclass(frozen=True, eq=False)
class TakenPicture:
    """One picture: name for sentences; pixels uint8 (H, W, 3) BGR or (H, W)."""

    name: str
    pixels: PixelArray


def read_pictures(rig: Rig, files: Mapping[str, Sequence[Path]]) -> dict[str, list[TakenPicture]]:
    """Return the pictures of each camera that has files.

    Raises:
        DataError: one cannot be read or has another size than the rig's camera.
    """
    result: dict[str, list[TakenPicture]] = {}
    for camera, paths in files.items():
        for path in paths:
            pixels = read_picture(path)
            check_size((pixels.shape[1], pixels.shape[0]), rig.cameras[camera], where=str(path))
            result.setdefault(camera, []).append(TakenPicture(str(path), pixels))
    return result


def live_pictures(
    rig: Rig, source: str, *, config: Path | None, seed: int | None, scene: str = "pillars"
) -> dict[str, list[TakenPicture]]:
    """Return one picture of each camera, the mean of several, from the twin or from real cameras.

    The twin's cameras are moved off the rig's poses by seed, in a scene of its own (with both crosses in).

    Raises:
        ConfigError: the configuration does not name the devices; DeviceError: a camera gives no pictures.
    """
    result = {}
    for name in rig.cameras:
        if source == "twin":
            clock: Clock = ManualClock()
            driver, options = "twin", _twin_options(seed, scene)
        else:
            clock = MonotonicClock()
            driver, options = _camera_options(config, name)
        result[name] = [_mean_picture(rig, name, driver, options, clock)]
    return result


def _twin_options(seed: int | None, scene: str) -> Mapping[str, Any]:
    return {"scene": scene, "seed": seed or 0, "off_nominal": True}


def _camera_options(path: Path | None, camera: str) -> tuple[str, Mapping[str, Any]]:
    if path is None:
        raise ConfigError(
            "Real cameras need to be named: give --config config.toml, which calibrate cameras writes for you."
        )
    chosen = read_config(path).cameras
    options: Mapping[str, Any] = getattr(chosen, camera)
    if chosen.driver == "opencv" and "device" not in options:
        raise ConfigError(
            f"{path} does not say which device the {camera} camera is: add device = 0 (or a path) under "
            f"[cameras.{camera}], or let calibrate cameras write it."
        )
    return chosen.driver, options


def _mean_picture(rig: Rig, camera: str, driver: str, options: Mapping[str, Any], clock: Clock) -> TakenPicture:
    """Return the mean of several pictures: the noise falls, and what stands still stays.

    Raises:
        DeviceError: none came in time, or of another size than the rig's.
    """
    total: np.ndarray | None = None
    with make_camera(driver, rig, camera, clock=clock, options=options) as device:
        for number in range(_SETTLING + _AVERAGED):
            try:
                image = device.read(_PATIENCE_S)
            except EndOfStream:
                image = None
            if image is None:
                raise DeviceError(f"The {camera} camera gave no picture within {_PATIENCE_S:.0f} s: check its cable.")
            if number >= _SETTLING:
                total = image.pixels.astype(np.float64) if total is None else total + image.pixels
    assert total is not None, "at least one picture was averaged"
    pixels = np.rint(total / _AVERAGED).astype(np.uint8)
    check_size((pixels.shape[1], pixels.shape[0]), rig.cameras[camera], where=f"The {camera} camera's picture")
    return TakenPicture(f"The {camera} camera's picture", pixels)
