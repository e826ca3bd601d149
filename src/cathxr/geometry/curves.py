"""Space curves given as polylines: arc length, resampling, tangents, and the frame carried along them."""

import numpy as np
from numba import njit

from cathxr.core import FloatArray, Pose
from cathxr.geometry import curve_kernels
from cathxr.geometry.pose import frame_from_tangent

_REASONS = {
    curve_kernels.COINCIDE: "points: expected distinct neighbours",
    curve_kernels.TURNS_BACK: "points: expected a curve that does not turn back on itself",
    curve_kernels.PARALLEL: "reference: expected a direction that is not parallel to the tangent",
}


def arc_length(points: FloatArray) -> FloatArray:
    """Return the distance (N,) along a polyline (N, D) from its first point, same unit."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def resampled(points: FloatArray, count: int) -> FloatArray:
    """Return `count` points (K, D) uniform in arc length along a polyline (N, D); the first and last are exact.

    Raises:
        ValueError: fewer than two points, `count` below two, or a curve without length.
    """
    if count < 2 or len(points) < 2:
        raise ValueError(f"points: expected at least 2 points in and out, got {len(points)} in and {count} out")
    result = np.empty((count, points.shape[1]))
    if not curve_kernels.resample(np.ascontiguousarray(points, dtype=np.float64), result) > 0:
        raise ValueError("points: expected a curve with a length, got one of length 0")
    return result


def tangents(points: FloatArray) -> FloatArray:
    """Return unit tangents (N, D) along a polyline (N, D), in the order of the points, second order in the spacing.

    Raises:
        ValueError: fewer than two points, two neighbours that coincide, or a curve that turns back on itself.
    """
    if len(points) < 2:
        raise ValueError(f"points: expected at least 2, got {len(points)}")
    along = arc_length(points)
    if (np.diff(along) <= 0).any():
        raise ValueError("points: expected distinct neighbours")
    slope = _slopes(points, along) if len(points) > 2 else np.repeat(np.diff(points, axis=0), 2, axis=0)
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    if not (length > 0).all():
        raise ValueError("points: expected a curve that does not turn back on itself")
    return np.asarray(slope / length, dtype=np.float64)


def _slopes(points: FloatArray, along: FloatArray) -> FloatArray:
    """Return the derivative (N, D) of at least three points by `along`: that of the parabola through neighbours."""
    steps = np.diff(along)[:, None]
    chords = np.diff(points, axis=0) / steps
    before, after = steps[:-1], steps[1:]
    inner = (after * chords[:-1] + before * chords[1:]) / (before + after)
    first = 2.0 * chords[0] - inner[0]
    last = 2.0 * chords[-1] - inner[-1]
    return np.concatenate([first[None], inner, last[None]])


def transported(points: FloatArray, unit_tangents: FloatArray, first_normal: FloatArray) -> FloatArray:
    """Return the rotation-minimising normal (N, 3) at each point, carried from the first by double reflection.

    points (N, 3) mm, unit_tangents (N, 3); first_normal (3,), made normal to the first tangent.
    Wang, Juettler, Zheng, Liu: "Computation of rotation minimizing frames", ACM TOG 27(1), 2008, table I.

    Raises:
        ValueError: first_normal is parallel to the first tangent.
    """
    first = frame_from_tangent(unit_tangents[0], first_normal)[:, 0]
    return _double_reflection(np.ascontiguousarray(points), np.ascontiguousarray(unit_tangents), first)


@njit(cache=True, nogil=True)
def _double_reflection(points: FloatArray, unit_tangents: FloatArray, first: FloatArray) -> FloatArray:
    normals = np.empty_like(unit_tangents)
    normals[0] = first
    for i in range(len(points) - 1):
        chord = points[i + 1] - points[i]
        squared = np.dot(chord, chord)
        if squared == 0.0:
            normals[i + 1] = normals[i]
            continue
        normal_mirrored = normals[i] - (2.0 / squared) * np.dot(chord, normals[i]) * chord
        tangent_mirrored = unit_tangents[i] - (2.0 / squared) * np.dot(chord, unit_tangents[i]) * chord
        second = unit_tangents[i + 1] - tangent_mirrored
        squared = np.dot(second, second)
        if squared > 0.0:
            normal_mirrored = normal_mirrored - (2.0 / squared) * np.dot(second, normal_mirrored) * second
        normals[i + 1] = normal_mirrored
    return normals


def tip_pose(shape_box: FloatArray, *, zero_direction: FloatArray, roll_rad: float) -> Pose:
    """Return box_from_tip for a centreline (K, 3) mm in `box`, tip first.

    The frame at the entry has z along the insertion and x along `zero_direction` made normal to it; it is carried to
    the tip by parallel transport and turned by `roll_rad` about the tangent. Assumes no torsion from gearbox to tip.
    """
    shape = np.ascontiguousarray(shape_box, dtype=np.float64)
    if len(shape) < 2:
        raise ValueError(f"points: expected at least 2, got {len(shape)}")
    frame = np.empty((3, 3))
    code = curve_kernels.tip_frame(shape, np.asarray(zero_direction, dtype=np.float64), roll_rad, frame)
    if code != curve_kernels.GOOD:
        raise ValueError(_REASONS[code])
    quaternion = np.empty(4)
    curve_kernels.quaternion_of(frame, quaternion)
    return Pose(quaternion, shape[0])
