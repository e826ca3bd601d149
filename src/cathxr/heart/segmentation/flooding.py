"""Flooding a landscape from marked voxels: who reaches what first, over low ground before high."""

import numpy as np
import numpy.typing as npt
from numba import njit

LEVELS = 512
"""Heights of a landscape are whole numbers below this."""


def flooded_from(
    landscape: npt.NDArray[np.uint16], markers: npt.NDArray[np.uint8], mask: npt.NDArray[np.bool_]
) -> npt.NDArray[np.uint8]:
    """Return the marker that each voxel (K, J, I) of the mask is flooded from; 0 where none reaches it.

    Neighbours share a face. Where two floods are equally high, the one that came first goes on first.
    F. Meyer, "Un algorithme optimal pour la ligne de partage des eaux", 1991; here with one queue a level.
    """
    out = np.where(mask, markers, np.uint8(0))
    _flood(np.minimum(landscape, LEVELS - 1).ravel(), mask.ravel(), out.ravel(), mask.shape)
    return out


@njit(cache=True, nogil=True)
def _flood(
    landscape: npt.NDArray[np.uint16],
    mask: npt.NDArray[np.bool_],
    out: npt.NDArray[np.uint8],
    shape: tuple[int, int, int],
) -> None:
    """Extend the marked voxels in `out`, in place. All arrays are flat; each level's queue is a linked list."""
    depth, rows, columns = shape
    plane = rows * columns
    head = np.full(LEVELS, -1, np.int32)
    tail = np.full(LEVELS, -1, np.int32)
    following = np.full(len(out), -1, np.int32)
    steps = (-plane, plane, -columns, columns, -1, 1)
    # What is marked and has a free neighbour starts the flood.
    for at in range(len(out)):
        if out[at] == 0:
            continue
        k, rest = at // plane, at % plane
        j, i = rest // columns, rest % columns
        room = (k > 0, k < depth - 1, j > 0, j < rows - 1, i > 0, i < columns - 1)
        for side in range(6):
            if room[side] and mask[at + steps[side]] and out[at + steps[side]] == 0:
                level = landscape[at]
                if tail[level] < 0:
                    head[level] = at
                else:
                    following[tail[level]] = at
                tail[level] = at
                break
    level = 0
    while level < LEVELS:
        at = head[level]
        if at < 0:
            level += 1
            continue
        head[level] = following[at]
        if head[level] < 0:
            tail[level] = -1
        following[at] = -1
        k, rest = at // plane, at % plane
        j, i = rest // columns, rest % columns
        room = (k > 0, k < depth - 1, j > 0, j < rows - 1, i > 0, i < columns - 1)
        lowest = level
        for side in range(6):
            if not room[side]:
                continue
            other = at + steps[side]
            if out[other] != 0 or not mask[other]:
                continue
            out[other] = out[at]
            height = int(landscape[other])
            if tail[height] < 0:
                head[height] = other
            else:
                following[tail[height]] = other
            tail[height] = other
            lowest = min(lowest, height)
        level = lowest
