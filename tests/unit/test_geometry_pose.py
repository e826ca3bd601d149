"""Poses beyond composition, on cases whose answer is known."""

import numpy as np
import pytest

from cathxr.core import Pose
from cathxr.geometry.pose import (
    angle_between,
    frame_from_tangent,
    interpolated,
    perturbed,
    pose_from_vector,
    rotation_vector_from_quaternion,
    turned_about_z,
    vector_from_pose,
)

QUARTER = np.pi / 2
X, Y, Z = np.eye(3)


@pytest.mark.parametrize(("axis", "before", "after"), [(X, Y, Z), (Y, Z, X), (Z, X, Y)])
def test_a_rotation_vector_turns_right_handed(axis: np.ndarray, before: np.ndarray, after: np.ndarray) -> None:
    pose = pose_from_vector(np.concatenate([QUARTER * axis, [1.0, 2.0, 3.0]]))
    np.testing.assert_allclose(pose.turn(before), after, atol=1e-15)
    np.testing.assert_array_equal(pose.translation_mm, [1.0, 2.0, 3.0])  # not rotated


# From where the sine underflows to where one more step would turn the other way round, through the switch at 1e-8.
@pytest.mark.parametrize(
    "angle", [0.0, 1e-300, 1e-12, 9.9e-9, 1.01e-8, 2.1e-8, 1e-5, 1.0, 3.0, np.pi - 1e-6, np.pi - 1e-12, np.pi]
)
def test_the_pose_vector_round_trip_holds_for_tiny_and_near_half_turns(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    vector = np.concatenate([angle * axis, [-4.0, 5.0, 6.0]])
    back = vector_from_pose(pose_from_vector(vector))
    # Relative to the angle: a tiny rotation must not be lost. 4e-16 per rounding, a handful of them; near pi the
    # quaternion's own rounding is an absolute error of the same size.
    np.testing.assert_allclose(back[:3], vector[:3], rtol=5e-15, atol=0.0)
    np.testing.assert_array_equal(back[3:], vector[3:])


def test_more_than_half_a_turn_comes_back_the_short_way() -> None:
    axis = np.array([0.0, 0.6, 0.8])
    back = vector_from_pose(pose_from_vector(np.concatenate([(np.pi + 0.5) * axis, np.zeros(3)])))
    np.testing.assert_allclose(back[:3], -(np.pi - 0.5) * axis, atol=1e-14)


def test_a_quaternion_and_its_negative_are_one_rotation() -> None:
    quaternion = np.array([0.8, 0.0, 0.6, 0.0])
    np.testing.assert_array_equal(
        rotation_vector_from_quaternion(quaternion), rotation_vector_from_quaternion(-quaternion)
    )


def test_perturbed_turns_and_shifts_in_the_frame_on_the_left() -> None:
    # R' = exp(rotation) R and t' = t + translation: the translation t itself is not turned.
    a_from_b = Pose(np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]), np.array([10.0, 0.0, 0.0]))
    turned = perturbed(a_from_b, np.concatenate([QUARTER * Z, [1.0, 2.0, 3.0]]))
    expected = pose_from_vector(np.concatenate([QUARTER * Z, np.zeros(3)])).rotation @ a_from_b.rotation
    np.testing.assert_allclose(turned.rotation, expected, atol=1e-15)
    np.testing.assert_array_equal(turned.translation_mm, [11.0, 2.0, 3.0])
    # b's y goes to a's z by the pose; a turn about a's z leaves it there (a turn about b's z would not).
    np.testing.assert_allclose(turned.turn(Y), Z, atol=1e-15)
    np.testing.assert_allclose(turned.turn(X), Y, atol=1e-15)


@pytest.mark.parametrize("fraction", [0.0, 0.25, 0.5, 1.0])
def test_interpolation_turns_at_an_even_pace_and_shifts_straight(fraction: float) -> None:
    first = pose_from_vector(np.array([0.0, 0.0, 0.2, 1.0, 2.0, 3.0]))
    second = pose_from_vector(np.array([0.0, 0.0, 1.4, 5.0, 2.0, -3.0]))
    between = vector_from_pose(interpolated(first, second, fraction))
    expected = [0.0, 0.0, 0.2 + 1.2 * fraction, 1.0 + 4.0 * fraction, 2.0, 3.0 - 6.0 * fraction]
    np.testing.assert_allclose(between, expected, atol=1e-14)


def test_interpolation_takes_the_short_way_whatever_the_quaternions_sign() -> None:
    first = Pose.identity()
    second = Pose(-pose_from_vector(np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])).rotation_wxyz, np.zeros(3))
    np.testing.assert_allclose(vector_from_pose(interpolated(first, second, 0.5))[:3], [0.0, 0.0, 0.5], atol=1e-14)


def test_angle_between_ignores_where_the_poses_are() -> None:
    first = pose_from_vector(np.array([0.3, 0.0, 0.0, 100.0, 0.0, 0.0]))
    second = pose_from_vector(np.array([-0.4, 0.0, 0.0, 0.0, 7.0, 0.0]))
    assert angle_between(first, second) == pytest.approx(0.7, abs=1e-14)
    assert angle_between(first, first) == 0.0


def test_a_frame_from_a_tangent_keeps_the_reference_as_near_as_it_can() -> None:
    tangent, reference = np.array([3.0, 0.0, 0.0]), np.array([1.0, -2.0, 0.0])
    frame = frame_from_tangent(tangent, reference)
    np.testing.assert_allclose(frame[:, 2], X, atol=1e-15)
    np.testing.assert_allclose(frame[:, 0], -Y, atol=1e-15)
    np.testing.assert_allclose(frame[:, 1], np.cross(X, -Y), atol=1e-15)


@pytest.mark.parametrize("scale", [1.0, -1.0, 50.0])
def test_a_reference_along_the_tangent_is_refused(scale: float) -> None:
    with pytest.raises(ValueError, match="not parallel to the tangent"):
        frame_from_tangent(np.array([0.0, 0.6, 0.8]), scale * np.array([0.0, 0.6, 0.8]))


def test_turning_about_z_is_right_handed_about_its_own_axis() -> None:
    frame = frame_from_tangent(X, -Y)  # z along the insertion, x to -y: y to -z
    turned = turned_about_z(frame, QUARTER)
    np.testing.assert_allclose(turned[:, 2], X, atol=1e-15)
    np.testing.assert_allclose(turned[:, 0], frame[:, 1], atol=1e-15)
    np.testing.assert_allclose(turned[:, 0], -Z, atol=1e-15)
