"""A camera that is looked at and adjusted before anyone knows which of the rig's it is: on automatic until locked."""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Protocol, Self, cast

import cv2
import numpy as np

from cathxr.core import Clock, DeviceError, DeviceLost, DeviceNotFound, Image
from cathxr.devices.camera_lock import (
    LockedSettings,
    SettleAndLock,
    current_settings,
    set_automatic,
    settle_and_lock,
)
from cathxr.devices.grabbing import VideoCapture
from cathxr.devices.listing import backend, list_cameras, listing_sentence

_FAILED_GRABS = 5


class OpenCapture(VideoCapture, Protocol):
    """A cv2.VideoCapture as it comes from its constructor."""

    def isOpened(self) -> bool: ...  # noqa: N802  (OpenCV's own name)


Opener = Callable[[int | str], OpenCapture]


def open_capture(device: int | str) -> OpenCapture:
    """Return OpenCV's capture of a device, which may not have opened."""
    return cast(OpenCapture, cv2.VideoCapture(device, backend()))


class AdjustableCamera:
    """A Source of Images named `key`, of whatever size the camera gives; `size_px` and `rate_hz` are asked of it.

    Everything is done to the capture in the thread that reads: OpenCV's captures are for one thread. `lock` and
    `automatic` may be called from any other while someone reads.
    """

    def __init__(
        self,
        device: int | str,
        key: str,
        *,
        clock: Clock,
        size_px: tuple[int, int] | None = None,
        rate_hz: float | None = None,
        opener: Opener = open_capture,
    ) -> None:
        self.device, self.key = device, key
        self._clock, self._size_px, self._rate_hz, self._opener = clock, size_px, rate_hz, opener
        self._capture: OpenCapture | None = None
        self._changed = threading.Condition()
        self._locking: SettleAndLock | None = None
        self._lock_wanted = self._automatic_wanted = False
        self._outcome: LockedSettings | str | None = None
        self._settings: dict[str, float] = {}
        self._seq = 0
        self._failed = 0

    def __enter__(self) -> Self:
        if self._capture is not None:
            raise DeviceError(f"The camera {self.device!r} is open already: close it first.")
        capture = self._opener(self.device)
        if not capture.isOpened():
            capture.release()
            raise DeviceNotFound(
                f"The camera {self.device!r} cannot be opened: it is not there, or another program uses it. "
                f"{listing_sentence(list_cameras())}"
            )
        # The format comes first: a change of it resets the others in many drivers.
        capture.set(cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*"MJPG")))
        if self._size_px is not None:
            capture.set(cv2.CAP_PROP_FRAME_WIDTH, float(self._size_px[0]))
            capture.set(cv2.CAP_PROP_FRAME_HEIGHT, float(self._size_px[1]))
        if self._rate_hz is not None:
            capture.set(cv2.CAP_PROP_FPS, self._rate_hz)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1.0)
        set_automatic(capture, backend=backend())
        self._capture, self._failed = capture, 0
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._capture is not None:
            self._capture.release()
            self._capture = None
        with self._changed:
            if self._locking is not None or self._lock_wanted:
                self._outcome = f"The camera {self.device!r} went away while it was locked: check its cable."
            self._locking, self._lock_wanted = None, False
            self._changed.notify_all()

    def read(self, timeout_s: float) -> Image | None:
        """Return the next picture, None for one that did not come.

        Raises:
            DeviceLost: the camera gives no more; DeviceError: it is not open.
        """
        capture = self._capture
        if capture is None:
            raise DeviceError(f"The camera {self.device!r} is read before it is opened: use it in a with statement.")
        self._take_wishes(capture)
        came, data = capture.retrieve() if capture.grab() else (False, None)
        t_ns = self._clock.now_ns()
        if not came or data is None:
            self._failed += 1
            if self._failed >= _FAILED_GRABS:
                raise DeviceLost(f"The camera {self.device!r} gave no picture {_FAILED_GRABS} times in a row.")
            return None
        self._failed = 0
        pixels = np.asarray(data, dtype=np.uint8)
        if self._locking is not None:
            locked = self._locking.step(pixels)
            if locked is not None:
                with self._changed:
                    self._locking, self._outcome = None, locked
                    self._changed.notify_all()
        if self._seq % 10 == 0:
            self._settings = current_settings(capture)
        self._seq += 1
        return Image(self.key, self._seq - 1, t_ns, pixels)

    @property
    def settings(self) -> dict[str, float]:
        """Exposure, gain, focus and white balance as the camera last reported them; without what it does not have."""
        return dict(self._settings)

    def automatic(self) -> None:
        """Have the camera choose its settings again."""
        with self._changed:
            self._automatic_wanted = True

    def lock(self, timeout_s: float) -> LockedSettings:
        """Let the camera settle and lock it; return what it stays at. Someone else must be reading meanwhile.

        Raises:
            DeviceError: it did not come about in time, or the camera went away.
        """
        with self._changed:
            self._outcome, self._lock_wanted = None, True
            self._changed.wait_for(self._has_outcome, timeout_s)
            outcome: LockedSettings | str | None = self._outcome
            self._lock_wanted, self._locking = False, None
        if isinstance(outcome, LockedSettings):
            return outcome
        raise DeviceError(
            outcome or f"The camera {self.device!r} did not settle within {timeout_s:g} s: does it give pictures?"
        )

    def _has_outcome(self) -> bool:
        return self._outcome is not None

    def lock_alone(self) -> LockedSettings:
        """Let the open camera settle and lock it while nobody else reads; return what it stays at.

        Raises:
            DeviceLost: it gives no pictures; DeviceError: it is not open.
        """
        if self._capture is None:
            raise DeviceError(f"The camera {self.device!r} is locked before it is opened: use it in a with statement.")
        return settle_and_lock(self._capture, backend=backend(), rate_hz=self._rate_hz)

    def _take_wishes(self, capture: OpenCapture) -> None:
        with self._changed:
            automatic, self._automatic_wanted = self._automatic_wanted, False
            lock, self._lock_wanted = self._lock_wanted, False
            if lock:
                self._locking = SettleAndLock(capture, backend=backend(), rate_hz=self._rate_hz)
            elif automatic:
                self._locking = None
        if automatic and not lock:
            set_automatic(capture, backend=backend())
