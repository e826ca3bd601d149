"""A camera through OpenCV: V4L2 on Linux, DirectShow on Windows, AVFoundation on macOS. Video files too, for tests."""

import platform
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import cv2
import numpy as np

from cathxr.core import Clock, DeviceError, DeviceLost, DeviceNotFound, Image, PixelArray, Rig
from cathxr.devices.camera_settings import apply_settings, checked_options, fourcc_name
from cathxr.devices.grabbing import Grabbed, Grabber, Stamps, VideoCapture
from cathxr.devices.listing import backend, list_cameras, listing_sentence
from cathxr.devices.video_file import VideoFile

_STOP_S = 1.0
_DECODING = int(cv2.IMREAD_COLOR) | int(cv2.IMREAD_IGNORE_ORIENTATION)


class OpenCVCamera:
    """A Source of Images from a camera that OpenCV can open. See CameraOptions for the options.

    Stamps are the kernel's where they can be trusted, else the host's as soon as the grab returns; the rig's latency of
    this camera (stamp minus mid-exposure, as `calibrate timing` measures it) is subtracted, and from the front camera
    also front_offset_s. `seq` counts what was grabbed, so that a gap tells of pictures nobody fetched in time.
    `warnings`: what the camera did not accept. A camera that has gone can be opened again: leave and enter.

    On V4L2 with MJPG the JPEG is taken as it is and its buffer given back at once, then decoded by whoever reads: with
    a buffer of one, decoding inside the driver's buffer would cost every second picture at 60 Hz.
    """

    def __init__(self, rig: Rig, camera: str, *, clock: Clock, options: Mapping[str, Any]) -> None:
        if camera not in rig.cameras:
            raise ValueError(f"camera: expected one of {', '.join(rig.cameras)}, got {camera!r}")
        self._camera, self._rig_camera, self._clock = camera, rig.cameras[camera], clock
        self._options = checked_options(camera, options)
        timing = rig.timing
        late_s = timing.top_latency_s if camera == "top" else timing.front_latency_s + timing.front_offset_s
        self._latency_ns = round(late_s * 1e9)
        self._grabber: Grabber | None = None
        self._file: VideoFile | None = None
        self._stamps = Stamps(hardware=False)
        self._settings_warnings: tuple[str, ...] = ()
        self._next_seq = 0
        self._last_t_ns: int | None = None

    def __enter__(self) -> Self:
        if self._grabber is not None or self._file is not None:
            raise DeviceError(f"The {self._camera} camera is open already: close it first.")
        device = self._options.device
        if isinstance(device, str) and ("://" in device or Path(device).is_file()):
            self._file = VideoFile(device, self._clock, first_seq=self._next_seq, loop=self._options.loop)
        else:
            self._open_device(device)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._grabber is not None:
            self._grabber.stop(_STOP_S)
            self._next_seq, self._grabber = self._grabber.next_seq, None
        if self._file is not None:
            self._file.close()
            self._next_seq, self._file = self._file.next_seq, None

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each thing that is not as it was asked for."""
        stamps = () if self._stamps.warning is None else (self._stamps.warning,)
        return (*self._settings_warnings, *stamps)

    def read(self, timeout_s: float) -> Image | None:
        """Return the newest picture not yet read, None when none came in `timeout_s`.

        Raises:
            DeviceLost: the camera gives no more; DeviceError: its pictures are not of the rig's size.
            EndOfStream: the video file is at its end.
        """
        grabbed = self._next(timeout_s)
        if grabbed is None:
            return None
        pixels = _decoded(grabbed)
        t_ns = grabbed.t_ns - self._latency_ns
        if pixels is None or (self._last_t_ns is not None and t_ns <= self._last_t_ns):
            return None  # a damaged picture, or a stamp that goes back: left out, and a gap in seq tells
        self._last_t_ns = t_ns
        image = Image(self._camera, grabbed.seq, t_ns, pixels)
        if image.size_px != self._rig_camera.size_px:
            raise DeviceError(
                f"The {self._camera} camera gives pictures of {_size(image.size_px)} and the rig states "
                f"{_size(self._rig_camera.size_px)}: calibrate for this size, or set the camera to the rig's."
            )
        return image

    def _next(self, timeout_s: float) -> Grabbed | None:
        if self._grabber is not None:
            return self._grabber.newest(timeout_s)
        if self._file is not None:
            return self._file.next(timeout_s)
        raise DeviceError(f"The {self._camera} camera is read before it is opened: use it in a with statement.")

    def _open_device(self, device: int | str) -> None:
        """Open, set up and start a real camera."""
        what = f"The {self._camera} camera {device!r}"
        if platform.system() == "Linux" and isinstance(device, str) and not Path(device).exists():
            raise DeviceNotFound(f"{what} is not there. {listing_sentence(list_cameras())}")
        capture = cv2.VideoCapture(device, backend())
        if not capture.isOpened():
            capture.release()
            raise DeviceNotFound(
                f"{what} cannot be opened: it is not there, or another program uses it. "
                f"{listing_sentence(list_cameras())}"
            )
        try:
            v4l2 = capture.get(cv2.CAP_PROP_BACKEND) == cv2.CAP_V4L2
            self._settings_warnings = apply_settings(
                cast(VideoCapture, capture), self._options, self._rig_camera, backend=backend()
            )
            jpeg = v4l2 and fourcc_name(capture.get(cv2.CAP_PROP_FOURCC)) == "MJPG"
            encoded = jpeg and bool(capture.set(cv2.CAP_PROP_CONVERT_RGB, 0.0))
        except cv2.error as error:
            capture.release()
            raise DeviceLost(f"{what} failed while it was set up: {error}") from error
        self._stamps = Stamps(hardware=v4l2)
        self._grabber = Grabber(
            cast(VideoCapture, capture), self._stamps, clock=self._clock, first_seq=self._next_seq, encoded=encoded
        )


def _decoded(grabbed: Grabbed) -> PixelArray | None:
    """Return the picture's pixels, None for one that came damaged."""
    if not grabbed.encoded:
        return grabbed.data
    pixels = cv2.imdecode(grabbed.data.reshape(-1), _DECODING)
    return None if pixels is None else np.asarray(pixels, dtype=np.uint8)


def _size(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]}"
