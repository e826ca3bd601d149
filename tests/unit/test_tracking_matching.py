"""Monotone matching on cases whose right answer is known by construction."""

from itertools import pairwise

import numpy as np
import pytest

from cathxr.tracking.matching import match, ray_distances

SIGMA = 0.25


def distances(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the distance (N, M) between points of two curves given by their place across the epipolar lines, mm."""
    return np.asarray(np.abs(first[:, None] - second[None, :]))


def assert_monotone(pairs: np.ndarray) -> None:
    """Assert that a matching begins with both firsts and goes on by one in one curve or both."""
    assert tuple(pairs[0]) == (0, 0)
    steps = np.diff(pairs, axis=0)
    assert {tuple(each) for each in steps.tolist()} <= {(1, 1), (1, 0), (0, 1)}


def test_the_distance_of_two_rays_is_that_of_two_lines() -> None:
    first = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    second = np.array([[0.0, 1.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    got = ray_distances(np.zeros(3), first, np.array([2.0, 3.0, 5.0]), second)
    assert got.shape == (2, 3)
    assert got[0, 0] == pytest.approx(5.0)  # x axis and a line along y, 5 above it
    assert got[0, 2] == pytest.approx(3.0)  # x axis and a line along z, 3 beside it
    assert got[1, 1] == pytest.approx(abs(2.0 * 0.8 - 3.0 * 0.6))
    np.testing.assert_allclose(got, ray_distances(np.array([2.0, 3.0, 5.0]), second, np.zeros(3), first).T, atol=1e-15)


def test_rays_through_one_point_meet() -> None:
    point, origins = np.array([80.0, 10.0, -5.0]), np.array([[60.0, 0.0, 330.0], [60.0, -330.0, 0.0]])
    rays = (point - origins) / np.linalg.norm(point - origins, axis=1, keepdims=True)
    assert ray_distances(origins[0], rays[:1], origins[1], rays[1:])[0, 0] < 1e-12


def test_identical_curves_match_one_to_one() -> None:
    across = np.linspace(0.0, 60.0, 41)
    result = match(distances(across, across), SIGMA)
    np.testing.assert_array_equal(result.pairs, np.repeat(np.arange(41)[:, None], 2, axis=1))
    assert result.rms == 0.0


@pytest.mark.parametrize("counts", [(60, 60), (60, 45), (45, 60), (100, 40)])
def test_another_sampling_is_matched_to_the_nearest_point(counts: tuple[int, int]) -> None:
    # The same curve, sampled unlike: evenly in one view and at a varying pace in the other.
    even = np.linspace(0.0, 1.0, counts[0])
    paced = np.linspace(0.0, 1.0, counts[1]) ** 1.3
    first, second = 60.0 * even, 60.0 * paced
    result = match(distances(first, second), SIGMA)
    assert_monotone(result.pairs)
    assert tuple(result.pairs[-1]) == (counts[0] - 1, counts[1] - 1)
    off = np.abs(first[result.pairs[:, 0]] - second[result.pairs[:, 1]])
    spacing = max(np.diff(first).max(), np.diff(second).max())
    assert off.max() <= spacing  # the capped cost of a side step never makes it worthwhile to lag by more
    assert set(result.pairs[:, 0]) == set(range(counts[0]))
    assert set(result.pairs[:, 1]) == set(range(counts[1]))


def test_sampling_shifted_by_a_part_of_a_step_stays_on_the_diagonal() -> None:
    across = np.arange(50.0)
    result = match(distances(across, across + 0.3), SIGMA)
    np.testing.assert_array_equal(result.pairs[:, 0], result.pairs[:, 1])
    assert result.rms == pytest.approx(0.3 / SIGMA)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("seen", [0.3, 0.6, 0.9])
def test_where_one_view_sees_less_the_other_is_left_over(swapped: bool, seen: float) -> None:
    whole = np.linspace(0.0, 60.0, 61)
    part = np.linspace(0.0, 60.0 * seen, 81)
    table = distances(whole, part)
    result = match(table.T if swapped else table, SIGMA)
    pairs = result.pairs[:, ::-1] if swapped else result.pairs
    assert_monotone(pairs)
    assert pairs[-1, 1] == 80  # the shorter one is used up
    assert abs(whole[pairs[-1, 0]] - part[-1]) <= 0.5  # and ends beside the nearest point of the longer one
    assert np.abs(whole[pairs[:, 0]] - part[pairs[:, 1]]).max() <= 1.0


def test_a_stretch_along_an_epipolar_line_is_bridged_between_what_is_known() -> None:
    # From 20 to 40 the curve runs along an epipolar line: any point there fits any other.
    across = np.concatenate([np.linspace(0.0, 20.0, 21), np.full(20, 20.0), np.linspace(21.0, 40.0, 20)])
    result = match(distances(across, across), SIGMA)
    np.testing.assert_array_equal(result.pairs[:, 0], result.pairs[:, 1])  # the even pace
    # Sampled twice as densely in one view: what lies around the stretch is matched rightly on both sides of it. Within
    # it every order of steps costs the same, so that nothing is asked of the pace there.
    dense = np.interp(np.linspace(0.0, 60.0, 121), np.arange(61.0), across)
    pairs = match(distances(across, dense), SIGMA).pairs
    assert_monotone(pairs)
    known = (pairs[:, 0] < 20) | (pairs[:, 0] > 41)
    assert np.abs(across[pairs[known, 0]] - dense[pairs[known, 1]]).max() <= 1.0
    assert np.abs(2.0 * pairs[known, 0] - pairs[known, 1]).max() <= 2.0


def test_the_second_pass_over_the_same_epipolar_lines_is_kept_apart() -> None:
    # The catheter turns back: every epipolar line but the last is met twice. Order tells the two passes apart.
    there_and_back = np.concatenate([np.linspace(0.0, 30.0, 31), np.linspace(29.0, 5.0, 25)])
    result = match(distances(there_and_back, there_and_back), SIGMA)
    np.testing.assert_array_equal(result.pairs[:, 0], result.pairs[:, 1])


def test_curves_that_have_nothing_in_common_have_a_large_rms() -> None:
    result = match(np.full((30, 20), 100.0), SIGMA)
    assert result.rms == pytest.approx(5.0)  # where the cost is cut off


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (4, 1), (4, 5), (5, 4)])
def test_no_other_monotone_matching_is_cheaper(shape: tuple[int, int]) -> None:
    table = np.random.default_rng(sum(shape)).uniform(0.0, 0.6, shape)
    squared = np.minimum(np.square(table / SIGMA), 25.0)

    def cost(way: list[tuple[int, int]]) -> float:
        total = squared[way[0]] + 4.0 * sum(way[0])  # points before the first pair have no partner
        for here, there in pairwise(way):
            both = there[0] > here[0] and there[1] > here[1]
            total += squared[there] if both else 0.5 * squared[there] + 0.02
        return float(total)

    def ways(here: tuple[int, int]) -> list[list[tuple[int, int]]]:
        begun = [[here]] if min(here) == 0 else []
        before = [(here[0] - 1, here[1] - 1), (here[0] - 1, here[1]), (here[0], here[1] - 1)]
        return begun + [[*way, here] for each in before if min(each) >= 0 for way in ways(each)]

    ends = {(shape[0] - 1, j) for j in range(shape[1])} | {(i, shape[1] - 1) for i in range(shape[0])}
    best = {end: min(cost(way) for way in ways(end)) for end in ends}
    # Each end is judged by its cost per point of the curve that it uses up.
    per_point = min(
        min(value / shape[0] for end, value in best.items() if end[0] == shape[0] - 1),
        min(value / shape[1] for end, value in best.items() if end[1] == shape[1] - 1),
    )
    got = [(int(i), int(j)) for i, j in match(table, SIGMA).pairs]
    assert cost(got) == pytest.approx(best[got[-1]], rel=1e-12)
    used_up = [shape[axis] for axis in range(2) if got[-1][axis] == shape[axis] - 1]
    assert min(cost(got) / each for each in used_up) == pytest.approx(per_point, rel=1e-12)


def test_what_only_one_view_sees_of_the_tip_has_no_partner() -> None:
    # The second curve begins 5 mm across the epipolar lines after the first: its tip is hidden there.
    across = np.linspace(0.0, 60.0, 61)
    result = match(distances(across, across[5:]), SIGMA)
    np.testing.assert_array_equal(result.pairs, np.stack([np.arange(5, 61), np.arange(56)], axis=1))
