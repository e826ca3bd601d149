"""How unsure a tip is whose end looks other than the rounded one that is fitted: cut off square, pinned, or shining."""

import math
from collections.abc import Sequence

from numba import njit

from cathxr.core import Detection, FloatArray
from cathxr.geometry.medians import median_of
from cathxr.tracking.fit import CurveFit

_LEAST_POINTS = 8
"""Fewer points of the outline on the rounded end say nothing about its shape."""
_NOISE_PX = 0.12
"""Outlines of rounded ends are off by up to this, whatever their size."""
_ROUND, _OTHER = 0.04, 0.08
"""Off by less than the first share of the radius an end is round; by more than the second it is any other end."""
_UNSURE_RADII = 0.5
"""The tip of any other end: a hemisphere's is one radius ahead of where its cap begins, that of a square cut none."""


def other_end_mm(
    fit: CurveFit, detections: Sequence[Detection], room: FloatArray, *, radius_mm: float, doubtful: str | None
) -> float:
    """Return what to add to the tip's standard deviation, mm, in squares: 0 where each view shows a rounded end.

    The fit's outlines are the ends' of the views, in their order, or whole silhouettes. doubtful: a camera whose
    outline had no part. room: for as many numbers as the outlines have points, overwritten.
    """
    widest_px = max(float(each.half_width_px[0]) if len(each.half_width_px) else 0.0 for each in detections)
    if len(fit.end_off_px) != sum(len(each.end_px) for each in detections):
        return _added_mm(typical_off(fit.end_off_px, fit.caps, room), widest_px, radius_mm)
    first, largest_mm = 0, 0.0
    for each in detections:
        stop = first + len(each.end_px)
        if each.camera != doubtful and stop > first:
            off_px = typical_off(fit.end_off_px[first:stop], fit.caps[first:stop], room)
            largest_mm = max(largest_mm, _added_mm(off_px, float(each.half_width_px[0]), radius_mm))
        first = stop
    return largest_mm


def _added_mm(off_px: float, radius_px: float, radius_mm: float) -> float:
    share = math.sqrt(max(off_px**2 - _NOISE_PX**2, 0.0)) / max(radius_px, 1e-9)
    return _UNSURE_RADII * radius_mm * min(max((share - _ROUND) / (_OTHER - _ROUND), 0.0), 1.0)


@njit(cache=True, nogil=True)
def typical_off(off, caps, room):  # type: ignore[no-untyped-def]
    """Return how far points of a rounded end's outline lie off it, px: a standard deviation that debris cannot move.

    off (E,): of a whole outline; caps (E,): which of its points are the rounded end's. 0 where these are few. room:
    for E numbers, overwritten.
    """
    count = 0
    for i in range(len(off)):
        if caps[i]:
            room[count] = abs(off[i])
            count += 1
    if count < _LEAST_POINTS:
        return 0.0
    return 1.4826 * median_of(room, count)
