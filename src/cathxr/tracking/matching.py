"""Which point of one view's curve is which of the other's: monotone matching on epipolar distance.

Dynamic programming as in Hoffmann et al., "Semi-automatic catheter reconstruction from two views", MICCAI 2012.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from cathxr.core import FloatArray

_SIDE_STEP_COST = 0.02
"""Cost, in squared scaled distances, of moving on in one curve only. Along an epipolar line any order of such steps
costs the same: the fit, which is smooth, settles where in such a stretch each point belongs."""
_UNMATCHED_COST = 4.0
"""Cost of a point at a curve's beginning that has no partner: as much as a pair that is off by two sigma."""
_CAP = 25.0
"""Largest squared scaled distance of one pair: beyond five standard deviations a pair is simply wrong."""


@dataclass(frozen=True, eq=False)
class Matching:
    """pairs (M, 2): indices into the two curves, non-decreasing; rms: of the scaled epipolar distance."""

    pairs: np.ndarray[tuple[int, int], np.dtype[np.int64]]
    rms: float


def ray_distances(
    first_origin: FloatArray, first: FloatArray, second_origin: FloatArray, second: FloatArray
) -> FloatArray:
    """Return the distance (N, M), mm, between each ray of one camera and each of another: epipolar, but in space.

    origins (3,) mm, directions (N, 3) and (M, 3) unit, all in `box`.
    """
    apart = np.asarray(second_origin - first_origin, dtype=np.float64)
    result = _skew_distances(apart, np.ascontiguousarray(first), np.ascontiguousarray(second))
    return np.asarray(result, dtype=np.float64)


@njit(cache=True, nogil=True)
def _skew_distances(apart, first, second):  # type: ignore[no-untyped-def]
    """Return |apart . (first x second)| / |first x second| for each two directions."""
    result = np.empty((len(first), len(second)))
    for i in range(len(first)):
        ax, ay, az = first[i, 0], first[i, 1], first[i, 2]
        for j in range(len(second)):
            nx = ay * second[j, 2] - az * second[j, 1]
            ny = az * second[j, 0] - ax * second[j, 2]
            nz = ax * second[j, 1] - ay * second[j, 0]
            length = max((nx * nx + ny * ny + nz * nz) ** 0.5, 1e-9)
            result[i, j] = abs(nx * apart[0] + ny * apart[1] + nz * apart[2]) / length
    return result


def match(distance: FloatArray, sigma: float) -> Matching:
    """Return the best monotone matching that uses up one of the curves.

    It begins with the first point of one curve at least: where the tip hides behind the catheter in one view, the
    other's first points have no partner.

    distance (N, M): see `ray_distances`; sigma: its standard deviation for a right pair, same unit.
    """
    cost = np.minimum(np.square(distance / sigma), _CAP)
    total, came = _accumulated(cost, _SIDE_STEP_COST, _UNMATCHED_COST)
    rows, columns = cost.shape
    last_row, last_column = total[-1] / rows, total[:, -1] / columns
    if last_row.min() <= last_column.min():
        end = (rows - 1, int(np.argmin(last_row)))
    else:
        end = (int(np.argmin(last_column)), columns - 1)
    pairs = _walk_back(came, *end)
    rms = float(np.sqrt(np.mean(cost[pairs[:, 0], pairs[:, 1]])))
    return Matching(pairs, rms)


@njit(cache=True, nogil=True)
def _accumulated(cost, side_cost, unmatched_cost):  # type: ignore[no-untyped-def]
    """Return (total cost, step taken: 0 both, 1 first only, 2 second only, 3 begun) of the best way to each pair."""
    rows, columns = cost.shape
    total = np.empty((rows, columns))
    came = np.zeros((rows, columns), dtype=np.int8)
    for i in range(rows):
        for j in range(columns):
            best = np.inf
            step = 3
            if i == 0 or j == 0:
                best = cost[i, j] + unmatched_cost * (i + j)
            if i > 0 and j > 0 and total[i - 1, j - 1] + cost[i, j] < best:
                best = total[i - 1, j - 1] + cost[i, j]
                step = 0
            if i > 0 and total[i - 1, j] + 0.5 * cost[i, j] + side_cost < best:
                best = total[i - 1, j] + 0.5 * cost[i, j] + side_cost
                step = 1
            if j > 0 and total[i, j - 1] + 0.5 * cost[i, j] + side_cost < best:
                best = total[i, j - 1] + 0.5 * cost[i, j] + side_cost
                step = 2
            total[i, j] = best
            came[i, j] = step
    return total, came


@njit(cache=True, nogil=True)
def _walk_back(came, row, column):  # type: ignore[no-untyped-def]
    """Return the pairs (M, 2) from where the way begins to (row, column)."""
    pairs = np.empty((row + column + 1, 2), dtype=np.int64)
    count = 0
    while True:
        pairs[count, 0] = row
        pairs[count, 1] = column
        count += 1
        step = came[row, column]
        if step == 3:
            break
        if step != 2:
            row -= 1
        if step != 1:
            column -= 1
    return pairs[:count][::-1].copy()
