"""Curves in space that one view's midline and the other view's silhouette allow: a search over depths. Compiled.

Each point of the one midline lies on a ray. Where along it is a path through (depth, slope): inside the other view's
silhouette, without sharp bends, from the inlet on. Dynamic programming finds the best one.
"""

import math

import numpy as np
from numba import njit

from cathxr.geometry.camera_kernels import project_row

STEP_MM = 0.5
MOST_SLOPE = 8
"""Steepest way along the rays, in depth steps from point to point."""
_TURNS = 2
_BEND_COST = 0.5
"""Of a slope that changes by one, squared."""
_WORST = 16.0
_SHARE, _SPREAD = 0.85, 0.25
"""A tube in the silhouette has this much of its radius around it, to this much."""
_ENTRY_MM = 2.0


@njit(cache=True, nogil=True)
def point_costs(origin, rays, nearest_mm, count, camera, clearance, wanted, corner, radius_mm):  # type: ignore[no-untyped-def]
    """Return the cost (N, D) of each depth of each ray.

    origin (3,) mm; rays (N, 3) unit; depth j is nearest_mm + j STEP_MM along the ray, D = count. camera (21,): the
    other view's; clearance (h, w) px: how far inside its silhouette each pixel is, negative outside; wanted (h, w): a
    bonus; corner: the first pixel's (x, y).
    """
    rows, columns = clearance.shape
    result = np.empty((len(rays), count))
    for i in range(len(rays)):
        for j in range(count):
            far = nearest_mm + STEP_MM * j
            x, y, z = origin[0] + far * rays[i, 0], origin[1] + far * rays[i, 1], origin[2] + far * rays[i, 2]
            u, v, by_u, by_v, depth = project_row(x, y, z, camera)
            result[i, j] = _WORST
            if depth <= 0.0:
                continue
            column, row = round(u - corner[0]), round(v - corner[1])
            if not (0 <= column < columns and 0 <= row < rows):
                continue
            squared = 0.0
            for axis in range(3):
                squared += by_u[axis] * by_u[axis] + by_v[axis] * by_v[axis]
            radius = radius_mm * math.sqrt(0.5 * squared)
            short = max(0.0, _SHARE * radius - clearance[row, column]) / (_SPREAD * radius)
            result[i, j] = min(short * short, _WORST) - wanted[row, column]
    return result


@njit(cache=True, nogil=True)
def best_depths(costs, entry):  # type: ignore[no-untyped-def]
    """Return the depths (N,), as indices, of the best path; costs (N, D), tip first; entry (D,): of the last point."""
    count, depths = costs.shape
    slopes = 2 * MOST_SLOPE + 1
    total = np.empty((depths, slopes))
    after = np.empty((depths, slopes))
    came = np.zeros((count, depths, slopes), dtype=np.int8)
    for j in range(depths):
        for s in range(slopes):
            total[j, s] = costs[count - 1, j] + entry[j]
    for i in range(count - 2, -1, -1):
        for j in range(depths):
            for s in range(slopes):  # the slope of the way here
                before = j - (s - MOST_SLOPE)
                after[j, s] = np.inf
                if not 0 <= before < depths:
                    continue
                least, chosen = np.inf, 0
                for turn in range(-_TURNS, _TURNS + 1):
                    other = s + turn
                    if 0 <= other < slopes:
                        value = total[before, other] + _BEND_COST * turn * turn
                        if value < least:
                            least, chosen = value, turn
                after[j, s] = least + costs[i, j]
                came[i, j, s] = chosen
        total, after = after, total
    result = np.zeros(count, dtype=np.int64)
    best = int(np.argmin(total))
    j, s = best // slopes, best % slopes
    for i in range(count):
        result[i] = j
        if i < count - 1:
            turn = came[i, j, s]
            j -= s - MOST_SLOPE
            s += turn
    return result


@njit(cache=True, nogil=True)
def entry_costs(origin, ray, nearest_mm, count):  # type: ignore[no-untyped-def]
    """Return the cost (count,) of each depth of the midline's last ray: how far it is from the inlet's axis.

    origin, ray (3,): in `box`, whose x axis that is.
    """
    result = np.empty(count)
    for j in range(count):
        far = nearest_mm + STEP_MM * j
        y, z = origin[1] + far * ray[1], origin[2] + far * ray[2]
        spread = _ENTRY_MM + 0.1 * max(origin[0] + far * ray[0], 0.0)
        result[j] = 10.0 * (y * y + z * z) / (spread * spread)
    return result
