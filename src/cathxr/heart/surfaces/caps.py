"""Cuts a closed surface along a line into walls and caps: what a catheter passes through is a cap."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from cathxr.core import FloatArray
from cathxr.heart.surface import IndexArray, Surface, edge_keys
from cathxr.heart.surfaces.fields import LevelSet
from cathxr.heart.volume import Grid

CapValue = Callable[[FloatArray], FloatArray]
"""At points (N, 3) mm in `ct`: above zero on a cap."""

_BISECTIONS = 12
_SNAP = 0.2
"""A crossing this near to a vertex, as a share of the edge, moves the vertex there: no slivers along the rim."""
END_VOXELS = 0.25
"""How far from the volume's end, in voxels, the flat end of what it cuts begins."""
_SPECK_MM2 = 4.0
"""A cap (or a wall within a cap) smaller than this is a speck of noise."""


@dataclass(frozen=True, eq=False)
class Divided:
    """A closed surface, and which of its triangles (M,) are caps."""

    surface: Surface
    caps: npt.NDArray[np.bool_]


def cap_value(level_set: LevelSet, grid: Grid) -> CapValue:
    """Return where a structure's surface is a cap: against other blood, and where the volume's end cuts it."""
    first = np.array(level_set.box.first, float)
    sizes = np.array(grid.shape, float)
    at_end = level_set.box.at_end
    field = level_set.cap

    def value(points_mm: FloatArray) -> FloatArray:
        kji = grid.to_voxel(points_mm)[:, ::-1]
        found = ndimage.map_coordinates(field, (kji - first).T, order=1, mode="nearest", output=np.float64)
        for axis in range(3):
            if at_end[axis, 0]:
                found = np.maximum(found, END_VOXELS - 0.5 - kji[:, axis])
            if at_end[axis, 1]:
                found = np.maximum(found, kji[:, axis] - (sizes[axis] - 0.5 - END_VOXELS))
        return np.asarray(found)

    return value


def divided(surface: Surface, value: CapValue) -> Divided:
    """Return the surface cut along the line where `value` is zero, so that no triangle is half wall and half cap."""
    vertices = surface.vertices_mm.copy()
    at_vertex = value(vertices)
    if (at_vertex <= 0.0).all():
        return Divided(surface, np.zeros(len(surface.triangles), bool))
    edges = _edges(surface.triangles)
    crossing = edges[(at_vertex[edges[:, 0]] > 0.0) != (at_vertex[edges[:, 1]] > 0.0)]
    share = _crossings(vertices, crossing, at_vertex, value)
    sign = np.where(at_vertex > 0.0, 1, -1)
    _snap(vertices, sign, crossing, share)
    split = sign[crossing[:, 0]] * sign[crossing[:, 1]] < 0
    crossing, share = crossing[split], share[split]
    # A snapped vertex has moved, but the crossings of edges that are still split have not.
    start = surface.vertices_mm[crossing[:, 0]]
    new = start + share[:, None] * (surface.vertices_mm[crossing[:, 1]] - start)
    triangles, caps = _split(surface.triangles, sign, crossing, len(vertices))
    undecided = caps == 0
    everything = np.concatenate([vertices, new])
    if undecided.any():
        middle = everything[triangles[undecided]].mean(axis=1)
        caps[undecided] = np.where(value(middle) > 0.0, 1, -1)
    kept = Surface(everything, triangles)
    return Divided(kept, _without_specks(kept, caps > 0))


def _edges(triangles: IndexArray) -> IndexArray:
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    first = np.unique(edge_keys(directed), return_index=True)[1]
    return np.asarray(np.sort(directed[first], axis=1))


def _crossings(vertices: FloatArray, edges: IndexArray, at_vertex: FloatArray, value: CapValue) -> FloatArray:
    """Return how far along each edge (E,) the value changes its sign, 0 to 1."""
    low, high = np.zeros(len(edges)), np.ones(len(edges))
    starts_above = at_vertex[edges[:, 0]] > 0.0
    start, way = vertices[edges[:, 0]], vertices[edges[:, 1]] - vertices[edges[:, 0]]
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        same = (value(start + middle[:, None] * way) > 0.0) == starts_above
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray((low + high) / 2.0)


