"""Any polyline: what resampling and transport keep."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cathxr.core import Pose
from cathxr.geometry import arc_length, resampled, tangents, tip_pose, transported
from cathxr.geometry.pose import pose_from_vector


@st.composite
def polylines(draw: st.DrawFn) -> np.ndarray:
    """Return polylines (N, 3), mm, whose steps are at least 0.1 mm and turn by less than 2 rad."""
    count = draw(st.integers(2, 25))
    turns = st.floats(-1.0, 1.0)
    direction = pose_from_vector(np.array([draw(turns), draw(turns), draw(turns), 0.0, 0.0, 0.0]))
    points = [np.array([draw(st.floats(-50.0, 50.0)) for _ in range(3)])]
    for _ in range(count - 1):
        bend = np.array([draw(turns), draw(turns), 0.0, 0.0, 0.0, 0.0])
        direction = direction @ pose_from_vector(bend)
        points.append(points[-1] + draw(st.floats(0.1, 5.0)) * direction.rotation[:, 2])
    return np.array(points)


def walked(points: np.ndarray, distance: float) -> np.ndarray:
    """Return the point (3,) that lies `distance` along the polyline, by walking it step by step."""
    for here, there in pairwise(points):
        step = float(np.linalg.norm(there - here))
        if distance <= step:
            return np.asarray(here + (distance / step) * (there - here))
        distance -= step
    return np.asarray(points[-1])


@given(polylines(), st.integers(2, 60))
def test_resampling_walks_the_polyline_at_an_even_pace(points: np.ndarray, count: int) -> None:
    result = resampled(points, count)
    length = float(arc_length(points)[-1])
    expected = np.array([walked(points, length * i / (count - 1)) for i in range(count)])
    np.testing.assert_allclose(result, expected, atol=1e-10)
    np.testing.assert_array_equal(result[[0, -1]], points[[0, -1]])
    assert arc_length(result)[-1] <= length * (1.0 + 1e-12)


@given(polylines(), st.integers(2, 60))
def test_resampling_backwards_is_the_same_backwards(points: np.ndarray, count: int) -> None:
    np.testing.assert_allclose(resampled(points[::-1], count)[::-1], resampled(points, count), atol=1e-10)


@given(polylines())
def test_tangents_are_unit_and_turn_round_with_the_curve(points: np.ndarray) -> None:
    along = tangents(points)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(tangents(points[::-1])[::-1], -along, atol=1e-9)


@given(polylines(), st.floats(-3.0, 3.0))
def test_transport_keeps_unit_normals_and_the_angle_between_two(points: np.ndarray, angle: float) -> None:
    along = tangents(points)
    first = np.cross(along[0], np.roll(along[0], 1) + np.array([0.3, -0.7, 0.2]))
    if np.linalg.norm(first) < 1e-3:
        return
    one = transported(points, along, first)
    np.testing.assert_allclose(np.linalg.norm(one, axis=1), 1.0, atol=1e-10)
    np.testing.assert_allclose((one * along).sum(axis=1), 0.0, atol=1e-10)
    other = transported(points, along, np.cos(angle) * one[0] + np.sin(angle) * np.cross(along[0], one[0]))
    expected = np.cos(angle) * one + np.sin(angle) * np.cross(along, one)
    np.testing.assert_allclose(other, expected, atol=1e-9)


@given(polylines(), st.floats(-10.0, 10.0), st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6))
def test_the_tip_pose_moves_with_the_curve(points: np.ndarray, roll: float, motion: list[float]) -> None:
    zero = np.array([0.0, -1.0, 0.0])
    insertion = tangents(points[::-1])[0]
    if np.linalg.norm(np.cross(insertion, zero)) < 1e-2:
        return
    moved_from_box: Pose = pose_from_vector(np.array(motion))
    still = tip_pose(points, zero_direction=zero, roll_rad=roll)
    moved = tip_pose(moved_from_box.apply(points), zero_direction=moved_from_box.turn(zero), roll_rad=roll)
    expected = moved_from_box @ still
    np.testing.assert_allclose(moved.rotation, expected.rotation, atol=1e-8)
    np.testing.assert_allclose(moved.translation_mm, expected.translation_mm, atol=1e-10)
