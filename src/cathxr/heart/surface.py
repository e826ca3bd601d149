"""Triangle surfaces in NumPy: reading, welding, openings, smoothing without shrinking, normals, volumes.

A surface is vertices (N, 3) mm in `ct` and triangles (M, 3), counter-clockwise seen from outside.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import connected_components

from cathxr.core import DataError, FloatArray

IndexArray = NDArray[np.int64]

_STL_HEADER_BYTES, _STL_RECORD_BYTES = 84, 50
_STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_PASS_BAND = 0.1
"""Taubin's pass-band frequency k: 1/lambda + 1/mu = k (his section 4 recommends 0.01 to 0.1)."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Vertices (N, 3) mm in `ct`, and triangles (M, 3) of indices into them."""

    vertices_mm: FloatArray
    triangles: IndexArray

    @property
    def area_vectors(self) -> FloatArray:
        """Each triangle's outward normal times its area (M, 3), mm²."""
        corners = self.vertices_mm[self.triangles]
        return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0)

    def keep(self, chosen: NDArray[np.bool_]) -> "Surface":
        """Return the surface of the chosen (M,) triangles, without vertices that nothing uses."""
        used, triangles = np.unique(self.triangles[chosen], return_inverse=True)
        return Surface(self.vertices_mm[used], triangles.reshape(-1, 3).astype(np.int64))


def read_stl(path: Path) -> Surface:
    """Return a binary STL file's surface with equal corners welded into one vertex.

    Raises:
        DataError: the file is missing, or is not a complete binary STL file.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror}); give the folder of STL surfaces.") from error
    count = int.from_bytes(data[80:_STL_HEADER_BYTES], "little")
    if count == 0 or len(data) != _STL_HEADER_BYTES + count * _STL_RECORD_BYTES:
        raise DataError(f"{path} is not a complete binary STL file; export it again as binary STL.")
    corners = np.frombuffer(data, dtype=_STL_RECORD, offset=_STL_HEADER_BYTES)["corners"].reshape(-1, 3)
    if not np.isfinite(corners).all():
        raise DataError(f"{path} holds corners that are not finite numbers; export it again.")
    vertices, index = np.unique(corners.astype(np.float64), axis=0, return_inverse=True)
    return Surface(vertices, index.reshape(-1, 3).astype(np.int64))


def enclosed_volume_ml(surface: Surface) -> float:
    """Return the volume in mL that the surface encloses, every opening closed by a fan to its rim's centroid."""
    corners = surface.vertices_mm[surface.triangles]
    edges = rim_edges(surface)
    if len(edges):
        rims = _groups(edges, len(surface.vertices_mm))
        ends = surface.vertices_mm[edges]
        hubs = np.stack([ends[rims == rim].reshape(-1, 3).mean(axis=0) for rim in range(int(rims.max()) + 1)])
        fans = np.stack([ends[:, 1], ends[:, 0], hubs[rims]], axis=1)
        corners = np.concatenate([corners, fans])
    six_volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return float(six_volumes.sum()) / 6000.0


def edge_keys(edges: IndexArray) -> IndexArray:
    """Return a number (E,) for each edge (E, 2), the same for both directions; they sort as (low, high) do."""
    low, high = np.minimum(edges[:, 0], edges[:, 1]), np.maximum(edges[:, 0], edges[:, 1])
    return np.asarray(low * (int(high.max(initial=0)) + 1) + high, dtype=np.int64)


def rim_edges(surface: Surface) -> IndexArray:
    """Return the edges (E, 2) that only one triangle uses, in that triangle's direction."""
    directed = _directed_edges(surface.triangles)
    _, inverse, counts = np.unique(edge_keys(directed), return_inverse=True, return_counts=True)
    return np.asarray(directed[counts[inverse.reshape(-1)] == 1], dtype=np.int64)


def open_at(surface: Surface, centroid_mm: FloatArray, tolerance_mm: float = 0.1) -> tuple[Surface, FloatArray]:
    """Return the surface without the fan of triangles that closes it at `centroid_mm`, and the fan's outward normal.

    Raises:
        DataError: no vertex lies within `tolerance_mm` of the centroid.
    """
    distance = np.linalg.norm(surface.vertices_mm - centroid_mm, axis=1)
    hub = int(distance.argmin())
    if distance[hub] > tolerance_mm:
        raise DataError(
            f"No vertex closes the opening at {np.round(centroid_mm, 2).tolist()} mm (the nearest is "
            f"{distance[hub]:.2f} mm away); give the surface that the opening belongs to."
        )
    fan = (surface.triangles == hub).any(axis=1)
    normal = surface.area_vectors[fan].sum(axis=0)
    return surface.keep(~fan), np.asarray(normal / np.linalg.norm(normal))


