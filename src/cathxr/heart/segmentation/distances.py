"""Exact Euclidean distances on grids of voxels: how far, and to which voxel, it is to the nearest one of a mask."""

import numpy as np
import numpy.typing as npt
from numba import njit

from cathxr.core import FloatArray

_FAR = np.float32(1e30)
"""Squared distance, mm², where the mask is empty."""


def distance_to(mask: npt.NDArray[np.bool_], sampling_mm: float | FloatArray) -> npt.NDArray[np.float32]:
    """Return the distance mm of each voxel (K, J, I) to the nearest one in the mask, 0 within it.

    sampling_mm: along each axis, or one for all. Where the mask is empty the distance is 1e15.
    P. Felzenszwalb, D. Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8 (2012).
    """
    squares, _ = _transformed(mask, _along(sampling_mm), False)
    return np.sqrt(squares, out=squares)


def distance_within(mask: npt.NDArray[np.bool_], sampling_mm: float | FloatArray) -> npt.NDArray[np.float32]:
    """Return the distance mm of each voxel (K, J, I) of the mask to the nearest one outside it, 0 outside."""
    return distance_to(~mask, sampling_mm)


def nearest_in(
    mask: npt.NDArray[np.bool_], sampling_mm: float | FloatArray
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int32]]:
    """Return the distance mm to the nearest voxel of the mask and that voxel's flat index, -1 without any (K, J, I)."""
    squares, index = _transformed(mask, _along(sampling_mm), True)
    return np.sqrt(squares, out=squares), index


def opened(mask: npt.NDArray[np.bool_], radius_mm: float, spacing_mm: float) -> npt.NDArray[np.bool_]:
    """Return what a ball of this radius reaches within the mask."""
    centres = distance_within(mask, spacing_mm) >= radius_mm
    if not centres.any():
        return np.zeros_like(mask)
    return np.asarray(mask & (distance_to(centres, spacing_mm) < radius_mm))


def closed(mask: npt.NDArray[np.bool_], radius_mm: float, spacing_mm: float) -> npt.NDArray[np.bool_]:
    """Return the mask with what is narrower than twice the radius filled."""
    near = distance_to(mask, spacing_mm) <= radius_mm
    return np.asarray(distance_within(near, spacing_mm) > radius_mm)


def _along(sampling_mm: float | FloatArray) -> tuple[float, float, float]:
    """Return the distance of neighbours along each axis."""
    k, j, i = np.broadcast_to(np.asarray(sampling_mm, float), 3)
    return float(k), float(j), float(i)


def _transformed(
    mask: npt.NDArray[np.bool_], sampling_mm: tuple[float, float, float], keep: bool
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int32]]:
    """Return the squared distances and, if they are to be kept, the nearest voxels' flat indices."""
    mask = np.ascontiguousarray(mask)
    squares = np.empty(mask.shape, np.float32)
    index = np.empty(mask.shape if keep else (1, 1, 1), np.int32)
    _along_rows(mask, sampling_mm[2], squares, index, keep)
    _along_columns(squares, index, sampling_mm[1], keep)
    # The third axis is the second one of the same voxels with their first two axes exchanged.
    _along_columns(np.swapaxes(squares, 0, 1), np.swapaxes(index, 0, 1), sampling_mm[0], keep)
    return squares, index


@njit(cache=True, nogil=True)
def _along_rows(
    mask: npt.NDArray[np.bool_],
    step: float,
    squares: npt.NDArray[np.float32],
    index: npt.NDArray[np.int32],
    keep: bool,
) -> None:
    """Write the squared distance along the last axis, by one sweep forwards and one backwards."""
    depth, rows, columns = mask.shape
    for k in range(depth):
        for j in range(rows):
            base = (k * rows + j) * columns
            last = -1
            for i in range(columns):
                if mask[k, j, i]:
                    last = i
                if last < 0:
                    squares[k, j, i] = _FAR
                    if keep:
                        index[k, j, i] = -1
                else:
                    away = step * (i - last)
                    squares[k, j, i] = away * away
                    if keep:
                        index[k, j, i] = base + last
            last = -1
            for i in range(columns - 1, -1, -1):
                if mask[k, j, i]:
                    last = i
                if last >= 0:
                    away = step * (last - i)
                    if away * away < squares[k, j, i]:
                        squares[k, j, i] = away * away
                        if keep:
                            index[k, j, i] = base + last


@njit(cache=True, nogil=True)
def _along_columns(squares: npt.NDArray[np.float32], index: npt.NDArray[np.int32], step: float, keep: bool) -> None:
    """Lower, in place, the squared distances by way of the second axis: the lower envelope of parabolas."""
    depth, rows, columns = squares.shape
    lines = np.empty((columns, rows), np.float32)
    origins = np.empty((columns, rows), np.int32)
    vertex = np.empty(rows, np.int32)
    start = np.empty(rows + 1, np.float64)
    unit = step * step
    for k in range(depth):
        for j in range(rows):
            for i in range(columns):
                lines[i, j] = squares[k, j, i]
                if keep:
                    origins[i, j] = index[k, j, i]
        for i in range(columns):
            highest = np.float32(0.0)
            for j in range(rows):
                highest = max(highest, lines[i, j])
            if highest == 0.0:  # all within the mask
                continue
            count = -1
            for j in range(rows):
                height = np.float64(lines[i, j])
                if height >= _FAR:
                    continue
                while count >= 0:
                    other = vertex[count]
                    crossing = (height + unit * j * j - lines[i, other] - unit * other * other) / (
                        2.0 * unit * (j - other)
                    )
                    if crossing > start[count]:
                        break
                    count -= 1
                count += 1
                vertex[count] = j
                start[count] = -1e30 if count == 0 else crossing
            if count < 0:
                continue
            at = 0
            for j in range(rows):
                while at < count and start[at + 1] < j:
                    at += 1
                other = vertex[at]
                away = step * (j - other)
                squares[k, j, i] = lines[i, other] + away * away
                if keep:
                    index[k, j, i] = origins[i, other]
