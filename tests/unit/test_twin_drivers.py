"""The twin's drivers on a clock that the test moves: order, stamps, losses, truth."""

import dataclasses
import threading

import numpy as np
import pytest

from cathxr.core import ConfigError, DeviceError
from cathxr.devices.clock import ManualClock, MonotonicClock
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import angle_between
from cathxr.storage.rig_file import example_rig
from cathxr.twin import TwinSettings, TwinWorld, true_rig
from cathxr.twin.drivers import TwinCamera, TwinEncoder
from cathxr.twin.placement import SHIFT_MM, TURN_DEG

NS = 1_000_000_000
RIG = example_rig()


def test_camera_gives_stamped_numbered_pictures_once_they_are_exposed() -> None:
    clock = ManualClock(10 * NS)
    with TwinCamera(RIG, "top", clock=clock, options={"rate_hz": 30.0}) as camera:
        pictures = [camera.read(1.0) for _ in range(3)]
        assert camera.losses == 0
    assert [each.seq for each in pictures if each] == [0, 1, 2]
    stamps = [each.t_ns for each in pictures if each]
    assert np.diff(stamps) == pytest.approx(NS / 30, abs=1)
    # The last is read half an exposure after its stamp, no earlier.
    assert clock.now_ns() == stamps[-1] + 2_000_000


def test_read_gives_none_when_nothing_comes_in_time() -> None:
    clock = ManualClock(10_000_000)
    with TwinCamera(RIG, "front", clock=clock, options={"rate_hz": 10.0}) as camera:
        assert camera.read(0.0) is None
        assert camera.read(0.05) is None
        assert clock.now_ns() == 60_000_000
        assert camera.read(0.1) is not None


def test_a_late_reader_gets_the_newest_picture_and_the_rest_counts_as_lost() -> None:
    clock = ManualClock(0)
    with TwinCamera(RIG, "top", clock=clock, options={"rate_hz": 20.0}) as camera:
        first = camera.read(1.0)
        clock.advance_ns(NS)
        late = camera.read(1.0)
        assert first is not None
        assert late is not None
        assert late.seq - first.seq == 20
        assert camera.losses == 19
        assert clock.now_ns() - late.t_ns < NS / 20 + 2_000_001


def test_two_cameras_and_the_encoder_show_one_world() -> None:
    world = TwinWorld(RIG, seed=8, settings=TwinSettings(front_skew_ms=7.0))
    clock, options = ManualClock(NS), {"world": world}
    with (
        TwinCamera(RIG, "top", clock=clock, options=options) as top,
        TwinCamera(RIG, "front", clock=clock, options=options) as front,
    ):
        one, other = top.read(1.0), front.read(1.0)
    assert one is not None
    assert other is not None
    assert other.t_ns - one.t_ns == 7_000_000
    for image, name in ((one, "top"), (other, "front")):
        truth = world.truth(image.t_ns)
        assert truth.shape_box is not None
        u, v = np.rint(CameraModel.of(RIG.cameras[name]).project(truth.shape_box[5])).astype(int)
        assert image.pixels[v - 2 : v + 3, u - 2 : u + 3].max() < 60, "the tube is dark where the truth says it is"


def test_separate_worlds_of_the_same_seed_are_the_same() -> None:
    pixels = []
    for _ in range(2):
        clock = ManualClock(NS)
        with TwinCamera(RIG, "top", clock=clock, options={"seed": 3, "scene": "curl"}) as camera:
            image = camera.read(1.0)
            assert image is not None
            pixels.append(image.pixels)
    assert np.array_equal(*pixels)


def test_dropped_pictures_leave_gaps_in_the_numbers_and_count_as_lost() -> None:
    clock = ManualClock(0)
    options = {"rate_hz": 30.0, "settings": {"drop_share": 0.3, "fault": "black"}}
    with TwinCamera(RIG, "top", clock=clock, options=options) as camera:
        numbers = [image.seq for _ in range(200) if (image := camera.read(5.0)) is not None]
        lost = camera.losses
    assert numbers[-1] + 1 == 200 + lost
    # 200 kept of N with 30 % lost: N is 286 +- 11 (negative binomial).
    assert 200 + lost == pytest.approx(286, abs=55)


def test_encoder_counts_the_true_roll() -> None:
    world = TwinWorld(RIG, seed=8)
    clock = ManualClock(NS)
    assert RIG.roll is not None
    with TwinEncoder(RIG, clock=clock, options={"world": world}) as encoder:
        readings = [encoder.read(0.1) for _ in range(400)]
    per_count = 2.0 * np.pi / (RIG.roll.counts_per_turn * RIG.roll.gear_ratio)
    for seq, reading in enumerate(readings):
        assert reading is not None
        assert reading.seq == seq
        truth = world.truth(reading.t_ns).roll_rad
        assert RIG.roll.angle_rad(reading.count) == pytest.approx(truth, abs=0.5001 * per_count)
    assert readings[1].t_ns - readings[0].t_ns == NS // 200  # type: ignore[union-attr]


