"""The OpenCV camera without a camera: what it asks for, what it makes of the answers, and how it fails."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from cathxr.core import ConfigError, DeviceError, DeviceLost, DeviceNotFound, Rig, RigCamera
from cathxr.devices.camera_settings import CameraOptions, apply_settings, checked_options, fourcc_name
from cathxr.devices.clock import ManualClock, MonotonicClock
from cathxr.devices.grabbing import Grabbed, Grabber, Stamps
from cathxr.devices.listing import CameraDevice, list_cameras, listing_sentence
from cathxr.devices.opencv_camera import OpenCVCamera, _decoded
from cathxr.storage.rig_file import example_rig

MJPG = float(cv2.VideoWriter.fourcc(*"MJPG"))
YUYV = float(cv2.VideoWriter.fourcc(*"YUYV"))
LONG_S = 20.0


@dataclass
class FakeCapture:
    """Behaves as cv2.VideoCapture. `fixed`: what it will not change; `grabs`: how many pictures there are."""

    fixed: dict[int, float] = field(default_factory=dict)
    values: dict[int, float] = field(default_factory=dict)
    grabs: int = 10**9
    stamp_ms: Callable[[], float] = lambda: 0.0
    released: bool = False
    order: list[int] = field(default_factory=list)

    def set(self, prop: int, value: float) -> bool:
        self.order.append(prop)
        if prop in self.fixed:
            return False
        self.values[prop] = value
        return True

    def get(self, prop: int) -> float:
        if prop == cv2.CAP_PROP_POS_MSEC:
            return self.stamp_ms()
        return self.fixed.get(prop, self.values.get(prop, 0.0))

    def grab(self) -> bool:
        time.sleep(0.001)
        self.grabs -= 1
        return self.grabs >= 0

    def retrieve(self) -> tuple[bool, Any]:
        return True, np.zeros((4, 4, 3), np.uint8)

    def release(self) -> None:
        self.released = True


@pytest.fixture
def rig() -> Rig:
    return example_rig()


@pytest.fixture
def top(rig: Rig) -> RigCamera:
    return rig.cameras["top"]


OPTIONS = CameraOptions(device=0, exposure=50.0, gain=10.0, focus=0.0, white_balance=4600.0)


def test_everything_is_set_and_nothing_is_said_when_the_camera_agrees(top: RigCamera) -> None:
    capture = FakeCapture()
    assert apply_settings(capture, OPTIONS, top, backend=cv2.CAP_V4L2) == ()
    wanted = {
        cv2.CAP_PROP_FOURCC: MJPG,
        cv2.CAP_PROP_FRAME_WIDTH: 1280.0,
        cv2.CAP_PROP_FRAME_HEIGHT: 720.0,
        cv2.CAP_PROP_FPS: 60.0,
        cv2.CAP_PROP_BUFFERSIZE: 1.0,
        cv2.CAP_PROP_AUTO_EXPOSURE: 1.0,  # V4L2's manual mode
        cv2.CAP_PROP_AUTOFOCUS: 0.0,
        cv2.CAP_PROP_AUTO_WB: 0.0,
        cv2.CAP_PROP_EXPOSURE: 50.0,
        cv2.CAP_PROP_GAIN: 10.0,
        cv2.CAP_PROP_FOCUS: 0.0,
        cv2.CAP_PROP_WB_TEMPERATURE: 4600.0,
    }
    assert capture.values == wanted
    assert capture.order[0] == cv2.CAP_PROP_FOURCC  # a change of format resets the others
    assert capture.order.index(cv2.CAP_PROP_AUTO_EXPOSURE) < capture.order.index(cv2.CAP_PROP_EXPOSURE)


def test_whatever_is_not_taken_is_said(top: RigCamera) -> None:
    fixed = {
        cv2.CAP_PROP_FOURCC: YUYV,
        cv2.CAP_PROP_FPS: 30.0,
        cv2.CAP_PROP_EXPOSURE: 157.0,
        cv2.CAP_PROP_GAIN: -1.0,
    }
    said = apply_settings(FakeCapture(fixed), OPTIONS, top, backend=cv2.CAP_V4L2)
    assert said == (
        "The camera's format is YUYV, MJPG was asked for.",
        "The camera's rate is 30, 60 was asked for.",
        "The camera's exposure is 157, 50 was asked for.",
        "The camera has no control for its gain.",
    )


def test_what_nobody_chose_is_left_but_never_automatic(top: RigCamera) -> None:
    capture = FakeCapture({cv2.CAP_PROP_AUTOFOCUS: -1.0})  # a lens without motor is no reason to complain
    assert apply_settings(capture, CameraOptions(device=0), top, backend=cv2.CAP_DSHOW) == ()
    assert capture.values[cv2.CAP_PROP_AUTO_EXPOSURE] == 0.0
    assert cv2.CAP_PROP_EXPOSURE not in capture.order


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({}, "device must say which camera"),
        ({"device": True}, "device must say"),
        ({"device": ""}, "device must say"),
        ({"device": 0, "fps": 30}, "fps is unknown; there are device"),
        ({"device": 0, "exposure": "low"}, "exposure must be a number"),
        ({"device": 0, "gain": True}, "gain must be a number"),
        ({"device": 0, "buffer": 0}, "buffer must be a whole number from 1 to 10"),
        ({"device": 0, "fourcc": "JPEG2"}, "fourcc must be four letters"),
        ({"device": 0, "loop": 1}, "loop must be true or false"),
    ],
)
def test_options_that_cannot_be(options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence) as caught:
        checked_options("top", options)
    assert "top camera" in str(caught.value)


def test_format_names() -> None:
    assert fourcc_name(MJPG) == "MJPG"
    assert fourcc_name(0.0) == "0x0"


def test_the_kernels_stamp_is_taken_where_it_is_in_the_hosts_clock() -> None:
    now_ns = 5_000_000_000_000
    stamps = Stamps(hardware=True)
    assert stamps.stamp_ns(FakeCapture(stamp_ms=lambda: 4_999_990.125), now_ns) == 4_999_990_125_000
    assert stamps.warning is None


@pytest.mark.parametrize("stamp_ms", [0.0, 5_000_000.001, 4_998_999.0, 1.7e12])
def test_a_stamp_of_another_clock_is_found_out_and_never_mixed(stamp_ms: float) -> None:
    now_ns = 5_000_000_000_000
    stamps = Stamps(hardware=True)
    assert stamps.stamp_ns(FakeCapture(stamp_ms=lambda: stamp_ms), now_ns) == now_ns
    assert "stamped on arrival" in str(stamps.warning)
    assert stamps.stamp_ns(FakeCapture(stamp_ms=lambda: 4_999_990.0), now_ns) == now_ns


@pytest.fixture
def grabbers() -> Iterator[Callable[[FakeCapture], Grabber]]:
    made: list[Grabber] = []

    def make(capture: FakeCapture) -> Grabber:
        made.append(Grabber(capture, Stamps(hardware=False), clock=MonotonicClock(), first_seq=100, encoded=False))
        return made[-1]

    yield make
    for each in made:
        each.stop(LONG_S)


def test_the_newest_picture_is_handed_over_once(grabbers: Callable[[FakeCapture], Grabber]) -> None:
    capture = FakeCapture()
    grabber = grabbers(capture)
    first = grabber.newest(LONG_S)
    time.sleep(0.05)
    second = grabber.newest(LONG_S)
    assert first is not None
    assert second is not None
    assert first.seq >= 100
    assert second.seq > first.seq + 1  # those between were replaced, and the gap tells
    assert second.t_ns > first.t_ns
    grabber.stop(LONG_S)
    assert capture.released


def test_a_camera_that_is_pulled_out_is_lost_after_its_last_picture(
    grabbers: Callable[[FakeCapture], Grabber],
) -> None:
    capture = FakeCapture(grabs=1)
    grabber = grabbers(capture)
    assert grabber.newest(LONG_S) is not None
    for _ in range(2):  # and it stays lost
        with pytest.raises(DeviceLost, match="check its cable"):
            grabber.newest(LONG_S)
    grabber.stop(LONG_S)
    assert capture.released


def test_jpeg_is_decoded_and_damaged_jpeg_is_left_out() -> None:
    pixels = np.full((16, 16, 3), 90, np.uint8)
    _, data = cv2.imencode(".jpg", pixels)
    decoded = _decoded(Grabbed(0, 0, np.asarray(data).reshape(1, -1), encoded=True))
    assert decoded is not None
    assert np.abs(decoded.astype(int) - pixels).max() <= 2  # JPEG of a flat picture
    damaged = np.zeros((1, 500), np.uint8)
    assert _decoded(Grabbed(0, 0, damaged, encoded=True)) is None


def test_a_device_that_is_not_there_is_named_with_those_that_are(rig: Rig) -> None:
    camera = OpenCVCamera(rig, "top", clock=ManualClock(), options={"device": "/dev/video-that-is-not-there"})
    with pytest.raises(DeviceNotFound, match=r"top camera '/dev/video-that-is-not-there' .*(No camera|Cameras found)"):
        camera.__enter__()


def test_a_file_that_is_no_video_is_refused(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "top.mp4"
    path.write_bytes(b"not a video")
    camera = OpenCVCamera(rig, "top", clock=ManualClock(), options={"device": str(path)})
    with pytest.raises(DeviceNotFound, match="no video that FFmpeg reads"):
        camera.__enter__()


def test_pictures_of_another_size_than_the_rigs_are_refused(rig: Rig, tmp_path: Path) -> None:
    path = str(tmp_path / "small.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (320, 240))
    writer.write(np.zeros((240, 320, 3), np.uint8))
    writer.release()
    with (
        OpenCVCamera(rig, "front", clock=ManualClock(), options={"device": path}) as camera,
        pytest.raises(DeviceError, match="front camera gives pictures of 320 x 240 and the rig states 1280 x 720"),
    ):
        camera.read(1.0)


def test_cameras_are_listed_once_each_with_their_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number, index, name in ((0, "0", "Top: USB Camera"), (1, "1", "Top: USB Camera"), (10, "0", "Front")):
        folder = tmp_path / f"video{number}"
        folder.mkdir()
        (folder / "index").write_text(f"{index}\n")
        (folder / "name").write_text(f"{name}\n")
    monkeypatch.setattr("platform.system", lambda: "Linux")
    found = list_cameras(sysfs=tmp_path)
    assert found == (CameraDevice("/dev/video0", "Top: USB Camera"), CameraDevice("/dev/video10", "Front"))
    assert "Cameras found: /dev/video0 (Top: USB Camera), /dev/video10 (Front)." in listing_sentence(found)
    assert "No camera is connected" in listing_sentence(list_cameras(sysfs=tmp_path / "none"))
