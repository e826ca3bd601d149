"""Devices of the twin whose stamps are wrong, and the manoeuvre from which a calibration finds out by how much."""

import dataclasses

import numpy as np
import pytest

from cathxr.core import ConfigError, FloatArray, Timing
from cathxr.devices.clock import ManualClock
from cathxr.storage.rig_file import example_rig
from cathxr.twin import TwinWorld, scene
from cathxr.twin.drivers import TwinCamera, TwinEncoder

RIG = example_rig()
NS = 1_000_000_000
MEASURED = Timing(top_latency_s=0.021, front_latency_s=0.034, encoder_latency_s=0.004, front_offset_s=0.003)
TIMED = dataclasses.replace(RIG, timing=MEASURED)


def stamp(rig: object, camera: str, **options: object) -> int:
    world = TwinWorld(RIG, seed=1, settings=dataclasses.replace(scene("black_picture")))
    with TwinCamera(rig, camera, clock=ManualClock(NS), options={"world": world, **options}) as device:  # type: ignore[arg-type]
        image = device.read(1.0)
    assert image is not None
    return image.t_ns


@pytest.mark.parametrize("camera", ["top", "front"])
def test_stamps_are_wrong_until_the_rig_says_by_how_much(camera: str) -> None:
    late_s = 0.021 if camera == "top" else 0.034 + 0.003
    right = stamp(RIG, camera)
    assert stamp(TIMED, camera) == right, "a twin whose devices are as late as its rig says is right"
    assert stamp(RIG, camera, stamp_error_s=0.05) - right == 50_000_000
    assert stamp(TIMED, camera, stamp_error_s=late_s) == right
    assert stamp(TIMED, camera, stamp_error_s=0.0) - right == -round(late_s * NS)


def test_the_encoders_too() -> None:
    def first(rig: object, **options: object) -> tuple[int, int]:
        world = TwinWorld(RIG, seed=1, settings=scene("timing"))
        with TwinEncoder(rig, clock=ManualClock(NS), options={"world": world, **options}) as device:  # type: ignore[arg-type]
            reading = device.read(1.0)
        assert reading is not None
        return reading.t_ns, reading.count

    right = first(RIG)
    assert first(TIMED) == right
    assert first(TIMED, stamp_error_s=0.004) == right
    assert first(RIG, stamp_error_s=-0.012) == (right[0] - 12_000_000, right[1])


def test_a_stamp_error_that_is_no_number_is_refused() -> None:
    for wrong in ("late", float("nan"), 100.0):
        with pytest.raises(ConfigError, match="stamp_error_s"):
            stamp(RIG, "top", stamp_error_s=wrong)


def correlation(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return how alike two signals are (301,), for shifts from -150 to 150 samples."""
    middle = one[200:-200]
    return np.array([abs(np.corrcoef(middle, other[200 + s : len(other) - 200 + s])[0, 1]) for s in range(-150, 151)])


@pytest.mark.parametrize("seed", range(6))
def test_the_timing_manoeuvre_has_one_delay_that_fits(seed: int) -> None:
    world = TwinWorld(RIG, seed=seed, settings=scene("timing"))
    states = [world.state(k * NS // 100) for k in range(1400)]
    tip = np.stack([each.shape_box[0] for each in states])
    roll = np.array([each.roll_rad for each in states])
    assert (tip > RIG.roi.min_mm).all()
    assert (tip < RIG.roi.max_mm).all()
    # Along x, which both views have, by some centimetres; and across, with the roll.
    assert np.ptp(tip, axis=0).min() > 12.0
    for one, other in ((tip[:, 0], tip[:, 0]), (tip[:, 1], roll), (tip[:, 2], roll)):
        found = correlation(one, other)
        # The other views of the tip follow the roll by a sine, not quite in proportion: within 30 ms.
        assert abs(int(np.argmax(found)) - 150) <= 3
        assert found[150] > 0.9
        away = np.concatenate([found[:120], found[181:]])
        assert away.max() < 0.85 * found.max()
