"""The play of the gears taken out of counts, and torsion between gearbox and tip."""

from math import radians

import numpy as np
import pytest

from cathxr.core import FloatArray, Pose, Roll
from cathxr.geometry import tip_pose
from cathxr.geometry.roll import RollFollower, tip_roll_rad, torsion_rad, total_bend_rad

DEGREE = radians(1.0)
ROLL = Roll(2400, 2.0, backlash_deg=0.33)  # 48:24 teeth: 0.075 degrees a count, a play of 4.4 counts
COUNT = 0.075 * DEGREE
PLAY = 0.33 * DEGREE
EXACT = 1e-9  # rad: rounding


def arc(degrees: float, *, radius_mm: float = 40.0, points: int = 50) -> FloatArray:
    """Return points (points, 3) mm of an arc, tip first, that leaves the inlet along +x."""
    angle = np.linspace(radians(degrees), 0.0, points)
    return radius_mm * np.stack([np.sin(angle), np.zeros(points), 1.0 - np.cos(angle)], axis=1)


def middle(count: float) -> float:
    """Return the roll in the middle of the play."""
    return ROLL.angle_rad(count)


def test_while_it_turns_the_estimate_is_half_a_play_ahead_in_either_direction() -> None:
    follower = RollFollower(ROLL)
    up = [follower.angle_rad(count) - middle(count) for count in range(100)]
    down = [follower.angle_rad(count) - middle(count) for count in range(100, -100, -1)]
    assert up[-1] == pytest.approx(PLAY / 2, abs=EXACT)
    assert down[-1] == pytest.approx(-PLAY / 2, abs=EXACT)


def test_nothing_is_known_at_first_and_the_middle_is_the_answer() -> None:
    follower = RollFollower(ROLL)
    assert follower.angle_rad(17) == middle(17)
    assert follower.uncertainty_rad == pytest.approx(PLAY / 2 + COUNT / 2, abs=EXACT)


def test_jitter_of_a_count_each_way_at_rest_changes_the_estimate_by_no_more_than_the_jitter() -> None:
    follower = RollFollower(ROLL)
    for count in range(50):
        follower.angle_rad(count)
    for step in (1, -1, 0, -1, 1, 0, 1, 1, -1, -1, 0, -1) * 20:
        assert follower.angle_rad(49 + step) == pytest.approx(middle(49 + step) + PLAY / 2, abs=EXACT)


def test_jitter_around_a_place_short_of_where_the_turn_ended_is_ignored_too() -> None:
    follower = RollFollower(ROLL)
    for count in (*range(50), 48, *[48, 47] * 20):
        assert follower.angle_rad(count) - middle(count) <= PLAY / 2 + EXACT
    assert follower.angle_rad(47) == pytest.approx(middle(47) + PLAY / 2, abs=EXACT)


def test_a_turn_back_glides_over_within_the_hysteresis_and_half_the_play() -> None:
    follower = RollFollower(ROLL)
    for count in range(50):
        follower.angle_rad(count)
    offsets = [follower.angle_rad(49 - back) - middle(49 - back) for back in np.linspace(0.0, 6.0, 241)]
    assert np.all(np.diff(offsets) <= EXACT)
    assert offsets[80] == pytest.approx(PLAY / 2, abs=EXACT)  # two counts back: still on the old side
    done = 2.0 + 0.5 * 4.4
    assert offsets[int(np.ceil(done * 40))] == pytest.approx(-PLAY / 2, abs=EXACT)
    # Of a real-valued count the estimate is continuous: its slope is 1 + play / glide = 3.
    assert np.abs(np.diff(offsets)).max() <= 2.0 * 0.025 * COUNT + EXACT


def test_uncertainty_is_least_in_the_middle_and_the_whole_play_at_a_side() -> None:
    follower = RollFollower(ROLL)
    for count in range(50):
        follower.angle_rad(count)
    assert follower.uncertainty_rad == pytest.approx(PLAY + COUNT / 2, abs=EXACT)
    follower.reset()
    follower.angle_rad(7)
    assert follower.uncertainty_rad == pytest.approx(PLAY / 2 + COUNT / 2, abs=EXACT)


