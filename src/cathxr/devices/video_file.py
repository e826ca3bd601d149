"""A video file played as if it were a camera: one picture each frame period, and what is late is skipped."""

import cv2
import numpy as np

from cathxr.core import Clock, DeviceLost, DeviceNotFound, EndOfStream
from cathxr.devices.grabbing import Grabbed


class VideoFile:
    """Plays a file or URL from its opening on. t_ns: when a picture is due, which is its instant."""

    def __init__(self, path: str, clock: Clock, *, first_seq: int, loop: bool) -> None:
        self._path, self._clock, self._loop = path, clock, loop
        self._capture = self._opened()
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        self._period_ns = 1e9 / rate_hz if 0.1 < rate_hz < 1000.0 else 1e9 / 30.0
        self._start_ns = clock.now_ns()
        self._first_seq = self._seq = first_seq

    @property
    def next_seq(self) -> int:
        """The number that the next picture would have."""
        return self._seq

    def next(self, timeout_s: float) -> Grabbed | None:
        """Return the picture that is due next, None when that is not within `timeout_s`.

        Raises:
            EndOfStream: the file is at its end; DeviceLost: the stream from a URL is.
        """
        now_ns, due_ns = self._clock.now_ns(), self._due_ns()
        until_ns = now_ns + round(max(0.0, timeout_s) * 1e9)
        self._clock.wait_until_ns(min(due_ns, until_ns))
        if due_ns > until_ns:
            return None
        while self._due_ns() + self._period_ns < now_ns and self._capture.grab():
            self._seq += 1
        came, data = self._capture.read()
        if not came and self._loop and self._seq > self._first_seq:
            self._capture.release()
            self._capture = self._opened()
            came, data = self._capture.read()
        if not came:
            if "://" in self._path:
                raise DeviceLost(f"The stream {self._path} has ended.")
            raise EndOfStream
        grabbed = Grabbed(self._seq, self._due_ns(), np.asarray(data, dtype=np.uint8), encoded=False)
        self._seq += 1
        return grabbed

    def close(self) -> None:
        """Close the file."""
        self._capture.release()

    def _due_ns(self) -> int:
        return self._start_ns + round((self._seq - self._first_seq) * self._period_ns)

    def _opened(self) -> cv2.VideoCapture:
        capture = cv2.VideoCapture(self._path)
        capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        if not capture.isOpened():
            raise DeviceNotFound(f"{self._path} cannot be played: it is no video that FFmpeg reads.")
        return capture
