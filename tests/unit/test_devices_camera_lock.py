"""Settling and locking a camera, with cameras that behave, that lie, and that cannot be set."""

import math
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from cathxr.core import DeviceError, DeviceLost, DeviceNotFound
from cathxr.devices.adjustable_camera import AdjustableCamera
from cathxr.devices.camera_lock import LockedSettings, current_settings, set_automatic, settle_and_lock
from cathxr.devices.clock import MonotonicClock
from cathxr.devices.listing import backend, stable_name

LONG_S = 30.0
_START = 10.0


@dataclass
class FakeCamera:
    """A camera whose picture's brightness is light times exposure. On automatic it goes to `wanted` in steps.

    lies: on automatic it reports its last fixed exposure instead of the one it uses. controls: what can be set.
    delay: pictures until a new exposure shows. grabs: how many pictures there are.
    """

    light: float = 1.0
    wanted: float = 120.0
    lies: bool = False
    v4l2: bool = True
    fixed_brightness: float | None = None
    restless: bool = False
    delay: int = 3
    grabs: int = 10**9
    controls: frozenset[int] = frozenset(
        (cv2.CAP_PROP_AUTO_EXPOSURE, cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_GAIN, cv2.CAP_PROP_AUTO_WB,
         cv2.CAP_PROP_WB_TEMPERATURE)
    )  # fmt: skip
    values: dict[int, float] = field(
        default_factory=lambda: {cv2.CAP_PROP_GAIN: 7.0, cv2.CAP_PROP_WB_TEMPERATURE: 4600.0}
    )
    reported: float = 33.0
    used: float = _START
    opens: bool = True
    released: bool = False
    shown: list[float] = field(default_factory=list)

    @property
    def automatic(self) -> bool:
        return self.values.get(cv2.CAP_PROP_AUTO_EXPOSURE, 1.0) != (1.0 if self.v4l2 else 0.0)

    def isOpened(self) -> bool:  # noqa: N802
        return self.opens

    def release(self) -> None:
        self.released = True

    def set(self, prop: int, value: float) -> bool:
        if prop not in self.controls:
            return False
        if prop == cv2.CAP_PROP_EXPOSURE:
            if not self.automatic:
                self.used = self.reported = float(round(value))
            return True
        if prop == cv2.CAP_PROP_AUTO_EXPOSURE and self.v4l2 and value not in (1.0, 3.0):
            return False
        self.values[prop] = value
        return True

    def get(self, prop: int) -> float:
        if prop == cv2.CAP_PROP_EXPOSURE and prop in self.controls:
            return self.reported if self.lies or not self.automatic else float(round(self.used))
        return self.values.get(prop, -1.0) if prop in self.controls else -1.0

    def grab(self) -> bool:
        self.grabs -= 1
        if self.automatic and not self.restless:
            self.used += 0.4 * (self.wanted - self.used)
        if self.restless:
            self.used = 150.0 if self.used < 100.0 else 60.0
        self.shown.append(self.used)
        return self.grabs >= 0

    def retrieve(self) -> tuple[bool, Any]:
        exposure = self.shown[max(0, len(self.shown) - 1 - self.delay)]
        factor = exposure if self.v4l2 else 120.0 * 2.0 ** (exposure + 5.0)
        value = self.fixed_brightness or min(255.0, self.light * factor)
        return True, np.full((16, 16, 3), round(value), np.uint8)


def test_a_camera_is_fixed_where_it_has_settled() -> None:
    camera = FakeCamera()
    locked = settle_and_lock(camera, backend=cv2.CAP_V4L2)
    assert not camera.automatic
    assert locked.options == {"exposure": 120.0, "gain": 7.0, "white_balance": 4600.0}
    assert locked.focus is None  # a lens without motor
    assert locked.warnings == ()
    assert locked.brightness_after == pytest.approx(locked.brightness_before, abs=1.0)  # rounded to whole levels
    assert camera.values[cv2.CAP_PROP_AUTO_WB] == 0.0


def test_an_exposure_that_is_misreported_on_automatic_is_found_by_the_pictures_brightness() -> None:
    camera = FakeCamera(lies=True, light=0.5, wanted=200.0)
    locked = settle_and_lock(camera, backend=cv2.CAP_V4L2)
    # 4 % of brightness is what the search stops at, and the picture itself is rounded to whole levels
    assert locked.exposure == pytest.approx(200.0, rel=0.05)
    assert locked.brightness_after == pytest.approx(100.0, rel=0.05)
    assert locked.warnings == ()


def test_exposures_in_powers_of_two_are_matched_too() -> None:
    camera = FakeCamera(v4l2=False, lies=True, wanted=-5.0, reported=-8.0, used=-9.0)
    locked = settle_and_lock(camera, backend=cv2.CAP_DSHOW)
    assert locked.exposure == -5.0
    assert locked.warnings == ()