def test_reset_forgets_the_direction() -> None:
    follower = RollFollower(ROLL)
    for count in range(50):
        follower.angle_rad(count)
    follower.reset()
    assert follower.angle_rad(-3) == middle(-3)


def test_torsion_is_linear_in_length_and_bend() -> None:
    roll = Roll(2400, torsion_deg_per_mm=0.02, torsion_deg_per_quarter_bend=-1.5)
    assert torsion_rad(roll, length_mm=100.0, bend_rad=np.pi) == pytest.approx(radians(2.0 - 3.0), abs=1e-15)
    assert torsion_rad(Roll(2400), length_mm=100.0, bend_rad=np.pi) == 0.0


@pytest.mark.parametrize("degrees", [0.0, 10.0, 90.0, 200.0])
@pytest.mark.parametrize("points", [50, 240])
def test_the_bend_of_an_arc_is_its_angle(degrees: float, points: int) -> None:
    shape = arc(degrees, points=points) if degrees else np.linspace([80.0, 0, 0], [0.0, 0, 0], points)
    # Resampling runs along chords, which ends them at most half a given step (200 degrees: 1.4 mm of 40 mm radius) off.
    tolerance = 0.5 * radians(max(degrees, 1e-6)) / (points - 1)
    assert total_bend_rad(shape) == pytest.approx(radians(degrees), abs=tolerance)


def test_the_noise_of_the_points_hardly_adds_to_the_bend() -> None:
    # Points that are independently off by 0.02 mm: a tangent over 10 mm is off by 0.02 * sqrt(2) / 10 = 0.003 rad in
    # each of two directions, the change from one to the next by sqrt(pi) * 0.003 on average, 16 times: 0.08 rad. It is
    # a mean of 16 with a spread of half a mean each: 0.02 rad up or down, twice that here; at least half must show.
    noise = np.random.default_rng(4).normal(0.0, 0.02, (81, 3))
    straight = np.linspace([80.0, 0, 0], [0.0, 0, 0], 81)
    assert 0.04 < total_bend_rad(straight + noise) < 0.12
    # Of a bent curve noise adds along the bend, where it cancels, and in quadrature across: far less.
    assert total_bend_rad(arc(115.0, points=81) + noise) == pytest.approx(radians(115.0), abs=0.03)


def test_the_bend_does_not_depend_on_which_end_comes_first() -> None:
    shape = arc(120.0)
    assert total_bend_rad(shape[::-1]) == pytest.approx(total_bend_rad(shape), abs=EXACT)


@pytest.mark.parametrize("roll_rad", [None, 0.0, 2.5])
def test_the_tip_turns_by_roll_and_torsion(roll_rad: float | None) -> None:
    shape = arc(90.0, points=200)
    length_mm = 40.0 * np.pi / 2
    twisted = Roll(2400, torsion_deg_per_mm=0.1, torsion_deg_per_quarter_bend=3.0)
    turn = tip_roll_rad(twisted, shape_box=shape, roll_rad=roll_rad)
    assert turn == pytest.approx((roll_rad or 0.0) + radians(0.1 * length_mm + 3.0), abs=radians(0.02))
    for roll in (None, Roll(2400), Roll(2400, torsion_deg_per_mm=0.0)):
        assert tip_roll_rad(roll, shape_box=shape, roll_rad=roll_rad) == (roll_rad or 0.0)


def test_torsion_turns_the_tip_about_its_tangent_only() -> None:
    shape = arc(90.0)
    before, after = (tip_pose(shape, zero_direction=ROLL.zero_direction, roll_rad=each) for each in (0.2, 0.5))
    between = before.inverse() @ after
    expected = Pose(np.array([np.cos(0.15), 0.0, 0.0, np.sin(0.15)]), np.zeros(3))
    np.testing.assert_allclose(between.rotation, expected.rotation, atol=1e-12)  # rounding
