"""The twin's tip in a phantom's holes: reached to hundredths of a millimetre, at rest when it is said to be."""

import numpy as np
import pytest

from cathxr.core import ConfigError
from cathxr.core.phantom import Hole, Phantom
from cathxr.storage.rig_file import example_rig
from cathxr.twin import TwinWorld
from cathxr.twin.phantom import Stops, reaching, visit

RIG = example_rig()
NS = 1_000_000_000
PLACES = [(40.0, 0.0, 0.0), (55.0, 25.0, 10.0), (70.0, -30.0, -15.0), (90.0, 10.0, 35.0), (110.0, -5.0, -20.0)]
PHANTOM = Phantom("steps", tuple(Hole(f"H{i}", np.array(each)) for i, each in enumerate(PLACES)), 0.05)


def test_the_tip_rests_in_every_hole_in_order() -> None:
    result = visit(RIG, PHANTOM, seed=3, start_ns=5 * NS, travel_s=1.0, dwell_s=2.0, rounds=2)
    assert [each.hole for each in result.rests] == [0, 1, 2, 3, 4] * 2
    assert result.rests[0].begin_ns == 6 * NS
    assert result.end_ns == 5 * NS + 10 * 3 * NS
    for rest in result.rests:
        for t_ns in np.linspace(rest.begin_ns, rest.end_ns, 5).astype(int):
            tip = result.world.truth(int(t_ns)).tip_box
            assert tip is not None
            assert np.linalg.norm(tip - PLACES[rest.hole]) < 0.01  # what is promised
    moving = result.world.truth(result.rests[1].end_ns + NS // 2).tip_box
    assert moving is not None
    assert np.linalg.norm(moving - PLACES[1]) > 3.0


def test_a_hole_with_play_holds_the_tip_a_little_off_and_elsewhere_each_time() -> None:
    first = visit(RIG, PHANTOM, seed=3, seat_std_mm=0.2, rounds=8)
    off = first.seated_box - PHANTOM.positions_mm[[each.hole for each in first.rests]]
    # 120 numbers: their standard deviation is known to 6.5 %.
    assert off.std() == pytest.approx(0.2, rel=0.25)
    for rest, seated in zip(first.rests, first.seated_box, strict=True):
        tip = first.world.truth(rest.begin_ns).tip_box
        assert tip is not None
        assert np.linalg.norm(tip - seated) < 0.01
    assert np.array_equal(visit(RIG, PHANTOM, seed=3, seat_std_mm=0.2, rounds=8).seated_box, first.seated_box)
    assert not np.array_equal(visit(RIG, PHANTOM, seed=4, seat_std_mm=0.2, rounds=8).seated_box, first.seated_box)


@pytest.mark.parametrize("seed", range(4))
def test_holes_all_over_the_reach_are_reached(seed: int) -> None:
    rng = np.random.default_rng(seed)
    side, off = rng.uniform(0.0, 2.0 * np.pi, 12), rng.uniform(0.0, 34.0, 12)
    tips = np.column_stack([rng.uniform(35.0, 105.0, 12), off * np.cos(side), off * np.sin(side)])
    controls = reaching(TwinWorld(RIG, seed=seed).body, tips, names=[str(k) for k in range(12)])
    assert np.hypot(controls[:, 2], controls[:, 3]).max() < 180.0


def test_a_hole_out_of_reach_is_named() -> None:
    far = Phantom("far", (*PHANTOM.holes, Hole("corner", np.array([5.0, 58.0, 58.0]))), 0.05)
    with pytest.raises(ConfigError, match=r"hole corner at \(5\.0, 58\.0, 58\.0\) mm"):
        visit(RIG, far)
    with pytest.raises(ValueError, match="travel_s"):
        visit(RIG, PHANTOM, travel_s=0.0)


def test_travel_between_stops_is_smooth() -> None:
    motion = Stops(np.array([[20.0, 0.0, 0.0, 0.0], [60.0, 30.0, 90.0, -40.0], [80.0, -30.0, 20.0, 10.0]]), 1.2, 0.8)
    h = 1e-4
    for t_s in (0.1, 0.6, 1.19, 1.5, 2.3, 3.0, 9.0):
        before, here, after = motion.at(t_s - h), motion.at(t_s), motion.at(t_s + h)
        # Third derivatives of up to 60 / 1.2³ times 100 leave 3500 h²/6 = 6e-6.
        assert np.abs((after[:2] - before[:2]) / (2 * h) - here[1:]).max() < 1e-3
    for seam in (0.0, 1.2, 2.0, 3.2):
        assert np.abs(motion.at(seam)[1:]).max() < 1e-6
        assert np.abs(motion.at(seam - 1e-9)[0] - motion.at(seam + 1e-9)[0]).max() < 1e-6
    assert motion.rest_s(1) == pytest.approx((3.2, 4.0))
    assert np.array_equal(motion.at(-1.0)[0], [20.0, 0.0, 0.0, 0.0])
    assert np.array_equal(motion.at(99.0)[0], [80.0, -30.0, 20.0, 10.0])
