"""What is checked on a surface, as figures: closed, outward, in how many pieces, through itself or not."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from cathxr.core import FloatArray
from cathxr.heart.surface import IndexArray, Surface, edge_keys

_FOLDED = -0.9999


@dataclass(frozen=True)
class Topology:
    """Figures of one surface.

    open_edges: edges with one triangle. crowded_edges: edges with more than two, or whose two disagree on the sense.
    pieces: connected pieces that enclose something; cavities: pieces that are the inside of a hole in one.
    euler: vertices - edges + triangles: 2 for each piece without handles.
    """

    open_edges: int
    crowded_edges: int
    pieces: int
    cavities: int
    euler: int
    intersections: int

    @property
    def is_watertight(self) -> bool:
        """Whether every edge has its two triangles, in the same sense."""
        return self.open_edges == 0 and self.crowded_edges == 0

    @property
    def handles(self) -> int:
        """How many handles (tunnels) all pieces have together."""
        return (2 * (self.pieces + self.cavities) - self.euler) // 2


def topology(surface: Surface) -> Topology:
    """Return the checks of a surface."""
    triangles = surface.triangles
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, inverse, counts = np.unique(edge_keys(directed), return_inverse=True, return_counts=True)
    sense = np.bincount(inverse.reshape(-1), np.where(directed[:, 0] < directed[:, 1], 1, -1), len(edges))
    volumes = piece_volumes(surface)[1]
    return Topology(
        open_edges=int(np.count_nonzero(counts == 1)),
        crowded_edges=int(np.count_nonzero((counts > 2) | ((counts == 2) & (sense != 0)))),
        pieces=int(np.count_nonzero(volumes > 0.0)),
        cavities=int(np.count_nonzero(volumes <= 0.0)),
        euler=int(len(np.unique(triangles)) - len(edges) + len(triangles)),
        intersections=len(self_intersections(surface)),
    )


def piece_volumes(surface: Surface) -> tuple[IndexArray, FloatArray]:
    """Return each triangle's connected piece (M,), and the volume mL that each piece encloses, below 0 for a cavity."""
    triangles, count = surface.triangles, len(surface.vertices_mm)
    graph = coo_matrix((np.ones(len(triangles)), (triangles[:, 0], triangles[:, 1])), shape=(count, count))
    graph = graph + coo_matrix((np.ones(len(triangles)), (triangles[:, 1], triangles[:, 2])), shape=(count, count))
    _, of_vertex = connected_components(graph, directed=False)
    _, piece = np.unique(of_vertex[triangles[:, 0]], return_inverse=True)
    piece = piece.reshape(-1)
    corners = surface.vertices_mm[triangles] - surface.vertices_mm.mean(axis=0)
    six = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return piece.astype(np.int64), np.asarray(np.bincount(piece, six) / 6000.0)


def self_intersections(surface: Surface) -> IndexArray:
    """Return the pairs (P, 2) of triangles of which an edge of one goes through the other, or that lie folded together.

    Source of the test: Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", J. Graphics Tools 1997.
    """
    if not len(surface.triangles):
        return np.zeros((0, 2), np.int64)
    corners = surface.vertices_mm[surface.triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    axis = int(np.ptp(surface.vertices_mm, axis=0).argmax())
    order = np.argsort(low[:, axis], kind="stable")
    found = _intersecting(surface.vertices_mm, surface.triangles[order], low[order], high[order], axis)
    return np.asarray(order[found]) if len(found) else np.zeros((0, 2), np.int64)


@njit(cache=True, nogil=True)
def _pierces(
    p: FloatArray, q: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray
) -> bool:  # pragma: no cover - compiled
    """Return whether the segment pq goes through the triangle abc."""
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    e1x, e1y, e1z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    e2x, e2y, e2z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    hx, hy, hz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
    det = e1x * hx + e1y * hy + e1z * hz
    if abs(det) < 1e-14:
        return False
    sx, sy, sz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    u = (sx * hx + sy * hy + sz * hz) / det
    if u < 0.0 or u > 1.0:
        return False
    gx, gy, gz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    v = (dx * gx + dy * gy + dz * gz) / det
    if v < 0.0 or u + v > 1.0:
        return False
    t = (e2x * gx + e2y * gy + e2z * gz) / det
    return bool(0.0 <= t <= 1.0)


@njit(cache=True, nogil=True)
def _normal(
    vertices: FloatArray, triangle: npt.NDArray[np.int64]
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return a triangle's normal, as long as twice its area."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
    vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True, nogil=True)
def _pair_meets(
    vertices: FloatArray, one: npt.NDArray[np.int64], two: npt.NDArray[np.int64]
) -> bool:  # pragma: no cover - compiled
    """Return whether two triangles go through each other; what they share does not count."""
    shared = 0
    for a in one:
        for b in two:
            if a == b:
                shared += 1
    if shared == 3:
        return True
    if shared == 2:
        # Neighbours: they only meet when the one lies folded upon the other.
        ax, ay, az = _normal(vertices, one)
        bx, by, bz = _normal(vertices, two)
        size = np.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz))
        return bool(size > 0.0 and ax * bx + ay * by + az * bz < _FOLDED * size)
    for side in range(2):
        this, that = (one, two) if side == 0 else (two, one)
        for at in range(3):
            p, q = this[at], this[(at + 1) % 3]
            touches = False
            for each in that:
                if each in (p, q):
                    touches = True
            if not touches and _pierces(
                vertices[p], vertices[q], vertices[that[0]], vertices[that[1]], vertices[that[2]]
            ):
                return True
    return False


@njit(cache=True, nogil=True)
def _intersecting(
    vertices: FloatArray, triangles: IndexArray, low: FloatArray, high: FloatArray, axis: int
) -> IndexArray:  # pragma: no cover - compiled
    """Return the pairs (P, 2) that meet: triangles sorted by `low` along `axis` are swept along it."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    pairs = []
    for i in range(len(triangles)):
        for j in range(i + 1, len(triangles)):
            if low[j, axis] > high[i, axis]:
                break
            if low[j, first] > high[i, first] or high[j, first] < low[i, first]:
                continue
            if low[j, second] > high[i, second] or high[j, second] < low[i, second]:
                continue
            if _pair_meets(vertices, triangles[i], triangles[j]):
                pairs.append((i, j))
    out = np.empty((len(pairs), 2), np.int64)
    for at in range(len(pairs)):
        out[at, 0], out[at, 1] = pairs[at]
    return out
