"""A thread that waits in a camera's blocking grab, so that reading can have a timeout, and keeps the newest picture."""

import threading
import time
from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np

from cathxr.core import Clock, DeviceLost, PixelArray
from cathxr.devices.camera_settings import Capture

_FAILED_GRABS = 5
_PAUSE_S = 0.02
_OLDEST_STAMP_NS = 1_000_000_000


class VideoCapture(Capture, Protocol):
    """The part of cv2.VideoCapture that grabs."""

    def grab(self) -> bool: ...
    def retrieve(self) -> tuple[bool, Any]: ...
    def release(self) -> None: ...


@dataclass(frozen=True, eq=False)
class Grabbed:
    """One picture as it came. t_ns: the driver's stamp, or the host's right after the grab. encoded: still a JPEG."""

    seq: int
    t_ns: int
    data: PixelArray
    encoded: bool


class Stamps:
    """When a picture was taken, in the host's monotonic clock: the kernel's stamp where it is one, else the host's own.

    V4L2 stamps with the kernel's monotonic clock when the picture is in, free of the delay until this program runs
    again; OpenCV gives that stamp as CAP_PROP_POS_MSEC. A driver that stamps with another clock is found out: its
    stamps do not lie within the second before now. From then on the host's are used, so that the two never mix.
    """

    def __init__(self, *, hardware: bool) -> None:
        self.hardware = hardware
        self.warning: str | None = None

    def stamp_ns(self, capture: Capture, now_ns: int) -> int:
        """Return the instant of the picture that was grabbed just now, at `now_ns`."""
        if not self.hardware:
            return now_ns
        stamp_ns = round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        if 0 <= now_ns - stamp_ns <= _OLDEST_STAMP_NS:
            return stamp_ns
        self.hardware = False
        self.warning = "The camera's own time stamps are not in the host's clock: pictures are stamped on arrival."
        return now_ns


class Grabber:
    """Grabs in a thread until stopped; `newest` hands each picture over at most once. Its thread ends the capture."""

    def __init__(self, capture: VideoCapture, stamps: Stamps, *, clock: Clock, first_seq: int, encoded: bool) -> None:
        self._capture, self._stamps, self._clock, self._encoded = capture, stamps, clock, encoded
        self._changed = threading.Condition()
        self._newest: Grabbed | None = None
        self._seq = first_seq
        self._lost: str | None = None
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="grabbing", daemon=True)
        self._thread.start()

    @property
    def next_seq(self) -> int:
        """The number that the next picture would have."""
        return self._seq

    def newest(self, timeout_s: float) -> Grabbed | None:
        """Return the newest picture not yet handed over, None when none came in `timeout_s`.

        Raises:
            DeviceLost: the camera gives no more.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._lost is not None, max(0.0, timeout_s))
            grabbed, self._newest = self._newest, None
            if grabbed is None and self._lost is not None:
                raise DeviceLost(self._lost)
            return grabbed

    def stop(self, timeout_s: float) -> None:
        """Have the thread end and the capture released; one that hangs in the system is left to itself."""
        with self._changed:
            self._stopping = True
        self._thread.join(timeout_s)

    def _run(self) -> None:
        failed = 0
        try:
            while not self._stopping and failed < _FAILED_GRABS:
                if self._grab():
                    failed = 0
                else:
                    failed += 1
                    time.sleep(_PAUSE_S)
            self._end(f"gave no picture {_FAILED_GRABS} times in a row")
        except Exception as error:  # a thread's top: raised again in `newest`
            self._end(f"failed ({type(error).__name__}: {error})")
        finally:
            self._capture.release()

    def _grab(self) -> bool:
        """Wait for one picture and keep it; return whether it came."""
        if not self._capture.grab():
            return False
        t_ns = self._stamps.stamp_ns(self._capture, self._clock.now_ns())
        came, data = self._capture.retrieve()
        if not came or data is None:
            return False
        with self._changed:
            self._newest = Grabbed(self._seq, t_ns, np.asarray(data, dtype=np.uint8), self._encoded)
            self._seq += 1
            self._changed.notify_all()
        return True

    def _end(self, how: str) -> None:
        with self._changed:
            self._lost = f"The camera {how}: check its cable; it is opened again by itself."
            self._changed.notify_all()
