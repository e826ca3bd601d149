"""How far points are from a surface: exact, by a grid of cells that says which triangles are near."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.heart.surface import IndexArray, Surface

_SAMPLES = 20_000
_MOST_CELLS = 4_000_000


def distances_mm(points_mm: FloatArray, surface: Surface, *, within_mm: float = np.inf) -> FloatArray:
    """Return how far each point (N, 3) is from the surface: (N,) mm, not below zero; infinite beyond `within_mm`."""
    corners = np.ascontiguousarray(surface.vertices_mm[surface.triangles])
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    sides = corners.max(axis=1) - corners.min(axis=1)
    volume = float(np.maximum(high - low, 1e-3).prod())
    # A cell about as large as a triangle: few triangles in each, and each in few cells.
    size = max(1.2 * float(sides.max(axis=1).mean()), (volume / _MOST_CELLS) ** (1 / 3), 1e-3)
    counts = np.floor((high - low) / size).astype(np.int64) + 1
    starts, members = _filed(corners, low, size, counts)
    points = np.ascontiguousarray(points_mm, dtype=np.float64)
    return np.asarray(_nearest(points, corners, low, size, counts, starts, members, within_mm))


def sampled(surface: Surface, count: int = _SAMPLES) -> FloatArray:
    """Return `count` points (count, 3) mm spread evenly by area over the surface; the same surface gives the same."""
    area = np.cumsum(np.linalg.norm(surface.area_vectors, axis=1))
    steps = (np.arange(count) + 0.5) / count
    triangle = np.minimum(np.searchsorted(area, steps * area[-1]), len(area) - 1)
    # The additive recurrence of the golden ratio's relatives covers each triangle evenly without a random generator.
    u, v = np.mod(np.arange(count) * 0.7548776662466927, 1.0), np.mod(np.arange(count) * 0.5698402909980532, 1.0)
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    a, b, c = np.moveaxis(surface.vertices_mm[surface.triangles[triangle]], 1, 0)
    return np.asarray(a + u[:, None] * (b - a) + v[:, None] * (c - a))


@njit(cache=True, nogil=True)
def _span(
    corners: FloatArray, low: FloatArray, size: float, counts: IndexArray
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return the first and the last cell (2, 3) of a triangle's box."""
    span = np.empty((2, 3), np.int64)
    for axis in range(3):
        least = min(corners[0, axis], corners[1, axis], corners[2, axis])
        most = max(corners[0, axis], corners[1, axis], corners[2, axis])
        span[0, axis] = min(max(int((least - low[axis]) / size), 0), counts[axis] - 1)
        span[1, axis] = min(max(int((most - low[axis]) / size), 0), counts[axis] - 1)
    return span


@njit(cache=True, nogil=True)
def _filed(
    corners: FloatArray, low: FloatArray, size: float, counts: IndexArray
) -> tuple[IndexArray, IndexArray]:  # pragma: no cover - compiled
    """Return the triangles by cell: those of cell c are members[starts[c]:starts[c + 1]]."""
    sizes = np.zeros(counts[0] * counts[1] * counts[2] + 1, np.int64)
    for index in range(len(corners)):
        span = _span(corners[index], low, size, counts)
        for a in range(span[0, 0], span[1, 0] + 1):
            for b in range(span[0, 1], span[1, 1] + 1):
                for c in range(span[0, 2], span[1, 2] + 1):
                    sizes[(a * counts[1] + b) * counts[2] + c + 1] += 1
    starts = np.cumsum(sizes)
    free = starts.copy()
    members = np.empty(starts[-1], np.int64)
    for index in range(len(corners)):
        span = _span(corners[index], low, size, counts)
        for a in range(span[0, 0], span[1, 0] + 1):
            for b in range(span[0, 1], span[1, 1] + 1):
                for c in range(span[0, 2], span[1, 2] + 1):
                    cell = (a * counts[1] + b) * counts[2] + c
                    members[free[cell]] = index
                    free[cell] += 1
    return starts, members


@njit(cache=True, nogil=True)
def _nearest(
    points: FloatArray,
    corners: FloatArray,
    low: FloatArray,
    size: float,
    counts: IndexArray,
    starts: IndexArray,
    members: IndexArray,
    within_mm: float,
) -> FloatArray:  # pragma: no cover - compiled
    """Return each point's distance (N,) from the nearest triangle: cells are searched in growing shells around it."""
    out = np.empty(len(points))
    last = counts.max()
    for number in range(len(points)):
        p = points[number]
        at = np.empty(3, np.int64)
        to_wall = size
        for axis in range(3):
            place = (p[axis] - low[axis]) / size
            at[axis] = min(max(int(np.floor(place)), 0), counts[axis] - 1)
            to_wall = min(to_wall, size * max(min(place - at[axis], at[axis] + 1 - place), 0.0))
        best, ring = within_mm * within_mm, 0
        while ring <= last:
            # What lies in this shell or beyond is at least this far away.
            nearest = to_wall + (ring - 1) * size
            if ring > 0 and best <= nearest * nearest:
                break
            for a in range(max(at[0] - ring, 0), min(at[0] + ring, counts[0] - 1) + 1):
                for b in range(max(at[1] - ring, 0), min(at[1] + ring, counts[1] - 1) + 1):
                    inner = abs(a - at[0]) < ring and abs(b - at[1]) < ring
                    step = 2 * ring if inner and ring > 0 else 1
                    for c in range(at[2] - ring, at[2] + ring + 1, step):
                        if c < 0 or c >= counts[2]:
                            continue
                        cell = (a * counts[1] + b) * counts[2] + c
                        for member in range(starts[cell], starts[cell + 1]):
                            best = min(best, _squared(p, corners[members[member]]))
            ring += 1
        out[number] = np.sqrt(best) if best < within_mm * within_mm else np.inf
    return out


@njit(cache=True, nogil=True)
def _squared(p: FloatArray, triangle: FloatArray) -> float:  # pragma: no cover - compiled
    """Return the squared distance of a point from a triangle (3, 3).

    Source of the regions: Ericson, "Real-time collision detection", Morgan Kaufmann 2005, section 5.1.5.
    """
    ax, ay, az = triangle[0]
    abx, aby, abz = triangle[1, 0] - ax, triangle[1, 1] - ay, triangle[1, 2] - az
    acx, acy, acz = triangle[2, 0] - ax, triangle[2, 1] - ay, triangle[2, 2] - az
    px, py, pz = p[0] - ax, p[1] - ay, p[2] - az
    d1, d2 = abx * px + aby * py + abz * pz, acx * px + acy * py + acz * pz
    aa, bb = abx * abx + aby * aby + abz * abz, acx * acx + acy * acy + acz * acz
    ab = abx * acx + aby * acy + abz * acz
    d3, d4, d5, d6 = d1 - aa, d2 - ab, d1 - ab, d2 - bb
    v, w = 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    else:
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            v, w = d1 / (d1 - d3), 0.0
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            v, w = 0.0, d2 / (d2 - d6)
        elif va <= 0.0 and d4 >= d3 and d5 >= d6:
            w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
            v = 1.0 - w
        else:
            total = va + vb + vc
            if total > 0.0:
                v, w = vb / total, vc / total
    dx, dy, dz = px - v * abx - w * acx, py - v * aby - w * acy, pz - v * abz - w * acz
    return float(dx * dx + dy * dy + dz * dz)
