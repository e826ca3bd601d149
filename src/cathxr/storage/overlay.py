"""The overlay video: both pictures side by side with the reconstructed curve drawn through the rig's cameras."""

import os
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import av
import cv2
import numpy as np
from av.video.frame import PictureType

from cathxr.core import DataError, FloatArray, PixelArray, Rig, Status, Track
from cathxr.geometry import CameraModel
from cathxr.storage.atomic import AtomicFile, os_reason

_WIDEST = 1920
_COLOURS = {Status.TRACKED: (60, 220, 60), Status.COASTING: (0, 190, 255), Status.LOST: (70, 70, 255)}
"""BGR: green, amber, red."""
_TIP = (255, 80, 255)
_SHIFT = 4
_STRIP, _BASE, _CAPTION_LEFT = 32, 22, 90
"""px: height of the dark strip with the text above the views, its base line, where the caption begins."""
_OPTIONS = {"crf": "18", "preset": "veryfast", "forced-idr": "1"}


class OverlayWriter:
    """Writes H.264 (yuv420p, fast start) that browsers play. A context manager; whole or not at all, like the CSV."""

    def __init__(self, path: str | os.PathLike[str], rig: Rig) -> None:
        """Take the path (any name; the content is MP4) and the rig that the pictures were taken with."""
        self._file = AtomicFile(Path(path))
        self._cameras = {name: CameraModel.of(rig.cameras[name]) for name in ("top", "front")}
        self._rate = Fraction(rig.cameras["top"].rate_hz).limit_denominator(1001)
        wide = sum(each.size_px[0] for each in self._cameras.values())
        self._scale = min(1.0, _WIDEST / wide)
        self._container: Any = None
        self._status: Status | None = None
        self.frames = 0

    def __enter__(self) -> Self:
        """Open the file.

        Raises:
            DataError: it cannot be made, or this FFmpeg has no H.264.
        """
        if "libx264" not in av.codecs_available:
            raise DataError(
                f"{self._file.target}: this FFmpeg cannot write H.264; install PyAV from PyPI, or leave --overlay out."
            )
        try:
            self._file.part.touch(exist_ok=False)  # FFmpeg itself opens the file only with the first picture
            options = {"movflags": "+faststart"}
            self._container = av.open(str(self._file.part), "w", format="mp4", options=options)
            stream = self._container.add_stream("libx264", rate=self._rate)
        except (av.FFmpegError, OSError, ValueError) as error:
            self._file.abort()
            raise self._refused(error) from error
        sizes = [_scaled_size(each.size_px, self._scale) for each in self._cameras.values()]
        width, height = sum(each[0] for each in sizes), max(each[1] for each in sizes)
        stream.width, stream.height = width, _STRIP + height + height % 2
        stream.pix_fmt = "yuv420p"
        stream.codec_context.options = dict(_OPTIONS)
        self._stream = stream
        self._sizes = sizes
        return self

    def write(self, top: PixelArray, front: PixelArray, track: Track) -> None:
        """Append a picture pair, each in its camera's full size, with its Track.

        Raises:
            DataError: the disk refuses.
        """
        canvas = np.zeros((self._stream.height, self._stream.width, 3), dtype=np.uint8)
        left = 0
        for (name, camera), pixels, size in zip(self._cameras.items(), (top, front), self._sizes, strict=True):
            view = drawn(pixels, camera, track, size_px=size)
            canvas[_STRIP : _STRIP + size[1], left : left + size[0]] = view
            _label(canvas, name, (left + 8, _BASE), (220, 220, 220))
            left += size[0]
        _label(canvas, caption(track), (_CAPTION_LEFT, _BASE), _COLOURS[track.status])
        try:
            frame = av.VideoFrame.from_ndarray(canvas, format="bgr24")
            if track.status is not self._status:
                # Coded afresh: a differential picture would leave a ghost of the curve behind on a lost pair.
                frame.pict_type = PictureType.I
                self._status = track.status
            for packet in self._stream.encode(frame):
                self._container.mux(packet)
        except (av.FFmpegError, OSError) as error:
            raise self._refused(error) from error
        self.frames += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the video in place, or remove it after an error or without a picture."""
        try:
            if kind is None and self.frames:
                for packet in self._stream.encode(None):
                    self._container.mux(packet)
            self._container.close()
        except (av.FFmpegError, OSError) as refusal:
            self._file.abort()
            if kind is None:
                raise self._refused(refusal) from refusal
            return
        if kind is None and self.frames:
            self._file.commit()
        else:
            self._file.abort()

    def discard(self) -> None:
        """Remove what is not in place yet; after a good end there is nothing to remove."""
        self._file.abort()

    def _refused(self, error: Exception) -> DataError:
        reason = os_reason(error) if isinstance(error, OSError) else str(error)
        return DataError(f"{self._file.target}: cannot write the overlay ({reason}); check the folder and the disk.")


def drawn(pixels: PixelArray, camera: CameraModel, track: Track, *, size_px: tuple[int, int]) -> PixelArray:
    """Return a picture scaled to `size_px` (width, height), as BGR, with the Track's curve and tip drawn on it."""
    view = cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR) if pixels.ndim == 2 else pixels
    if size_px != (view.shape[1], view.shape[0]):
        view = cv2.resize(view, size_px, interpolation=cv2.INTER_AREA)
    else:
        view = view.copy()
    if track.shape_box is None:
        return np.asarray(view, dtype=np.uint8)
    shape = track.shape_box[camera.to_camera(track.shape_box)[:, 2] > 0]
    if len(shape) == 0:
        return np.asarray(view, dtype=np.uint8)
    # Centres of pixels, not their corners, are whole numbers: scaling moves them by half a pixel and back.
    scale = np.array(size_px) / np.array(camera.size_px)
    curve = (camera.project(shape) + 0.5) * scale - 0.5
    line = _fixed_point(curve)
    # Thin and without an outline: the silhouette must stay visible on both sides of the line.
    cv2.polylines(view, [line], False, _COLOURS[track.status], 1, cv2.LINE_AA, _SHIFT)
    if np.array_equal(shape[0], track.shape_box[0]):
        tip = (int(line[0, 0, 0]), int(line[0, 0, 1]))
        cv2.circle(view, tip, 8 << _SHIFT, _TIP, 1, cv2.LINE_AA, _SHIFT)
        cv2.circle(view, tip, 2 << _SHIFT, _TIP, -1, cv2.LINE_AA, _SHIFT)
    return np.asarray(view, dtype=np.uint8)


