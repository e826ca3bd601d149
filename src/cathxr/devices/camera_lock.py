"""Lets a camera find its own settings, then fixes them: a locked camera gives the same picture all day.

What a camera reports while it is on automatic is not always what it uses (many report the last fixed exposure). So the
picture decides: after locking, its brightness must be what it was, and the exposure is corrected until it is.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np

from cathxr.core import DeviceLost, PixelArray
from cathxr.devices.camera_settings import MANUAL_EXPOSURE_V4L2, Capture

_AUTOMATIC_V4L2 = (3.0, 0.0)  # aperture priority, then V4L2_EXPOSURE_AUTO: most webcams have only the first
_WINDOW = 10
_LEAST_SETTLING = 15
_MOST_SETTLING = 150
_SPREAD = 0.02
_PIPELINE = 6
"""Pictures that were exposed before a new setting holds, at most: drivers and cameras queue them."""
_AVERAGED = 4
_MATCHED = 0.04
_FAR_OFF = 0.10
_TRIES = 6
_FAILED_GRABS = 5

PROPERTIES = (
    ("exposure", cv2.CAP_PROP_EXPOSURE),
    ("gain", cv2.CAP_PROP_GAIN),
    ("focus", cv2.CAP_PROP_FOCUS),
    ("white_balance", cv2.CAP_PROP_WB_TEMPERATURE),
)


class Grabbing(Capture, Protocol):
    """The part of cv2.VideoCapture that gives pictures."""

    def grab(self) -> bool: ...
    def retrieve(self) -> tuple[bool, Any]: ...


@dataclass(frozen=True)
class LockedSettings:
    """What a camera stays at, in the units of CameraOptions; None: it has no such control.

    brightness_before, brightness_after: mean of the picture, 0 to 255, settled and locked. warnings: sentences.
    """

    exposure: float | None = None
    gain: float | None = None
    focus: float | None = None
    white_balance: float | None = None
    brightness_before: float = 0.0
    brightness_after: float = 0.0
    warnings: tuple[str, ...] = ()

    @property
    def options(self) -> dict[str, float]:
        """The camera's options for config.toml: those that it has a control for."""
        values = {name: getattr(self, name) for name, _ in PROPERTIES}
        return {name: value for name, value in values.items() if value is not None}


def set_automatic(capture: Capture, *, backend: int) -> None:
    """Have the camera choose exposure, focus and white balance by itself, as far as it can."""
    for value in _AUTOMATIC_V4L2 if backend == cv2.CAP_V4L2 else (1.0,):
        if capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, value) and capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) == value:
            break
    capture.set(cv2.CAP_PROP_AUTOFOCUS, 1.0)
    capture.set(cv2.CAP_PROP_AUTO_WB, 1.0)


def current_settings(capture: Capture) -> dict[str, float]:
    """Return what the camera reports of itself, without what it has no control for (-1 from OpenCV)."""
    values = {name: capture.get(prop) for name, prop in PROPERTIES}
    return {name: value for name, value in values.items() if math.isfinite(value) and value != -1.0}


