"""Rotations and poses beyond composition: exponential and logarithm, alignment, adjoint, slerp."""

import numpy as np

from cathxr.core import FloatArray, Pose

_SMALL = 1e-8


def pose_from_vector(vector: FloatArray) -> Pose:
    """Return the pose of (6,) = rotation vector (rad) then translation (mm); the translation is not rotated."""
    return Pose(quaternion_from_rotation_vector(np.asarray(vector[:3])), np.asarray(vector[3:]))


def vector_from_pose(pose: Pose) -> FloatArray:
    """Return (6,) = rotation vector (rad, angle at most pi) then translation (mm). Inverse of `pose_from_vector`."""
    return np.concatenate([rotation_vector_from_quaternion(pose.rotation_wxyz), pose.translation_mm])


def perturbed(a_from_b: Pose, vector: FloatArray) -> Pose:
    """Return the pose turned and shifted in frame a by (6,): the left perturbation that rig covariances speak of."""
    step = pose_from_vector(vector)
    turned = Pose(step.rotation_wxyz, np.zeros(3)) @ Pose(a_from_b.rotation_wxyz, np.zeros(3))
    return Pose(turned.rotation_wxyz, a_from_b.translation_mm + step.translation_mm)


def quaternion_from_rotation_vector(vector: FloatArray) -> FloatArray:
    """Return the unit quaternion (4,) w-x-y-z of a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(vector))
    half = 0.5 * angle
    scale = 0.5 * (1.0 - half * half / 6.0) if angle < _SMALL else np.sin(half) / angle
    return np.concatenate([[np.cos(half)], scale * np.asarray(vector)])


def rotation_vector_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return the rotation vector (3,), rad, angle at most pi, of a unit quaternion (4,)."""
    unit = quaternion if quaternion[0] >= 0 else -quaternion
    sine = float(np.linalg.norm(unit[1:]))
    angle = 2.0 * np.arctan2(sine, unit[0])
    return np.asarray(unit[1:] * (2.0 if sine < _SMALL else angle / sine), dtype=np.float64)


def angle_between(first: Pose, second: Pose) -> float:
    """Return the angle, rad, of the rotation that takes one pose's orientation to the other's."""
    relative = first.inverse() @ second
    return float(np.linalg.norm(rotation_vector_from_quaternion(relative.rotation_wxyz)))


def interpolated(first: Pose, second: Pose, fraction: float) -> Pose:
    """Return the pose `fraction` of the way: spherical for rotation, straight for translation."""
    relative = first.inverse() @ second
    turn = quaternion_from_rotation_vector(fraction * rotation_vector_from_quaternion(relative.rotation_wxyz))
    rotation = Pose(first.rotation_wxyz, np.zeros(3)) @ Pose(turn, np.zeros(3))
    translation = (1.0 - fraction) * first.translation_mm + fraction * second.translation_mm
    return Pose(rotation.rotation_wxyz, translation)


def frame_from_tangent(tangent: FloatArray, reference: FloatArray) -> FloatArray:
    """Return a right-handed (3, 3) rotation with z along `tangent` and x along `reference` made normal to it.

    Raises:
        ValueError: the two directions are parallel.
    """
    z = tangent / np.linalg.norm(tangent)
    x = reference - (reference @ z) * z
    length = float(np.linalg.norm(x))
    if length < _SMALL:
        raise ValueError("reference: expected a direction that is not parallel to the tangent")
    x = x / length
    return np.column_stack([x, np.cross(z, x), z])


def turned_about_z(rotation: FloatArray, angle_rad: float) -> FloatArray:
    """Return `rotation` (3, 3) followed by a right-handed turn about its own z axis."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), dtype=np.float64)
