"""Repairs what decimation and cutting may leave: a few triangles that go through each other, and crumbs."""

import numpy as np
from scipy.sparse import coo_matrix, diags

from cathxr.heart.surface import Surface, vertex_normals
from cathxr.heart.surfaces.checks import piece_volumes, self_intersections

_ROUNDS, _PATIENCE = 12, 3
_LIMIT_VOXELS = 0.4


def without_crumbs(surface: Surface, *, share: float = 0.02, least_ml: float = 0.05) -> tuple[Surface, float]:
    """Return the surface without its smallest pieces and cavities, and how many mL these were together.

    A piece is a crumb when it is under `least_ml`, or under `share` of the largest one where that is less.
    """
    piece, volumes = piece_volumes(surface)
    size = np.abs(volumes)
    crumb = size < min(least_ml, share * float(size.max()))
    if not crumb.any():
        return surface, 0.0
    return surface.keep(~crumb[piece]), float(size[crumb].sum())


def untangled(surface: Surface) -> Surface:
    """Return the surface with the vertices of triangles that go through each other moved to their neighbours' middle.

    What stays tangled after some rounds stays: the checks count it.
    """
    if not len(pairs := self_intersections(surface)):
        return surface
    triangles, vertices, count = surface.triangles, surface.vertices_mm.copy(), len(surface.vertices_mm)
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    graph = coo_matrix((np.ones(len(directed)), (directed[:, 0], directed[:, 1])), shape=(count, count)).tocsr()
    graph = graph + graph.T
    average = diags(1.0 / np.maximum(np.asarray(graph.sum(axis=1)).reshape(-1), 1.0)) @ graph
    fewest, best, patience = len(pairs), surface, _PATIENCE
    for step in range(_ROUNDS):
        moved = np.zeros(count, bool)
        moved[triangles[pairs.reshape(-1)].reshape(-1)] = True
        # Each second round also moves one more ring of neighbours.
        for _ in range(step // 2):
            moved |= np.asarray(graph @ moved.astype(float)) > 0.0
        vertices[moved] += 0.5 * ((average @ vertices)[moved] - vertices[moved])
        now = Surface(vertices.copy(), triangles)
        pairs = self_intersections(now)
        patience -= 1
        if len(pairs) < fewest:
            fewest, best, patience = len(pairs), now, _PATIENCE
        if not fewest or not patience:
            break
    return best


def at_volume(surface: Surface, volume_ml: float, voxel_mm: float) -> Surface:
    """Return the surface moved along its normals by the same small way everywhere so that it encloses `volume_ml`.

    voxel_mm: the mean spacing; the surface is moved by 0.4 of it at most.
    """
    area = float(np.linalg.norm(surface.area_vectors, axis=1).sum())
    missing = 1000.0 * (volume_ml - float(piece_volumes(surface)[1].sum()))
    limit = _LIMIT_VOXELS * voxel_mm
    way = float(np.clip(missing / max(area, 1e-9), -limit, limit))
    return Surface(surface.vertices_mm + way * vertex_normals(surface), surface.triangles)