def caption(track: Track) -> str:
    """Return the line of text for a Track: pair, status, tip in mm."""
    reason = f" ({track.reason})" if track.reason else ""
    tip = track.tip_box
    where = "" if tip is None else "   tip " + " ".join(f"{each:.2f}" for each in tip) + " mm"
    return f"pair {track.seq}   {track.status.value}{reason}{where}"


def _label(canvas: PixelArray, text: str, at: tuple[int, int], colour: tuple[int, int, int]) -> None:
    plain = text.encode("ascii", "replace").decode("ascii")  # OpenCV's own fonts know few other letters
    cv2.putText(canvas, plain, at, cv2.FONT_HERSHEY_SIMPLEX, 0.55, colour, 1, cv2.LINE_AA)


def _fixed_point(curve: FloatArray) -> Any:
    """Return pixels (N, 2) as OpenCV's fixed-point integers (N, 1, 2), kept where they fit."""
    limited = np.clip(curve, -10_000.0, 100_000.0)
    return np.round(limited * (1 << _SHIFT)).astype(np.int32)[:, None, :]


def _scaled_size(size_px: tuple[int, int], scale: float) -> tuple[int, int]:
    """Return width and height scaled, the width even and never rounded up beyond the limit."""
    width, height = (max(2, int(each * scale)) for each in size_px)
    return width - width % 2, height
