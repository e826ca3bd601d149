"""From points in space to a first guess of the spline, and where on it each measured point is. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.geometry.camera_kernels import project_row
from cathxr.tracking.band import backward, factorise, forward
from cathxr.tracking.spline import cubic_pieces

SPAN_MM = 7.0
FEWEST_SPANS, MOST_SPANS = 3, 28
START_MM = 0.5
HIDDEN_MM = 25.0
"""How much of the catheter's beginning may be hidden by the inlet before the entry is a guess too far."""
ALIGNED = 0.25
"""Least cosine between the beginning's direction and the insertion axis for extrapolating the entry."""
EXTRA_POINTS = 27
"""So many points more a curve may have once it is carried on to the inlet."""
_CHORD_MM = 5.0
_AHEAD = 30
"""How many points of the curve a measured point may be ahead of the one before: across a stretch that is not seen."""
_NEAR_WIDTHS = 1.5
_LEAST = 1e-9
"""Keeps the matrix regular where no picture sees anything."""


@njit(cache=True, nogil=True)
def spans_of(length_mm):  # type: ignore[no-untyped-def]
    """Return how many pieces a spline of so much catheter has."""
    return int(min(max(np.rint(length_mm / SPAN_MM), FEWEST_SPANS), MOST_SPANS))


@njit(cache=True, nogil=True)
def length_of(points, count):  # type: ignore[no-untyped-def]
    """Return the length of the first `count` of points (N, 3), mm."""
    total = 0.0
    for i in range(1, count):
        total += _apart(points, i, i - 1)
    return total


@njit(cache=True, nogil=True)
def carried_to_inlet(points, count):  # type: ignore[no-untyped-def]
    """Return (points, whether it ends at x = 0) of a curve (N, 3) mm, tip first, cut or carried on there in place.

    It is cut where it crosses x = 0, for what lies behind the inlet's plane is held as it lies in front of it, or
    carried on straight where that is near; else left as it is. The array has room for EXTRA_POINTS more.
    """
    for i in range(count - 2, -1, -1):
        if points[i, 0] > 0.0 and points[i + 1, 0] <= 0.0:
            if i < 1:
                return count, False
            share = points[i, 0] / (points[i, 0] - points[i + 1, 0])
            for axis in range(3):
                points[i + 1, axis] = points[i, axis] + share * (points[i + 1, axis] - points[i, axis])
            return i + 2, True
    last = count - 1
    first = 0
    while first < last and not _apart(points, first, last) < _CHORD_MM:
        first += 1
    cx, cy, cz = (
        points[last, 0] - points[first, 0], points[last, 1] - points[first, 1], points[last, 2] - points[first, 2],
    )  # fmt: skip
    length = math.sqrt(cx * cx + cy * cy + cz * cz)
    missing = points[last, 0]
    if length < 1e-6 or missing > HIDDEN_MM or cx > -ALIGNED * length or missing < 0.0:
        return count, False
    if missing < START_MM:
        return count, True
    steps = int(max(1.0, np.rint(missing)))
    for i in range(1, steps + 1):
        far = missing / cx * i / steps
        points[last + i, 0] = points[last, 0] - far * cx
        points[last + i, 1] = points[last, 1] - far * cy
        points[last + i, 2] = points[last, 2] - far * cz
    return count + steps, True


@njit(cache=True, nogil=True)
def fit_points(spans, points, count, length_mm, jerk, jerk_scale, work):  # type: ignore[no-untyped-def]
    """Set `control` and `prior` of `work`: the spline nearest to points (N, 3) mm by arc length; return if it can be.

    jerk (n, 4): see `CubicBasis.jerk_information`; jerk_scale: what makes it the prior's information per mm^2.
    """
    size = spans + 3
    prior, band, control = work.prior, work.band, work.control
    weight = 1.0 / (START_MM * START_MM)
    for i in range(size):
        for d in range(4):
            prior[i, d] = jerk[i, d] * jerk_scale
            band[i, d] = 0.0
        prior[i, 0] += _LEAST
        for axis in range(3):
            control[i, axis] = 0.0
    along = 0.0
    for i in range(count):
        if i > 0:
            along += _apart(points, i, i - 1)
        piece, values, _ = cubic_pieces(spans, min(along / length_mm, 1.0))
        for a in range(4):
            for axis in range(3):
                control[piece + a, axis] += weight * values[a] * points[i, axis]
            for b in range(a + 1):
                band[piece + a, a - b] += weight * values[a] * values[b]
    for i in range(size):
        for d in range(4):
            band[i, d] += prior[i, d]
    narrow = band[:, :4]
    if not factorise(narrow, size):
        return False
    forward(narrow, size, control)
    backward(narrow, size, control)
    return True


@njit(cache=True, nogil=True)
def place(camera, curve, points, work):  # type: ignore[no-untyped-def]
    """Set `at` of `work`, of one view's points first to last, to where on a curve (K, 3) mm they lie, 0 to 1.

    points: (first, stop) of the view's points; camera (21,). -1 where a point is farther than one and a half widths.
    The points follow the curve: each is looked for from the one before on, so that a crossing misleads none. Return the
    last place, -1 where the curve cannot be seen by the camera.
    """
    first, stop = points
    line, count = work.line, len(curve)
    for i in range(count):
        u, v, _, _, depth = project_row(curve[i, 0], curve[i, 1], curve[i, 2], camera)
        if depth <= 0.0:
            return -1.0
        line[i, 0], line[i, 1] = u, v
    near = _NEAR_WIDTHS * 2.0 * work.half[first]
    before = 0
    furthest = 0.0
    for i in range(first, stop):
        x, y = work.curve[i, 0], work.curve[i, 1]
        least = near * near
        found = -1.0
        for j in range(max(before - 2, 0), min(before + _AHEAD, count - 1)):
            dx, dy = line[j + 1, 0] - line[j, 0], line[j + 1, 1] - line[j, 1]
            px, py = x - line[j, 0], y - line[j, 1]
            share = min(max((px * dx + py * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
            off = (px - share * dx) ** 2 + (py - share * dy) ** 2
            if off < least:
                least = off
                found = (j + share) / (count - 1)
        work.at[i] = found
        if found >= 0.0:
            before = int(found * (count - 1))
            furthest = max(furthest, found)
    return furthest


@njit(cache=True, nogil=True)
def _apart(points, i, j):  # type: ignore[no-untyped-def]
    """Return the distance of two points of (N, 3)."""
    return math.sqrt(
        (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2 + (points[i, 2] - points[j, 2]) ** 2
    )
