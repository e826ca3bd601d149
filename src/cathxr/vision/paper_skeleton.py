"""From a silhouette to an ordered path: thinning, then breadth-first search from the entry to the tip."""

from typing import Any

import numpy as np
from numba import njit

from cathxr.core import FloatArray, PixelArray


def skeleton_path(mask: PixelArray) -> FloatArray:
    """Return the skeleton's longest shortest path (N, 2) as column and row, px, tip first, entry last; (0, 2) if none.

    mask uint8 (H, W), 0 or 255: one silhouette that enters at the smallest column. The entry is the skeleton pixel of
    the smallest column; the tip is the pixel whose shortest path from it, counted in 8-connected steps, is longest.
    """
    skeleton = np.pad(mask, 1)
    thin(skeleton)
    rows, columns = np.nonzero(skeleton)
    if len(rows) == 0:
        return np.empty((0, 2))
    first = int(np.argmin(columns))
    flat = farthest_path(skeleton, int(rows[first]), int(columns[first]))
    width = skeleton.shape[1]
    return np.column_stack([flat % width - 1.0, flat // width - 1.0])


@njit(cache=True, nogil=True)  # type: ignore[misc, unused-ignore]
def thin(mask: Any) -> None:
    """Thin, in place, a mask uint8 (H, W), 0 or not, to a line one pixel wide; its outermost rows and columns are 0.

    Guo and Hall, "Parallel thinning with two-subiteration algorithms", Comm. ACM 32(3), 1989, algorithm A1.
    Only the pixels still set are visited, which a catheter's few thousand make quick.
    """
    width = mask.shape[1]
    pixels = mask.ravel()
    alive = np.flatnonzero(pixels)
    removed = np.empty_like(alive)
    left = len(alive)
    changed = True
    while changed:
        changed = False
        for half in range(2):
            count, kept = 0, 0
            for n in range(left):
                here = alive[n]
                if _removable(pixels, here, width, half):
                    removed[count] = here
                    count += 1
                else:
                    alive[kept] = here
                    kept += 1
            left = kept
            for n in range(count):
                pixels[removed[n]] = 0
            changed = changed or count > 0


@njit(cache=True, nogil=True)  # type: ignore[misc, unused-ignore]
def _removable(pixels: Any, here: int, width: int, half: int) -> bool:
    """Return whether a half step removes a pixel: it is no end, and its neighbours hold together without it."""
    north, south = pixels[here - width] != 0, pixels[here + width] != 0
    east, west = pixels[here + 1] != 0, pixels[here - 1] != 0
    north_east, south_east = pixels[here - width + 1] != 0, pixels[here + width + 1] != 0
    south_west, north_west = pixels[here + width - 1] != 0, pixels[here - width - 1] != 0
    runs = (
        int(not north and (north_east or east))
        + int(not east and (south_east or south))
        + int(not south and (south_west or west))
        + int(not west and (north_west or north))
    )
    if runs != 1:
        return False
    first = int(north_west or north) + int(north_east or east) + int(south_east or south) + int(south_west or west)
    second = int(north or north_east) + int(east or south_east) + int(south or south_west) + int(west or north_west)
    if not 2 <= min(first, second) <= 3:
        return False
    if half == 0:
        return not ((south or south_west or not north_west) and west)
    return not ((north or north_east or not south_east) and east)


@njit(cache=True, nogil=True)  # type: ignore[misc, unused-ignore]
def farthest_path(skeleton: Any, row: int, column: int) -> Any:
    """Return flat indices (N,) from the pixel farthest from (row, column) back to it, by breadth-first search.

    skeleton uint8 (H, W), zero on its outermost rows and columns, so that no neighbour lies outside.
    """
    width = skeleton.shape[1]
    pixels = skeleton.ravel()
    parent = np.full(pixels.size, -1, dtype=np.int32)
    queue = np.empty(np.count_nonzero(pixels), dtype=np.int32)
    # Straight neighbours before diagonal ones: of two shortest paths the one that keeps to the skeleton's corners wins.
    offsets = np.array([1, -1, width, -width, width + 1, width - 1, -width + 1, -width - 1], dtype=np.int32)
    start = row * width + column
    queue[0] = start
    parent[start] = start
    head, tail = 0, 1
    while head < tail:
        here = queue[head]
        head += 1
        for offset in offsets:
            there = here + offset
            if pixels[there] != 0 and parent[there] < 0:
                parent[there] = here
                queue[tail] = there
                tail += 1
    last = queue[tail - 1]
    count = 1
    here = last
    while here != start:
        here = parent[here]
        count += 1
    path = np.empty(count, dtype=np.int32)
    here = last
    for i in range(count):
        path[i] = here
        here = parent[here]
    return path
