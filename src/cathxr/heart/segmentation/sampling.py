"""Several volumes on one grid sampled at the same places at once."""

import numpy as np
import numpy.typing as npt
from numba import njit

from cathxr.core import FloatArray


def sampled(
    values: npt.NDArray[np.float32], index: npt.NDArray[np.floating], *, nearest_beyond: bool = True
) -> npt.NDArray[np.float32]:
    """Return the values (C, …) of C volumes (C, K, J, I) at voxel coordinates (3, …; in the order k, j, i), linearly.

    Beyond the volumes their edge goes on, or there is 0.
    """
    places = np.ascontiguousarray(index.reshape(3, -1), np.float32)
    out = np.empty((len(values), places.shape[1]), np.float32)
    _sampled(np.ascontiguousarray(values, np.float32), places, nearest_beyond, out)
    return out.reshape(len(values), *index.shape[1:])


@njit(cache=True, nogil=True)
def _sampled(
    values: npt.NDArray[np.float32], places: npt.NDArray[np.float32], nearest: bool, out: npt.NDArray[np.float32]
) -> None:
    """Write each volume's value at each place."""
    channels, depth, rows, columns = values.shape
    for n in range(places.shape[1]):
        k, j, i = places[0, n], places[1, n], places[2, n]
        within = 0.0 <= k <= depth - 1 and 0.0 <= j <= rows - 1 and 0.0 <= i <= columns - 1
        if not within and not nearest:
            for channel in range(channels):
                out[channel, n] = 0.0
            continue
        k = min(max(k, np.float32(0.0)), np.float32(depth - 1))
        j = min(max(j, np.float32(0.0)), np.float32(rows - 1))
        i = min(max(i, np.float32(0.0)), np.float32(columns - 1))
        k0, j0, i0 = int(k), int(j), int(i)
        k1, j1, i1 = min(k0 + 1, depth - 1), min(j0 + 1, rows - 1), min(i0 + 1, columns - 1)
        c, b, a = k - np.float32(k0), j - np.float32(j0), i - np.float32(i0)
        for channel in range(channels):
            v = values[channel]
            low = (v[k0, j0, i0] * (1 - a) + v[k0, j0, i1] * a) * (1 - b)
            low += (v[k0, j1, i0] * (1 - a) + v[k0, j1, i1] * a) * b
            high = (v[k1, j0, i0] * (1 - a) + v[k1, j0, i1] * a) * (1 - b)
            high += (v[k1, j1, i0] * (1 - a) + v[k1, j1, i1] * a) * b
            out[channel, n] = low * (1 - c) + high * c


def largest_two(
    values: npt.NDArray[np.float32], mask: npt.NDArray[np.bool_], index_from_voxel: FloatArray
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """Return which of C volumes (C, K, J, I) is largest at each voxel of the mask, from 1, and by how much.

    index_from_voxel (3, 4): from the mask's voxel coordinates (k, j, i, 1) to those of the volumes. Beyond these the
    last one is 1 and the others are 0. Outside the mask both results are 0.
    """
    best = np.zeros(mask.shape, np.uint8)
    lead = np.zeros(mask.shape, np.float32)
    _largest_two(np.ascontiguousarray(values), mask, np.ascontiguousarray(index_from_voxel, np.float64), best, lead)
    return best, lead


@njit(cache=True, nogil=True)
def _largest_two(
    values: npt.NDArray[np.float32],
    mask: npt.NDArray[np.bool_],
    matrix: FloatArray,
    best: npt.NDArray[np.uint8],
    lead: npt.NDArray[np.float32],
) -> None:
    """Write the largest volume's number and its lead, a row at a time."""
    channels = values.shape[0]
    places = np.empty((3, mask.shape[2]), np.float32)
    found = np.empty((channels, mask.shape[2]), np.float32)
    for k in range(mask.shape[0]):
        for j in range(mask.shape[1]):
            count = 0
            for i in range(mask.shape[2]):
                if mask[k, j, i]:
                    for axis in range(3):
                        row = matrix[axis]
                        places[axis, count] = row[0] * k + row[1] * j + row[2] * i + row[3]
                    count += 1
            if count == 0:
                continue
            _sampled(values, places[:, :count], False, found[:, :count])
            count = 0
            for i in range(mask.shape[2]):
                if not mask[k, j, i]:
                    continue
                first, second, number, total = np.float32(-1.0), np.float32(-1.0), 0, np.float32(0.0)
                for channel in range(channels):
                    value = found[channel, count]
                    total += value
                    if value > first:
                        first, second, number = value, first, channel
                    elif value > second:
                        second = value
                if total == 0.0:  # beyond the volumes
                    number, first, second = channels - 1, np.float32(1.0), np.float32(0.0)
                best[k, j, i] = number + 1
                lead[k, j, i] = first - second
                count += 1