def largest_component(surface: Surface) -> Surface:
    """Return the connected part with the most vertices."""
    labels = _groups(_directed_edges(surface.triangles), len(surface.vertices_mm), per_vertex=True)
    biggest = int(np.bincount(labels).argmax())
    return surface.keep(labels[surface.triangles[:, 0]] == biggest)


def smoothed(surface: Surface, rounds: int) -> Surface:
    """Return the surface smoothed by `rounds` of Taubin's shrink-free filter; rims are smoothed along themselves only.

    Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995.
    """
    forward = 0.5
    backward = 1.0 / (_PASS_BAND - 1.0 / forward)
    step = _average_of_neighbours(surface)
    vertices = surface.vertices_mm
    for _ in range(rounds):
        for weight in (forward, backward):
            vertices = vertices + weight * (step @ vertices - vertices)
    return Surface(np.asarray(vertices), surface.triangles)


def vertex_normals(surface: Surface) -> FloatArray:
    """Return outward unit normals (N, 3): each triangle's, weighted by its angle at the vertex.

    Thürmer and Wüthrich, "Computing vertex normals from polygonal facets", J. Graphics Tools 1998.
    """
    return _unit(_summed_normals(np.asarray(surface.vertices_mm, np.float64), surface.triangles))


@njit(cache=True, nogil=True)
def _summed_normals(vertices: FloatArray, triangles: IndexArray) -> FloatArray:  # pragma: no cover - compiled
    """Return at each vertex (N, 3) the sum of its triangles' unit normals times their angles there."""
    normals = np.zeros_like(vertices)
    for index in range(len(triangles)):
        for at in range(3):
            here, after, before = (
                triangles[index, at], triangles[index, (at + 1) % 3], triangles[index, (at + 2) % 3],
            )  # fmt: skip
            ux, uy, uz = (
                vertices[after, 0] - vertices[here, 0],
                vertices[after, 1] - vertices[here, 1],
                vertices[after, 2] - vertices[here, 2],
            )
            vx, vy, vz = (
                vertices[before, 0] - vertices[here, 0],
                vertices[before, 1] - vertices[here, 1],
                vertices[before, 2] - vertices[here, 2],
            )
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            area = np.sqrt(nx * nx + ny * ny + nz * nz)
            if area > 1e-12:
                share = np.arctan2(area, ux * vx + uy * vy + uz * vz) / area
                normals[here, 0] += nx * share
                normals[here, 1] += ny * share
                normals[here, 2] += nz * share
    return normals


def _directed_edges(triangles: IndexArray) -> IndexArray:
    """Return the triangles' edges (3 M, 2) in their winding direction."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _groups(edges: IndexArray, count: int, per_vertex: bool = False) -> IndexArray:
    """Return a group number for each edge (or each vertex): those that edges join share one, counted from 0."""
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    _, labels = connected_components(graph, directed=False)
    if per_vertex:
        return np.asarray(labels, dtype=np.int64)
    _, numbers = np.unique(labels[edges[:, 0]], return_inverse=True)
    return numbers.reshape(-1).astype(np.int64)


def _average_of_neighbours(surface: Surface) -> csr_matrix:
    """Return the sparse (N, N) matrix that averages each vertex's neighbours; a rim vertex has only its rim's."""
    count = len(surface.vertices_mm)
    edges = _directed_edges(surface.triangles)
    rim = rim_edges(surface)
    on_rim = np.zeros(count, dtype=bool)
    on_rim[rim] = True
    both = np.concatenate([edges, edges[:, ::-1]])
    both = np.concatenate([both[~on_rim[both[:, 0]]], rim, rim[:, ::-1]])
    both = np.unique(both, axis=0)
    graph = coo_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(count, count)).tocsr()
    degree = np.asarray(graph.sum(axis=1)).reshape(-1)
    return csr_matrix(diags(1.0 / np.maximum(degree, 1.0)) @ graph)


def _unit(vectors: FloatArray) -> FloatArray:
    """Return the vectors (..., 3) at length one; a zero vector stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))
