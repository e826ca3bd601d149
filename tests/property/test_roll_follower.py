"""What holds of the play model for every path of the encoder: bounds, continuity, equivariance, and truth."""

from itertools import pairwise
from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cathxr.core import Roll
from cathxr.geometry.roll import RollFollower

paths = st.lists(st.integers(-40, 40), min_size=1, max_size=60).map(lambda steps: np.cumsum(steps).tolist())
rolls = st.builds(
    Roll,
    st.floats(200, 20000),
    st.floats(0.3, 6.0),
    direction=st.sampled_from([1, -1]),
    zero_count=st.floats(-1e6, 1e6),
    backlash_deg=st.floats(0.01, 3.0),
)
ROUNDING = 1e-7  # rad: counts to 1e6 from zero have 1e-16 relative rounding, of up to 1e5 rad; margin of 1e4


def changed(roll: Roll, **changes: float | None) -> Roll:
    """Return the roll with other values."""
    fields = {name: getattr(roll, name) for name in ("counts_per_turn", "gear_ratio", "direction", "zero_count")}
    return Roll(**(fields | {"backlash_deg": roll.backlash_deg} | changes))


def followed(roll: Roll, counts: list[float]) -> list[float]:
    """Return the roll along a path of counts."""
    follower = RollFollower(roll)
    return [follower.angle_rad(each) for each in counts]


@given(rolls, paths, st.sampled_from([None, 0.0]))
def test_without_play_it_is_the_plain_angle_to_the_last_bit(roll: Roll, path: list[int], none: float | None) -> None:
    plain = changed(roll, backlash_deg=none)
    assert followed(plain, path) == [plain.angle_rad(each) for each in path]


@given(rolls, paths)
def test_it_is_within_half_the_play_of_the_middle(roll: Roll, path: list[int]) -> None:
    assert roll.backlash_deg is not None
    half = radians(roll.backlash_deg) / 2
    for count, angle in zip(path, followed(roll, path), strict=True):
        assert abs(angle - roll.angle_rad(count)) <= half + ROUNDING


@given(rolls, paths)
def test_its_slope_is_between_one_and_three(roll: Roll, path: list[int]) -> None:
    angles = followed(roll, path)
    for (before, after), (first, second) in zip(pairwise(path), pairwise(angles), strict=True):
        step = roll.angle_rad(after) - roll.angle_rad(before)
        assert abs(second - first) <= 3 * abs(step) + ROUNDING
        assert (second - first) * step >= abs(step) * (abs(step) - ROUNDING)


@given(rolls, paths, st.integers(-(10**6), 10**6))
def test_it_moves_with_the_zero(roll: Roll, path: list[int], shift: int) -> None:
    moved = changed(roll, zero_count=roll.zero_count + shift)
    np.testing.assert_allclose(followed(moved, [each + shift for each in path]), followed(roll, path), atol=ROUNDING)


@given(rolls, paths)
def test_it_reverses_with_the_direction(roll: Roll, path: list[int]) -> None:
    reversed_roll = changed(roll, direction=-roll.direction)
    np.testing.assert_allclose(followed(reversed_roll, path), [-each for each in followed(roll, path)], atol=ROUNDING)


@given(rolls, paths, st.integers(1, 9))
def test_what_lies_between_two_counts_of_one_direction_does_not_matter(roll: Roll, path: list[int], parts: int) -> None:
    fine = [path[0], *(float(x) for a, b in pairwise(path) for x in np.linspace(a, b, parts + 1)[1:])]
    np.testing.assert_allclose(followed(roll, fine)[::parts], followed(roll, path), atol=ROUNDING)


@given(
    st.floats(0.05, 1.5),
    st.sampled_from([1, -1]),
    st.lists(st.floats(-800.0, 800.0), min_size=1, max_size=12),
    st.floats(-0.5, 0.5),
)
def test_the_truth_is_recovered_through_gears_with_play(
    play_deg: float, direction: int, turns_deg: list[float], start: float
) -> None:
    """A catheter turns to and fro, over many turns; gears pass it on once their play is used up; the board counts."""
    roll = Roll(2400, 2.0, direction=direction, zero_count=-33.0, backlash_deg=play_deg)
    follower = RollFollower(roll)
    per_degree = 2400 * 2.0 / 360.0
    truth_deg, driven_deg = 0.0, start * play_deg  # of the encoder, at the catheter, anywhere in the play
    for turn_deg in turns_deg:
        begun_deg = truth_deg
        steps = 1 + int(abs(turn_deg) / 0.05)
        for truth_deg in np.linspace(begun_deg, begun_deg + turn_deg, steps + 1)[1:]:
            driven_deg = float(np.clip(driven_deg, truth_deg - play_deg / 2, truth_deg + play_deg / 2))
            count = round(roll.zero_count + direction * driven_deg * per_degree)
            off_deg = abs(np.degrees(follower.angle_rad(count)) - truth_deg)
            assert radians(off_deg) <= follower.uncertainty_rad + ROUNDING
            # Past the play, hysteresis (2 counts) and glide (b/2), nothing is left but the count: half of one, and as
            # much again for the extreme that the hysteresis saw, which weighs b/g = 2 while the glide ends.
            if abs(truth_deg - begun_deg) > 1.5 * play_deg + 3.5 / per_degree:
                assert off_deg <= 0.5 / per_degree + 1e-9


@given(rolls, paths)
def test_its_uncertainty_is_from_half_the_play_to_all_of_it(roll: Roll, path: list[int]) -> None:
    assert roll.backlash_deg is not None
    play = radians(roll.backlash_deg)
    half_count = abs(roll.angle_rad(roll.zero_count + 0.5))
    follower = RollFollower(roll)
    for count in path:
        follower.angle_rad(count)
        got = follower.uncertainty_rad - half_count
        assert play / 2 - ROUNDING <= got <= play + ROUNDING
    follower.reset()
    assert follower.uncertainty_rad - half_count == pytest.approx(play / 2, abs=ROUNDING)
