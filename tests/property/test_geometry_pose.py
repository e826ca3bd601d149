"""Pose algebra for any pose: composition, inverse, exponential, perturbation, interpolation, frames."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cathxr.core import Pose
from cathxr.geometry.pose import (
    angle_between,
    frame_from_tangent,
    interpolated,
    perturbed,
    pose_from_vector,
    turned_about_z,
    vector_from_pose,
)

# Positions within a room of 1 m, in mm: one rounding is 1e-13 mm; a few hundred of them stay under this.
ROUNDING_MM = 1e-10
ROUNDING = 1e-13


def vectors(limit: float) -> st.SearchStrategy[np.ndarray]:
    """Return (3,) vectors with components up to `limit`."""
    return arrays(np.float64, 3, elements=st.floats(-limit, limit, width=64))


@st.composite
def directions(draw: st.DrawFn) -> np.ndarray:
    """Return unit vectors (3,)."""
    vector = draw(vectors(1.0).filter(lambda each: np.linalg.norm(each) > 1e-3))
    return np.asarray(vector / np.linalg.norm(vector))


@st.composite
def poses(draw: st.DrawFn) -> Pose:
    """Return any pose within a metre."""
    quaternion = draw(arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 1e-3))
    return Pose(quaternion / np.linalg.norm(quaternion), draw(vectors(1000.0)))


def assert_same(first: Pose, second: Pose) -> None:
    """Assert that two poses map points alike."""
    np.testing.assert_allclose(first.rotation, second.rotation, atol=ROUNDING)
    np.testing.assert_allclose(first.translation_mm, second.translation_mm, atol=ROUNDING_MM)


@given(poses())
def test_a_rotation_is_orthonormal_and_right_handed(pose: Pose) -> None:
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=ROUNDING)
    assert np.linalg.det(pose.rotation) > 0


@given(poses())
def test_the_inverse_undoes(pose: Pose) -> None:
    assert_same(pose @ pose.inverse(), Pose.identity())
    assert_same(pose.inverse() @ pose, Pose.identity())
    assert_same(pose.inverse().inverse(), pose)


@given(poses(), poses(), vectors(1000.0))
def test_composition_applies_the_right_one_first(first: Pose, second: Pose, point: np.ndarray) -> None:
    together = (first @ second).apply(point)
    np.testing.assert_allclose(together, first.apply(second.apply(point)), atol=ROUNDING_MM)
    np.testing.assert_allclose((first @ second).matrix, first.matrix @ second.matrix, atol=ROUNDING_MM)


@given(poses(), poses(), poses())
def test_composition_is_associative(first: Pose, second: Pose, third: Pose) -> None:
    assert_same((first @ second) @ third, first @ (second @ third))


@given(poses(), arrays(np.float64, (2, 4, 3), elements=st.floats(-1000, 1000)))
def test_apply_takes_any_number_of_points_and_keeps_distances(pose: Pose, points: np.ndarray) -> None:
    moved = pose.apply(points)
    assert moved.shape == points.shape
    np.testing.assert_allclose(moved[1, 2], pose.apply(points[1, 2]), atol=ROUNDING_MM)
    np.testing.assert_allclose(
        np.linalg.norm(moved[0] - moved[1], axis=-1), np.linalg.norm(points[0] - points[1], axis=-1), atol=ROUNDING_MM
    )
    np.testing.assert_allclose(pose.inverse().apply(moved), points, atol=ROUNDING_MM)


@given(poses())
def test_the_matrix_gives_the_pose_back(pose: Pose) -> None:
    again = Pose.from_matrix(pose.rotation, pose.translation_mm)
    assert_same(again, pose)
    assert again.rotation_wxyz[0] >= 0


@given(poses())
def test_the_vector_gives_the_pose_back(pose: Pose) -> None:
    vector = vector_from_pose(pose)
    assert np.linalg.norm(vector[:3]) <= np.pi + ROUNDING
    assert_same(pose_from_vector(vector), pose)


@given(directions(), st.floats(0.0, np.pi - 1e-6), vectors(1000.0))
def test_the_pose_gives_the_vector_back(axis: np.ndarray, angle: float, translation: np.ndarray) -> None:
    vector = np.concatenate([angle * axis, translation])
    np.testing.assert_allclose(vector_from_pose(pose_from_vector(vector)), vector, rtol=1e-14, atol=1e-14)


@given(poses(), vectors(1.0), vectors(10.0))
def test_a_perturbation_is_on_the_left_and_leaves_the_translation_unturned(
    pose: Pose, rotation: np.ndarray, translation: np.ndarray
) -> None:
    turned = perturbed(pose, np.concatenate([rotation, translation]))
    by = pose_from_vector(np.concatenate([rotation, np.zeros(3)])).rotation
    np.testing.assert_allclose(turned.rotation, by @ pose.rotation, atol=ROUNDING)
    np.testing.assert_allclose(turned.translation_mm, pose.translation_mm + translation, atol=ROUNDING_MM)


@given(poses(), poses(), st.floats(0.0, 1.0))
def test_interpolation_goes_the_stated_part_of_the_way(first: Pose, second: Pose, fraction: float) -> None:
    whole = angle_between(first, second)
    between = interpolated(first, second, fraction)
    # Half a turn has two short ways; either is right, and the pace is even on both.
    np.testing.assert_allclose(angle_between(first, between), fraction * whole, atol=1e-7)
    np.testing.assert_allclose(angle_between(between, second), (1 - fraction) * whole, atol=1e-7)
    assert_same(interpolated(first, second, 0.0), first)
    assert_same(interpolated(first, second, 1.0), second)


@given(directions(), directions(), st.floats(-10.0, 10.0))
def test_a_frame_is_a_rotation_with_its_axes_where_asked(
    tangent: np.ndarray, reference: np.ndarray, angle: float
) -> None:
    if np.linalg.norm(np.cross(tangent, reference)) < 1e-3:
        return  # nearly parallel: what is left of the reference is mostly rounding
    frame = frame_from_tangent(2.0 * tangent, reference)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-11)  # 1e-3 of the reference is left: 1e-16 / 1e-3
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, atol=1e-11)
    np.testing.assert_allclose(frame[:, 2], tangent, atol=ROUNDING)
    assert frame[:, 0] @ reference > 0
    np.testing.assert_allclose(frame[:, 1] @ reference, 0.0, atol=1e-11)
    turned = turned_about_z(frame, angle)
    np.testing.assert_allclose(turned[:, 2], tangent, atol=ROUNDING)
    np.testing.assert_allclose(turned[:, 0] @ frame[:, 0], np.cos(angle), atol=1e-11)
    np.testing.assert_allclose(turned[:, 0] @ frame[:, 1], np.sin(angle), atol=1e-11)
