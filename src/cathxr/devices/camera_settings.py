"""What is asked of a camera before it runs, and what it made of that: every setting is set and read back."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import cv2

from cathxr.core import ConfigError, RigCamera

MANUAL_EXPOSURE_V4L2 = 1.0
"""V4L2_EXPOSURE_MANUAL; OpenCV passes V4L2's own menu value through."""


class Capture(Protocol):
    """The part of cv2.VideoCapture that is used here."""

    def get(self, propId: int, /) -> float: ...  # noqa: N803  (OpenCV's own name)
    def set(self, propId: int, value: float, /) -> bool: ...  # noqa: N803


@dataclass(frozen=True)
class CameraOptions:
    """What a person chooses about a camera. None: left as the camera has it, but never on automatic.

    device: an index, a path such as /dev/video0 or /dev/v4l/by-path/..., or a video file or URL (for tests).
    exposure, gain, focus, white_balance: in the units of the system's camera interface (V4L2: exposure in 100 us, white
    balance in kelvin; DirectShow: exposure as a power of two of a second). buffer: pictures the driver may hold.
    """

    device: int | str
    fourcc: str = "MJPG"
    buffer: int = 1
    exposure: float | None = None
    gain: float | None = None
    focus: float | None = None
    white_balance: float | None = None
    loop: bool = False


_NUMBERS = ("exposure", "gain", "focus", "white_balance")


def checked_options(camera: str, options: Mapping[str, Any]) -> CameraOptions:
    """Return the options as given in a configuration.

    Raises:
        ConfigError: an option is unknown, missing, or of the wrong kind.
    """
    where = f"Options of the {camera} camera"
    known = tuple(CameraOptions.__dataclass_fields__)
    unknown = sorted(set(options) - set(known))
    if unknown:
        raise ConfigError(f"{where}: {', '.join(unknown)} is unknown; there are {', '.join(known)}.")
    device = options.get("device")
    if isinstance(device, bool) or not isinstance(device, (int, str)) or device in ("", None):
        raise ConfigError(f"{where}: device must say which camera (an index or a path), {device!r} was given.")
    for name in _NUMBERS:
        value = options.get(name)
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
            raise ConfigError(f"{where}: {name} must be a number, {value!r} was given.")
    buffer = options.get("buffer", 1)
    if isinstance(buffer, bool) or not isinstance(buffer, int) or not 1 <= buffer <= 10:
        raise ConfigError(f"{where}: buffer must be a whole number from 1 to 10, {buffer!r} was given.")
    fourcc = options.get("fourcc", "MJPG")
    if not isinstance(fourcc, str) or len(fourcc) != 4 or not fourcc.isascii():
        raise ConfigError(f"{where}: fourcc must be four letters such as MJPG, {fourcc!r} was given.")
    if not isinstance(options.get("loop", False), bool):
        raise ConfigError(f"{where}: loop must be true or false, {options['loop']!r} was given.")
    return CameraOptions(**options)


def apply_settings(capture: Capture, options: CameraOptions, camera: RigCamera, *, backend: int) -> tuple[str, ...]:
    """Set the camera up and return one sentence for each setting that it did not take.

    The picture's format comes first: a change of it resets the others in many drivers.
    """
    width, height = camera.size_px
    warnings = [
        *_set(
            capture, "format", cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*options.fourcc)), named=fourcc_name
        ),
        *_set(capture, "width", cv2.CAP_PROP_FRAME_WIDTH, float(width)),
        *_set(capture, "height", cv2.CAP_PROP_FRAME_HEIGHT, float(height)),
        *_set(capture, "rate", cv2.CAP_PROP_FPS, camera.rate_hz, tolerance=0.02 * camera.rate_hz),
        *_set(capture, "buffer", cv2.CAP_PROP_BUFFERSIZE, float(options.buffer), needed=backend == cv2.CAP_V4L2),
    ]
    manual = MANUAL_EXPOSURE_V4L2 if backend == cv2.CAP_V4L2 else 0.0
    warnings += _set(capture, "manual exposure", cv2.CAP_PROP_AUTO_EXPOSURE, manual)
    warnings += _set(capture, "fixed focus", cv2.CAP_PROP_AUTOFOCUS, 0.0, needed=options.focus is not None)
    warnings += _set(capture, "fixed white balance", cv2.CAP_PROP_AUTO_WB, 0.0)
    for name, prop in (
        ("exposure", cv2.CAP_PROP_EXPOSURE),
        ("gain", cv2.CAP_PROP_GAIN),
        ("focus", cv2.CAP_PROP_FOCUS),
        ("white_balance", cv2.CAP_PROP_WB_TEMPERATURE),
    ):
        value = getattr(options, name)
        if value is not None:
            warnings += _set(capture, name, prop, float(value), tolerance=max(0.5, 0.01 * abs(value)))
    return tuple(warnings)


def fourcc_name(value: float) -> str:
    """Return OpenCV's number for a picture format as its four letters."""
    code = int(value)
    text = "".join(chr((code >> shift) & 0xFF) for shift in (0, 8, 16, 24))
    return text if text.isprintable() and text.strip() else f"{code:#x}"


def _set(
    capture: Capture,
    name: str,
    prop: int,
    value: float,
    *,
    tolerance: float = 1e-6,
    needed: bool = True,
    named: Any = "{:g}".format,
) -> list[str]:
    """Set one property and read it back; return a sentence where it is not what was asked for."""
    taken = capture.set(prop, value)
    got = capture.get(prop)
    if abs(got - value) <= tolerance or not needed:
        return []
    if not taken and got in (-1.0, 0.0):
        return [f"The camera has no control for its {name}."]
    return [f"The camera's {name} is {named(got)}, {named(value)} was asked for."]