class SettleAndLock:
    """Settles and locks one open camera, a picture at a time, so that its pictures can be shown meanwhile.

    `step` takes each picture right after it was grabbed, in the thread that grabs. backend: OpenCV's, as of
    `listing.backend`. rate_hz: what the camera shall run at; a longer exposure than its period is warned of.
    """

    def __init__(self, capture: Capture, *, backend: int, rate_hz: float | None = None) -> None:
        self._capture, self._backend, self._rate_hz = capture, backend, rate_hz
        self._recent: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=_WINDOW)
        self._pictures = 0
        self._after: list[float] = []
        self._before = 0.0
        self._tries = 0
        self._locked: dict[str, float] | None = None
        self._warnings: list[str] = []
        set_automatic(capture, backend=backend)

    def step(self, pixels: PixelArray) -> LockedSettings | None:
        """Take the newest picture, uint8; return the settings once they are locked and the picture is as it was."""
        self._pictures += 1
        brightness = float(np.mean(pixels[::8, ::8]))
        if self._locked is None:
            self._settle(brightness)
            return None
        if self._pictures <= _PIPELINE:
            return None
        self._after.append(brightness)
        if len(self._after) < _AVERAGED:
            return None
        after = float(np.mean(self._after))
        if self._corrected(after):
            return None
        return self._result(after)

    def _settle(self, brightness: float) -> None:
        """Lock when exposure, gain, focus, white balance and the picture have come to rest, or do not."""
        self._recent.append((brightness, tuple(self._capture.get(prop) for _, prop in PROPERTIES)))
        levels = [each for each, _ in self._recent]
        calm = max(levels) - min(levels) <= _SPREAD * float(np.mean(levels)) + 0.5
        same = len({values for _, values in self._recent}) == 1
        full = len(self._recent) == _WINDOW and self._pictures >= _LEAST_SETTLING
        if not (full and calm and same):
            if self._pictures < _MOST_SETTLING:
                return
            self._warnings.append(
                "The camera did not come to rest on automatic and was locked as it stood: keep light and scene steady, "
                "and do it again."
            )
        self._before = float(np.mean(levels))
        self._lock()

    def _lock(self) -> None:
        """Fix everything at the values reported last, and keep what was taken."""
        capture = self._capture
        settled = {name: capture.get(prop) for name, prop in PROPERTIES}
        manual = MANUAL_EXPOSURE_V4L2 if self._backend == cv2.CAP_V4L2 else 0.0
        if not capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, manual):
            self._warnings.append(
                "The camera does not let its exposure be fixed: its pictures will change with the light."
            )
        capture.set(cv2.CAP_PROP_AUTOFOCUS, 0.0)
        capture.set(cv2.CAP_PROP_AUTO_WB, 0.0)
        self._locked = {}
        for name, prop in PROPERTIES:
            value = settled[name]
            if math.isfinite(value) and capture.set(prop, value):
                self._locked[name] = capture.get(prop)
        self._pictures, self._after = 0, []

    def _corrected(self, after: float) -> bool:
        """Change the exposure where the picture is not as bright as it was; return whether it was changed."""
        assert self._locked is not None, "corrected only once locked"
        exposure = self._locked.get("exposure")
        ratio = self._before / max(after, 1.0)
        if exposure is None or abs(ratio - 1.0) <= _MATCHED or self._tries >= _TRIES:
            return False
        if self._backend == cv2.CAP_DSHOW:  # powers of two of a second
            wanted = round(exposure + math.log2(min(max(ratio, 0.25), 4.0)))
        else:
            wanted = max(1, round(exposure * min(max(ratio, 0.25), 4.0)))
        if wanted == exposure or not self._capture.set(cv2.CAP_PROP_EXPOSURE, float(wanted)):
            return False
        self._locked["exposure"] = self._capture.get(cv2.CAP_PROP_EXPOSURE)
        self._tries += 1
        self._pictures, self._after = 0, []
        return True

    def _result(self, after: float) -> LockedSettings:
        assert self._locked is not None, "a result only once locked"
        warnings = list(self._warnings)
        change = after / max(self._before, 1.0) - 1.0
        if abs(change) > _FAR_OFF:
            warnings.append(
                f"The locked picture is {abs(change):.0%} {'brighter' if change > 0 else 'darker'} than it was on "
                "automatic: look at it, and set exposure in the configuration by hand."
            )
        exposure = self._locked.get("exposure")
        if self._backend == cv2.CAP_V4L2 and self._rate_hz and exposure and exposure * 1e-4 > 1.0 / self._rate_hz:
            warnings.append(
                f"Its exposure of {exposure * 0.1:.1f} ms is longer than a picture's {1e3 / self._rate_hz:.1f} ms at "
                f"{self._rate_hz:g} Hz: give more light and lock again."
            )
        values = {name: self._locked.get(name) for name, _ in PROPERTIES}
        return LockedSettings(
            **values, brightness_before=self._before, brightness_after=after, warnings=tuple(warnings)
        )


def settle_and_lock(capture: Grabbing, *, backend: int, rate_hz: float | None = None) -> LockedSettings:
    """Let an open camera settle on automatic, lock it there, and return what it took, read back. Takes seconds.

    Raises:
        DeviceLost: it gives no pictures.
    """
    locking = SettleAndLock(capture, backend=backend, rate_hz=rate_hz)
    failed = 0
    while failed < _FAILED_GRABS:
        came, pixels = capture.retrieve() if capture.grab() else (False, None)
        if not came or pixels is None:
            failed += 1
            continue
        failed = 0
        locked = locking.step(np.asarray(pixels, dtype=np.uint8))
        if locked is not None:
            return locked
    raise DeviceLost(f"The camera gave no picture {_FAILED_GRABS} times in a row while it settled: check its cable.")