def test_what_cannot_be_locked_is_said() -> None:
    camera = FakeCamera(controls=frozenset())
    locked = settle_and_lock(camera, backend=cv2.CAP_V4L2)
    assert locked.options == {}
    assert "does not let its exposure be fixed" in locked.warnings[0]


def test_a_picture_that_changes_when_locked_is_said() -> None:
    class Stubborn(FakeCamera):
        def set(self, prop: int, value: float) -> bool:
            taken = super().set(prop, value)
            if not self.automatic:
                self.used = 40.0  # whatever it is told
            return taken

    locked = settle_and_lock(Stubborn(), backend=cv2.CAP_V4L2)
    assert "darker than it was on automatic" in locked.warnings[0]


def test_a_camera_that_never_rests_is_locked_and_said() -> None:
    locked = settle_and_lock(FakeCamera(restless=True), backend=cv2.CAP_V4L2)
    assert "did not come to rest" in locked.warnings[0]


def test_an_exposure_longer_than_a_pictures_period_is_said() -> None:
    locked = settle_and_lock(FakeCamera(wanted=250.0, light=0.5), backend=cv2.CAP_V4L2, rate_hz=60.0)
    assert "25.0 ms is longer than a picture's 16.7 ms at 60 Hz" in locked.warnings[0]


def test_a_camera_without_pictures_is_lost() -> None:
    with pytest.raises(DeviceLost, match="while it settled"):
        settle_and_lock(FakeCamera(grabs=8), backend=cv2.CAP_V4L2)


def test_current_settings_leave_out_what_is_not_there() -> None:
    camera = FakeCamera()
    set_automatic(camera, backend=cv2.CAP_V4L2)
    assert current_settings(camera) == {"exposure": 10.0, "gain": 7.0, "white_balance": 4600.0}


def adjustable(camera: FakeCamera) -> AdjustableCamera:
    camera.v4l2 = backend() == cv2.CAP_V4L2
    if not camera.v4l2:
        camera.wanted, camera.used, camera.reported = -5.0, -7.0, -6.0
    return AdjustableCamera(0, "device-0", clock=MonotonicClock(), opener=lambda device: camera)


def test_pictures_go_on_while_an_adjustable_camera_is_locked_from_another_thread() -> None:
    fake = FakeCamera()
    answers: list[LockedSettings] = []
    with adjustable(fake) as camera:
        assert fake.automatic
        asking = threading.Thread(target=lambda: answers.append(camera.lock(LONG_S)))
        asking.start()
        seen = []
        while asking.is_alive() and len(seen) < 5000:
            image = camera.read(1.0)
            assert image is not None
            seen.append(image.seq)
        asking.join(LONG_S)
        assert not fake.automatic
        assert camera.settings["gain"] == 7.0
        camera.automatic()
        camera.read(1.0)
        assert fake.automatic
    assert fake.released
    assert len(answers) == 1
    assert math.isfinite(answers[0].brightness_after)
    assert seen == list(range(len(seen)))


def test_an_adjustable_camera_that_goes_away_ends_the_locking() -> None:
    fake = FakeCamera(grabs=5)
    said: list[str] = []

    def ask() -> None:
        try:
            camera.lock(LONG_S)
        except DeviceError as error:
            said.append(str(error))

    with pytest.raises(DeviceLost), adjustable(fake) as camera:  # noqa: PT012
        asking = threading.Thread(target=ask)
        asking.start()
        while True:
            camera.read(1.0)
    asking.join(LONG_S)
    assert len(said) == 1


def test_an_adjustable_camera_locks_alone() -> None:
    with adjustable(FakeCamera()) as camera:
        assert camera.lock_alone().warnings == ()


def test_an_adjustable_camera_that_does_not_open_is_named() -> None:
    fake = FakeCamera(opens=False)
    with pytest.raises(DeviceNotFound, match="cannot be opened"):
        adjustable(fake).__enter__()
    assert fake.released


def test_a_device_gets_the_name_of_its_socket(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = tmp_path / "video4"
    device.touch()
    links = tmp_path / "v4l"
    for folder, name in (("by-id", "usb-maker_model-video-index0"), ("by-path", "pci-0-usb-0:1.2:1.0-video-index0")):
        (links / folder).mkdir(parents=True)
        try:
            (links / folder / name).symlink_to(device)
        except OSError:
            pytest.skip("this system lets nobody make symbolic links")
    assert stable_name(str(device), links=links) == str(links / "by-path" / "pci-0-usb-0:1.2:1.0-video-index0")
    assert stable_name(str(tmp_path / "video9"), links=links) == str(tmp_path / "video9")
    assert stable_name(3, links=links) == 3
    (links / "by-path" / "pci-0-usb-0:1.2:1.0-video-index0").unlink()
    assert stable_name(str(device), links=links) == str(links / "by-id" / "usb-maker_model-video-index0")
    assert stable_name(str(device), links=tmp_path / "none") == str(device)
