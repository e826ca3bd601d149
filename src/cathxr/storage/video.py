"""Video files: anything FFmpeg reads in, picture by picture, and lossless camera recordings out."""

from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

from cathxr.core import DataError, PixelArray
from cathxr.storage.atomic import os_reason

_SHORTFALL = 2
"""How many pictures fewer than its index says a good video may give: an edit list hides some at its ends."""

_LOSSLESS = {"level": "3", "coder": "0", "context": "0", "slices": "4", "slicecrc": "1"}
"""FFV1 version 3, every picture on its own, with check sums; the Golomb-Rice coder takes half the time of the other."""

_CRASH_SAFE = {"cluster_time_limit": "500", "flush_packets": "1"}
"""Matroska is written out twice a second, so that a killed process leaves a file that plays."""


class Video:
    """The pictures of a video file as they are stored: rotation metadata is ignored, times are not used."""

    def __init__(self, path: Path, *, is_steady: bool = False) -> None:
        """Look into the file. is_steady: each picture comes one period after the other, so that a gap is damage.

        Raises:
            DataError: missing, empty, no video, or one without pictures.
        """
        self.name = str(path)
        self._path = path
        self.notes: list[str] = []
        if path.is_file() and path.stat().st_size == 0:
            raise DataError(f"{path}: expected a video, got an empty file; record or copy it again.")
        with self._opened() as container:
            stream = _video_stream(container, path)
            self._size = (int(stream.codec_context.width), int(stream.codec_context.height))
            self._listed = int(stream.frames)
            self._duration_s = _duration_s(container, stream)
            rate = stream.average_rate
        self._steady_hz = float(rate) if is_steady and rate else None
        self.count: int | None = None
        guess = round(self._duration_s * float(rate)) if self._duration_s and rate else None
        self.about: int | None = self._listed or guess

    def first_size_px(self) -> tuple[int, int]:
        """Return width and height."""
        for pixels in self:
            return int(pixels.shape[1]), int(pixels.shape[0])
        return self._size

    def __iter__(self) -> Iterator[PixelArray]:
        """Yield each picture: grey where the video is grey, else BGR.

        Raises:
            DataError: damaged, cut off, or without pictures.
        """
        given, end_s = 0, 0.0
        with self._opened() as container:
            stream = _video_stream(container, self._path)
            stream.thread_type = "AUTO"
            start_s = float(stream.start_time * stream.time_base) if stream.start_time and stream.time_base else 0.0
            frames = container.decode(stream)
            while True:
                try:
                    frame = next(frames, None)
                except (av.FFmpegError, OSError) as error:
                    raise self._damaged(given) from error
                if frame is None:
                    break
                after_s = (frame.time or 0.0) - start_s
                if frame.is_corrupt or (self._steady_hz and round(after_s * self._steady_hz) != given):
                    raise self._damaged(given)
                if (frame.width, frame.height) != self._size and given:
                    raise DataError(
                        f"{self.name}: picture {given} is {frame.width}x{frame.height} pixels, the ones before it "
                        f"{self._size[0]}x{self._size[1]}; use a video whose size stays the same."
                    )
                self._size = (frame.width, frame.height)
                end_s = max(end_s, after_s)
                grey = frame.format.name.startswith("gray")
                yield frame.to_ndarray(format="gray" if grey else "bgr24")
                given += 1
        if not given:
            raise DataError(f"{self.name}: expected a video with pictures, got one without any; record it again.")
        # A tenth and 0.2 s: the last picture of a slow camera is shown for long, and durations are rounded.
        cut = self._duration_s is not None and end_s < 0.9 * self._duration_s - 0.2
        if self._steady_hz and self.about is not None:
            cut = given < self.about
        if cut or given < self._listed - _SHORTFALL:
            listed = self._listed or self.about
            raise DataError(
                f"{self.name}: the video is damaged or cut off: it gives {given} pictures and should hold {listed}; "
                "copy it again, or convert the good part to a new file with ffmpeg."
            )
        if self.about is not None and given < 0.95 * self.about - _SHORTFALL:
            self.notes.append(
                f"{self.name} gave {given} pictures where its length and rate suggest {self.about}: some may be missing"
            )

    def _opened(self) -> Any:
        try:
            return av.open(str(self._path), mode="r")
        except (av.FFmpegError, OSError, ValueError) as error:
            if isinstance(error, OSError):
                raise DataError(f"{self.name}: cannot read the video ({os_reason(error)}); check the path.") from error
            raise DataError(
                f"{self.name}: expected a video that FFmpeg can read or a folder of pictures, got a file that is "
                "neither, or is damaged; check that it plays."
            ) from error

    def _damaged(self, given: int) -> DataError:
        return DataError(
            f"{self.name}: the video is damaged at picture {given}; copy it again, or convert the good part to a new "
            "file with ffmpeg."
        )