def test_encoder_with_play_lags_by_half_of_it_on_either_side() -> None:
    world = TwinWorld(RIG, seed=8, settings=TwinSettings(manoeuvre="roll", encoder_backlash_deg=2.0))
    clock = ManualClock(0)
    assert RIG.roll is not None
    lags = []
    with TwinEncoder(RIG, clock=clock, options={"world": world, "rate_hz": 50.0}) as encoder:
        for _ in range(1500):
            reading = encoder.read(0.1)
            assert reading is not None
            lags.append(RIG.roll.angle_rad(reading.count) - world.truth(reading.t_ns).roll_rad)
    # One count is 0.075 deg; half of it may be added by rounding.
    assert np.rad2deg(max(lags)) == pytest.approx(1.0, abs=0.05)
    assert np.rad2deg(min(lags)) == pytest.approx(-1.0, abs=0.05)


def test_direction_and_zero_of_the_rig_are_obeyed() -> None:
    assert RIG.roll is not None
    roll = dataclasses.replace(RIG.roll, direction=-1, zero_count=1234.0)
    rig = dataclasses.replace(RIG, roll=roll)
    with TwinEncoder(rig, clock=ManualClock(0), options={"seed": 1}) as encoder:
        reading = encoder.read(0.1)
        assert reading is not None
        truth = encoder.world.truth(reading.t_ns).roll_rad
    assert roll.angle_rad(reading.count) == pytest.approx(truth, abs=2e-3)


def test_closed_devices_and_wrong_options_are_refused_in_words() -> None:
    clock = ManualClock(0)
    with pytest.raises(DeviceError, match="before it is opened"):
        TwinCamera(RIG, "top", clock=clock, options={}).read(0.1)
    with pytest.raises(ConfigError, match="no option speed"):
        TwinCamera(RIG, "top", clock=clock, options={"speed": 2})
    with pytest.raises(ConfigError, match="no setting fog"):
        TwinCamera(RIG, "top", clock=clock, options={"settings": {"fog": 2}})
    with pytest.raises(ConfigError, match="no camera 'side'"):
        TwinCamera(RIG, "side", clock=clock, options={})
    with pytest.raises(ConfigError, match="manoeuvre: expected one of"):
        TwinCamera(RIG, "top", clock=clock, options={"settings": {"manoeuvre": "dance"}})
    with pytest.raises(ConfigError, match=r"no \[roll\]"):
        TwinEncoder(dataclasses.replace(RIG, roll=None), clock=clock, options={})
    with pytest.raises(ConfigError, match="rate_hz must be a positive number"):
        TwinEncoder(RIG, clock=clock, options={"rate_hz": 0})


def test_world_without_a_catheter_has_a_lost_truth() -> None:
    truth = TwinWorld(RIG, settings=TwinSettings(catheter=False)).truth(NS)
    assert truth.status.value == "lost"
    assert truth.shape_box is None


def test_steering_reaches_its_setpoint_and_a_reader_in_another_thread_never_fails() -> None:
    world, stop, failures = TwinWorld(RIG, seed=1), threading.Event(), []

    def look() -> None:
        k = 0
        while not stop.is_set():
            k += 1
            try:
                world.truth((k % 1000) * NS // 100)
            except Exception as error:
                failures.append(error)
                return

    reader = threading.Thread(target=look)
    reader.start()
    for k in range(300):
        world.steer(k * NS // 60, insertion_mm=40.0 + 0.1 * k, roll_deg=float(k))
    stop.set()
    reader.join(timeout=10.0)
    assert not failures
    settled = world.controls(20 * NS)
    assert settled.insertion_mm == pytest.approx(69.9, abs=0.01)
    assert settled.roll_deg == pytest.approx(299.0, abs=0.01)


@pytest.mark.parametrize("seed", range(20))
def test_true_cameras_stand_near_the_drawing_and_see_the_whole_region(seed: int) -> None:
    moved = true_rig(RIG, seed)
    for name, nominal in RIG.cameras.items():
        here, there = moved.cameras[name].camera_from_box, nominal.camera_from_box
        shift = here.inverse().translation_mm - there.inverse().translation_mm
        assert 0.0 < np.abs(shift).max() <= SHIFT_MM
        assert 0.0 < np.rad2deg(angle_between(here, there)) <= np.linalg.norm(TURN_DEG)
        model = CameraModel.of(moved.cameras[name])
        assert model.inside(model.project(RIG.roi.corners_mm)).all()
    again = true_rig(RIG, seed)
    assert np.array_equal(
        again.cameras["top"].camera_from_box.rotation_wxyz, moved.cameras["top"].camera_from_box.rotation_wxyz
    )
    assert moved.cameras["top"].intrinsics is RIG.cameras["top"].intrinsics


def test_clocks() -> None:
    manual = ManualClock(5)
    manual.wait_until_ns(3)
    assert manual.now_ns() == 5
    manual.wait_until_ns(9)
    manual.advance_ns(1)
    assert manual.now_ns() == 10
    with pytest.raises(ValueError, match="duration_ns"):
        manual.advance_ns(-1)
    real = MonotonicClock()
    target = real.now_ns() + 2_000_000
    real.wait_until_ns(target)
    assert real.now_ns() >= target
