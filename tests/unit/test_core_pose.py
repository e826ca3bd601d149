"""Pose: construction, refusals, and the matrix round trip through every branch of Shepperd's method."""

import numpy as np
import pytest

from cathxr.core import Pose

UNIT = np.array([1.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("length", [0.0, 0.5, 0.9989, 1.0011, 2.0])
def test_a_quaternion_that_is_not_of_unit_length_is_refused(length: float) -> None:
    with pytest.raises(ValueError, match="rotation_wxyz: expected a quaternion of length 1, got length"):
        Pose(length * UNIT, np.zeros(3))


@pytest.mark.parametrize("length", [0.9991, 1.0009])
def test_a_quaternion_of_about_unit_length_is_normalised(length: float) -> None:
    quaternion = np.array([0.5, -0.5, 0.5, 0.5])
    np.testing.assert_allclose(Pose(length * quaternion, np.zeros(3)).rotation_wxyz, quaternion, rtol=1e-15)


def test_a_unit_quaternion_is_kept_to_the_last_bit() -> None:
    given = np.array([0.1, -0.7, 0.3, 0.2])
    once = Pose(given / np.linalg.norm(given), np.zeros(3)).rotation_wxyz
    np.testing.assert_array_equal(Pose(once, np.zeros(3)).rotation_wxyz, once)


@pytest.mark.parametrize(
    ("rotation", "translation", "message"),
    [
        (np.ones(3), np.zeros(3), "rotation_wxyz: expected shape"),
        (np.eye(4), np.zeros(3), "rotation_wxyz: expected shape"),
        (np.array([np.nan, 0, 0, 0]), np.zeros(3), "rotation_wxyz: expected finite"),
        (UNIT, np.zeros(2), "translation_mm: expected shape"),
        (UNIT, np.array([0.0, np.inf, 0.0]), "translation_mm: expected finite"),
    ],
)
def test_what_is_no_pose_is_refused(rotation: np.ndarray, translation: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Pose(rotation, translation)


def test_a_poses_arrays_are_read_only_copies() -> None:
    rotation, translation = UNIT.copy(), np.zeros(3)
    pose = Pose(rotation, translation)
    rotation[:] = translation[:] = 9.0
    np.testing.assert_array_equal(pose.rotation_wxyz, UNIT)
    np.testing.assert_array_equal(pose.translation_mm, np.zeros(3))
    for array in (pose.rotation_wxyz, pose.translation_mm):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1.0, 1.0, -1.0]),  # a mirror
        2.0 * np.eye(3),
        np.eye(3) + 0.01 * np.ones((3, 3)),
        np.zeros((3, 3)),
    ],
)
def test_what_is_no_rotation_matrix_is_refused(matrix: np.ndarray) -> None:
    with pytest.raises(ValueError, match="rotation: expected a right-handed rotation matrix"):
        Pose.from_matrix(matrix, np.zeros(3))


@pytest.mark.parametrize("shape", [(4, 4), (3,), (2, 2)])
def test_a_rotation_matrix_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="rotation: expected shape"):
        Pose.from_matrix(np.zeros(shape), np.zeros(3))


# One quaternion for each branch: the component named is the largest by far, so that the others are divided by it.
@pytest.mark.parametrize("largest", [0, 1, 2, 3])
@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)])
def test_the_matrix_round_trip_takes_every_branch(largest: int, signs: tuple[int, int, int]) -> None:
    quaternion = np.full(4, 0.2)
    quaternion[[each for each in range(4) if each != largest]] *= signs
    quaternion[largest] = np.sqrt(1.0 - 3 * 0.04)
    pose = Pose(quaternion, np.array([1.0, 2.0, 3.0]))
    trace = np.trace(pose.rotation)
    branch = int(np.argmax([trace, *np.diag(pose.rotation)]))
    assert branch == largest
    again = Pose.from_matrix(pose.rotation, pose.translation_mm)
    sign = 1.0 if quaternion[0] > 0 else -1.0
    np.testing.assert_allclose(again.rotation_wxyz, sign * quaternion, atol=1e-15)  # a few roundings of 1
    np.testing.assert_array_equal(again.translation_mm, pose.translation_mm)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_come_back(axis: int) -> None:
    matrix = -np.eye(3)
    matrix[axis, axis] = 1.0
    np.testing.assert_array_equal(Pose.from_matrix(matrix, np.zeros(3)).rotation, matrix)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_quarter_turn_is_right_handed(axis: int) -> None:
    quaternion = np.zeros(4)
    quaternion[0] = quaternion[1 + axis] = np.sqrt(0.5)
    pose = Pose(quaternion, np.zeros(3))
    following, last = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
    np.testing.assert_allclose(pose.turn(following), last, atol=1e-15)


def test_the_homogeneous_matrix_maps_like_apply() -> None:
    pose = Pose(np.array([0.5, 0.5, -0.5, 0.5]), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(pose.matrix[3], [0.0, 0.0, 0.0, 1.0])
    point = np.array([4.0, 5.0, 6.0])
    np.testing.assert_allclose((pose.matrix @ [*point, 1.0])[:3], pose.apply(point), rtol=1e-15)
    np.testing.assert_allclose(pose.turn(point), pose.apply(point) - pose.translation_mm, rtol=1e-15)


def test_identity_changes_nothing() -> None:
    points = np.arange(12.0).reshape(2, 2, 3)
    np.testing.assert_array_equal(Pose.identity().apply(points), points)
