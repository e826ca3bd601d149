"""Triangle meshes in plain NumPy: whether they are closed, how thick their walls are, what a ray meets first."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray

Faces = NDArray[np.int64]
_CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """vertices (V, 3) mm; faces (F, 3): indices, anticlockwise seen from outside."""

    vertices: FloatArray
    faces: Faces

    @property
    def triangles(self) -> FloatArray:
        """The corners (F, 3, 3)."""
        return self.vertices[self.faces]

    def merged(self, within_mm: float = 1e-4) -> "TriangleMesh":
        """Return the mesh with vertices nearer than this made one, without the triangles that have no area then."""
        rounded = np.round(self.vertices / within_mm).astype(np.int64)
        _, first, inverse = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        faces = inverse.reshape(-1)[self.faces]
        proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        return TriangleMesh(self.vertices[first], faces[proper])

    def open_edges(self) -> int:
        """Return how many edges do not have exactly one other triangle on their other side; 0: watertight."""
        edges = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        code = edges[:, 0] * np.int64(len(self.vertices)) + edges[:, 1]
        back = edges[:, 1] * np.int64(len(self.vertices)) + edges[:, 0]
        unique, counts = np.unique(code, return_counts=True)
        return int((counts != 1).sum() + (~np.isin(back, unique)).sum())

    def volume_mm3(self) -> float:
        """Return the volume inside."""
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)

    def moved(self, columns: FloatArray, origin: FloatArray) -> "TriangleMesh":
        """Return the mesh with its axes turned to `columns` (3, 3) and its origin at `origin` (3,)."""
        return TriangleMesh(self.vertices @ columns.T + origin, self.faces)


def first_hits(origins: FloatArray, directions: FloatArray, triangles: FloatArray) -> tuple[FloatArray, Faces]:
    """Return where rays (N, 3) first meet triangles (F, 3, 3), after Möller and Trumbore (1997).

    Distances (N,) are in lengths of the direction, inf for none; which triangle (N,) is -1 for none.
    """
    distances, which = np.full(len(origins), np.inf), np.full(len(origins), -1, dtype=np.int64)
    if len(triangles) == 0:
        return distances, which
    step = max(1, _CHUNK // len(triangles))
    for start in range(0, len(origins), step):
        part = slice(start, start + step)
        found = _distances(origins[part], directions[part], triangles)
        best = found.argmin(axis=1)
        near = found[np.arange(len(best)), best]
        distances[part] = near
        which[part] = np.where(np.isfinite(near), best, -1)
    return distances, which


def _distances(origins: FloatArray, directions: FloatArray, triangles: FloatArray) -> FloatArray:
    a, first, second = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(first, second)
    # With s = origin - a: u, v and t are triple products, all of which are products of matrices.
    base = -directions @ normal.T
    across = np.cross(origins, directions)  # (o - a) x d = o x d - a x d
    ad_first = directions @ np.cross(first, a).T
    ad_second = directions @ np.cross(second, a).T
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (across @ second.T - ad_second) / base
        v = (ad_first - across @ first.T) / base
        t = (origins @ normal.T - (a * normal).sum(axis=1)) / base
        good = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t > 1e-9) & (np.abs(base) > 1e-12)
    return np.where(good, t, np.inf)


def wall_mm(mesh: TriangleMesh, *, samples: int = 400, seed: int = 0) -> float:
    """Return the thinnest wall found from so many places on the surface, straight into the body.

    Rays that meet the other side at a slant (an edge, a corner) are not walls and do not count.
    """
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(areas, 1e-12)[:, None]
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(triangles), size=samples, p=areas / areas.sum())
    share = rng.dirichlet(np.ones(3), size=samples)
    places = np.einsum("ni,nij->nj", share, triangles[chosen])
    distances, met = first_hits(places - 1e-5 * normals[chosen], -normals[chosen], triangles)
    facing = (met >= 0) & ((normals[chosen] * normals[met]).sum(axis=1) < -0.8)
    return float(distances[facing].min()) if facing.any() else float("inf")