def _snap(vertices: FloatArray, sign: npt.NDArray[np.int64], crossing: IndexArray, share: FloatArray) -> None:
    """Move each vertex that is next to the line onto it, at its nearest crossing."""
    way = np.concatenate([share, 1.0 - share])
    ends = np.concatenate([crossing, crossing[:, ::-1]])
    order = np.argsort(way, kind="stable")
    order = order[way[order] < _SNAP]
    nearest, at = np.unique(ends[order, 0], return_index=True)
    chosen = order[at]
    where = vertices[ends[chosen, 0]] + way[chosen, None] * (vertices[ends[chosen, 1]] - vertices[ends[chosen, 0]])
    vertices[nearest] = where
    sign[nearest] = 0


def _split(
    triangles: IndexArray, sign: npt.NDArray[np.int64], crossing: IndexArray, first_new: int
) -> tuple[IndexArray, npt.NDArray[np.int64]]:
    """Return the triangles with those across the line split, and for each 1 (cap), -1 (wall) or 0 (on the line)."""
    signs = sign[triangles]
    across = (signs.min(axis=1) < 0) & (signs.max(axis=1) > 0)
    whole = triangles[~across]
    side = np.sign(signs[~across].sum(axis=1))
    if not across.any():
        return whole, side
    keys = crossing[:, 0] * first_new + crossing[:, 1]
    order = np.argsort(keys)

    def on(a: IndexArray, b: IndexArray) -> IndexArray:
        key = np.minimum(a, b) * first_new + np.maximum(a, b)
        return np.asarray(first_new + order[np.searchsorted(keys[order], key)])

    pieces, sides = [whole], [side]
    cut, cut_signs = triangles[across], signs[across]
    has_zero = (cut_signs == 0).any(axis=1)
    if has_zero.any():
        a, b, c = _turned(cut[has_zero], (cut_signs[has_zero] == 0).argmax(axis=1))
        middle = on(b, c)
        pieces += [np.stack([a, b, middle], axis=1), np.stack([a, middle, c], axis=1)]
        sides += [sign[b], sign[c]]
    rest, rest_signs = cut[~has_zero], cut_signs[~has_zero]
    if len(rest):
        lone = (rest_signs == -np.sign(rest_signs.sum(axis=1))[:, None]).argmax(axis=1)
        a, b, c = _turned(rest, lone)
        ab, ca = on(a, b), on(a, c)
        pieces += [np.stack(each, axis=1) for each in ((a, ab, ca), (ab, b, c), (ab, c, ca))]
        sides += [sign[a], sign[b], sign[b]]
    return np.concatenate(pieces), np.concatenate(sides)


def _turned(triangles: IndexArray, start: IndexArray) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Return the corners of each triangle from the corner `start` on, in the same sense."""
    rows = np.arange(len(triangles))
    a, b, c = (np.asarray(triangles[rows, (start + step) % 3]) for step in range(3))
    return a, b, c


def _without_specks(surface: Surface, caps: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return the caps with patches of either kind that are too small given to the other."""
    area = np.linalg.norm(surface.area_vectors, axis=1)
    for _ in range(2):
        patch = _patches(surface.triangles, caps)
        small = np.bincount(patch, area)[patch] < _SPECK_MM2
        # A whole small surface is no speck.
        small &= (
            np.bincount(_patches(surface.triangles, np.zeros_like(caps)), area)[
                _patches(surface.triangles, np.zeros_like(caps))
            ]
            > 2.0 * _SPECK_MM2
        )
        if not small.any():
            break
        caps = caps ^ small
    return caps


def _patches(triangles: IndexArray, kind: npt.NDArray[np.bool_]) -> IndexArray:
    """Return the number of the connected patch of one kind that each triangle belongs to."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    owner = np.tile(np.arange(len(triangles)), 3)
    edge = edge_keys(directed)
    order = np.argsort(edge, kind="stable")
    edge, owner = edge[order], owner[order]
    same = (edge[1:] == edge[:-1]) & (kind[owner[1:]] == kind[owner[:-1]])
    one, two = owner[:-1][same], owner[1:][same]
    count = len(triangles)
    graph = coo_matrix((np.ones(len(one), np.int8), (one, two)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
