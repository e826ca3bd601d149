"""From a fitted spline to the catheter's centreline: from the tip to where it crosses the inlet's plane. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.core import FloatArray
from cathxr.tracking.guess_kernels import ALIGNED, HIDDEN_MM
from cathxr.tracking.spline import cubic_pieces

DENSE = 240
ROOM = DENSE + 2
NOT_SEEN, NOT_INSERTED = 0, -1
_LONGEST_FOLD_MM = 5.0
_CHORD_MM = 5.0
_DISTINCT_MM = 1e-6


@njit(cache=True, nogil=True)
def centreline(spans, control, radius_mm, curve):  # type: ignore[no-untyped-def]
    """Fill `curve` (ROOM, 3) mm from the tip, one radius beyond the cap's centre, to the entry at x = 0.

    Return how many points it has; NOT_SEEN where its beginning at the inlet is not seen, NOT_INSERTED where there is
    next to nothing of it. spans, control (n, 3): the fitted spline, cap's centre first.
    """
    for i in range(DENSE):
        piece, values, _ = cubic_pieces(spans, i / (DENSE - 1))
        for axis in range(3):
            curve[i + 1, axis] = 0.0
            for k in range(4):
                curve[i + 1, axis] += values[k] * control[piece + k, axis]
    outwards = _apart(curve, 1, 2)
    for axis in range(3):
        curve[0, axis] = curve[1, axis] + radius_mm * (curve[1, axis] - curve[2, axis]) / max(outwards, 1e-12)
    count = _at_inlet(curve, DENSE + 1)
    if count <= 0:
        return count
    kept, length = 1, 0.0
    for i in range(1, count):
        step = _apart(curve, i, kept - 1)
        if step > _DISTINCT_MM:
            length += step
            _copy(curve, i, kept)
            kept += 1
        elif i == count - 1:
            _copy(curve, i, kept - 1)
    if kept < 3 or length < radius_mm:
        return NOT_INSERTED
    return kept


@njit(cache=True, nogil=True)
def _at_inlet(curve, count):  # type: ignore[no-untyped-def]
    """Cut the curve (N, 3) where it crosses x = 0, or carry it on there, in place; return its points, or why not."""
    for i in range(count - 2, -1, -1):
        if curve[i, 0] > 0.0 and curve[i + 1, 0] <= 0.0:
            share = curve[i, 0] / (curve[i, 0] - curve[i + 1, 0])
            for axis in range(1, 3):
                curve[i + 1, axis] = curve[i, axis] + share * (curve[i + 1, axis] - curve[i, axis])
            curve[i + 1, 0] = 0.0
            return i + 2
    count = unfolded(curve, count)
    last = count - 1
    near = 0
    while near < last - 1 and _apart(curve, near, last) >= _CHORD_MM:
        near += 1
    chord = _apart(curve, near, last)
    if not chord > 0.0:
        return NOT_SEEN
    x, y, z = curve[last, 0] - curve[near, 0], curve[last, 1] - curve[near, 1], curve[last, 2] - curve[near, 2]
    if curve[last, 0] > HIDDEN_MM or x / chord > -ALIGNED:
        return NOT_SEEN
    if curve[last, 0] > 1e-9:
        far = curve[last, 0] / x
        curve[count, 1] = curve[last, 1] - far * y
        curve[count, 2] = curve[last, 2] - far * z
        count += 1
    curve[count - 1, 0] = 0.0
    return count


@njit(cache=True, nogil=True)
def unfolded(curve: FloatArray, count: int) -> int:
    """Return how many of a curve's first `count` points (N, 3) are left without what turns back at its beginning.

    The two views may see it begin elsewhere. Such a fold is short and moves nothing else, but a frame carried around it
    would arrive upside down. As much again before it goes too: that is the way into the fold.
    """
    folded_mm = 0.0
    for last in range(count - 1, max(2, count // 2), -1):
        step = _apart(curve, last, last - 1)
        if curve[last, 0] - curve[last - 1, 0] >= -ALIGNED * step:
            folded_mm += step
            continue
        if not 0.0 < folded_mm < _LONGEST_FOLD_MM:
            return count
        before_mm = 0.0
        cut = last
        while cut > 0:
            before_mm += _apart(curve, cut, cut - 1)
            if before_mm >= folded_mm:
                break
            cut -= 1
        return max(3, cut + 1)
    return count


@njit(cache=True, nogil=True)
def _copy(points, source, target):  # type: ignore[no-untyped-def]
    """Copy one point of (N, 3) over another; assigning rows would allocate one in between."""
    for axis in range(3):
        points[target, axis] = points[source, axis]


@njit(cache=True, nogil=True)
def _apart(points, i, j):  # type: ignore[no-untyped-def]
    """Return the distance of two points of (N, 3)."""
    return math.sqrt(
        (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2 + (points[i, 2] - points[j, 2]) ** 2
    )


def curve_room() -> FloatArray:
    """Return room for a centreline, see `centreline`."""
    return np.zeros((ROOM, 3))