def _video_stream(container: Any, path: Path) -> Any:
    if not container.streams.video:
        container.close()
        raise DataError(f"{path}: expected a video, got a file without pictures (sound only?); choose another.")
    return container.streams.video[0]


def _duration_s(container: Any, stream: Any) -> float | None:
    """Return how long the pictures go on, as far as the file says; None where it does not, or speaks of the sound."""
    if stream.duration and stream.time_base:
        return float(stream.duration * stream.time_base)
    if container.duration and len(container.streams) == 1:
        return float(container.duration / av.time_base)
    return None


class LosslessVideo:
    """Writes one camera's pictures with FFV1 in Matroska, exact to the bit. A killed process loses the last second."""

    def __init__(self, path: Path, *, size_px: tuple[int, int], is_grey: bool, rate_hz: float) -> None:
        """Make the file.

        Raises:
            DataError: it exists already or cannot be made.
        """
        self._path = path
        self._is_grey = is_grey
        self._size = size_px
        self.written = 0
        try:
            path.touch(exist_ok=False)  # FFmpeg itself opens the file only with the first picture
            self._container = av.open(str(path), "w", format="matroska", options=_CRASH_SAFE)
            stream: Any = self._container.add_stream("ffv1", rate=Fraction(rate_hz).limit_denominator(1001))
        except FileExistsError as error:
            raise DataError(f"{path}: there is a recording already; choose another name.") from error
        except (av.FFmpegError, OSError, ValueError) as error:
            raise _refused(path, error) from error
        stream.width, stream.height = size_px
        stream.pix_fmt = "gray" if is_grey else "bgr0"
        stream.codec_context.options = dict(_LOSSLESS)
        stream.codec_context.thread_type = "SLICE"
        stream.codec_context.thread_count = 2
        self._stream = stream

    def write(self, pixels: PixelArray) -> int:
        """Append a picture and return its 0-based index in the video.

        Raises:
            DataError: another size or kind than the first picture's, or the disk refuses.
        """
        height, width = pixels.shape[:2]
        if (width, height) != self._size or (pixels.ndim == 2) != self._is_grey:
            raise DataError(
                f"{self._path}: the camera changed its pictures while recording (now {width}x{height}); "
                "stop the recording and begin a new one."
            )
        try:
            contiguous = np.ascontiguousarray(pixels)
            frame = av.VideoFrame.from_ndarray(contiguous, format="gray" if self._is_grey else "bgr24")
            if not self._is_grey:
                frame = frame.reformat(format="bgr0")
            frame.pts = self.written
            frame.time_base = Fraction(1, 1) / self._stream.codec_context.rate
            for packet in self._stream.encode(frame):
                self._container.mux(packet)
        except (av.FFmpegError, OSError) as error:
            raise _refused(self._path, error) from error
        self.written += 1
        return self.written - 1

    def close(self) -> None:
        """Finish the file.

        Raises:
            DataError: the disk refuses.
        """
        try:
            for packet in self._stream.encode(None):
                self._container.mux(packet)
            self._container.close()
        except (av.FFmpegError, OSError) as error:
            with suppress(av.FFmpegError, OSError):
                self._container.close()
            raise _refused(self._path, error) from error


def _refused(path: Path, error: Exception) -> DataError:
    reason = os_reason(error) if isinstance(error, OSError) else str(error)
    return DataError(f"{path}: cannot write the video ({reason}); check the folder and the space on the disk.")
