"""Where one region of voxels faces another: patches of voxel faces with centre, normal and area.

A patch's area and normal come from the sum of its faces' area vectors. For a flat patch that sum is exact at any
inclination: the stairs of the voxels cancel, where counting faces makes an oblique patch up to 1.7 times too large.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.away import away_from
from cathxr.heart.boxes import Box, Mask, box_around
from cathxr.heart.volume import Grid, LabelVolume

_EVERY_NEIGHBOUR = np.ones((3, 3, 3), dtype=bool)
_ROUNDED_MM = 1e-3
_TRIMS = 2
_TRIM_RADII = 1.6
"""Faces farther from the centre than this many radii of the circle of equal area are a tail, not the opening."""


@dataclass(frozen=True, eq=False)
class Patch:
    """A connected patch of voxel faces.

    centroid_mm (3,) mm in `ct`; normal (3,) unit, out of the inner region; area_mm2: projected along the normal.
    flatness: 1 for a plane, down to 0 for a closed or crumpled patch.
    """

    centroid_mm: FloatArray
    normal: FloatArray
    area_mm2: float
    flatness: float

    @property
    def diameter_mm(self) -> float:
        """Diameter of the circle of equal area."""
        return float(np.sqrt(4.0 * self.area_mm2 / np.pi))


def boxes_of(labels: LabelVolume, margin: int = 0) -> dict[str, Box]:
    """Return the box around each structure that is there, by key, see `box_around`."""
    found: dict[str, list[Box]] = {}
    for value, box in enumerate(ndimage.find_objects(labels.labels, 255), start=1):
        if box is not None:
            found.setdefault(labels.names[value], []).append(box)
    boxes: dict[str, Box] = {}
    for key, several in found.items():
        spans = [
            slice(max(min(each.start for each in along) - margin, 0), min(max(each.stop for each in along) + margin, n))
            for along, n in zip(zip(*several, strict=True), labels.grid.shape, strict=True)
        ]
        boxes[key] = (spans[0], spans[1], spans[2])
    return boxes


def common_box(first: Mask, second: Mask, grid: Grid, reach_mm: float) -> Box | None:
    """Return the box where two masks come within `reach_mm` of each other, with as much margin; None where nowhere."""
    spans = []
    here, there = box_around(first), box_around(second)
    if here is None or there is None:
        return None
    for axis, (one, other) in enumerate(zip(here, there, strict=True)):
        margin = int(np.ceil(reach_mm / grid.spacing_mm[2 - axis])) + 1
        low = max(one.start, other.start) - margin
        high = min(one.stop, other.stop) + margin
        if low >= high:
            return None
        spans.append(slice(max(low, 0), min(high, grid.shape[axis])))
    return spans[0], spans[1], spans[2]


def cropped(grid: Grid, box: Box) -> Grid:
    """Return the part of the grid that the box cuts out."""
    matrix = grid.ct_from_voxel.copy()
    matrix[:3, 3] = grid.to_ct([box[2].start, box[1].start, box[0].start])
    return Grid((box[0].stop - box[0].start, box[1].stop - box[1].start, box[2].stop - box[2].start), matrix)


def facing_patches(inner: Mask, outer: Mask, grid: Grid, *, least_mm2: float = 0.0) -> list[Patch]:
    """Return the patches where `inner` (K, J, I) touches `outer` (K, J, I), largest first.

    Raises:
        ValueError: the masks are not of the grid's shape.
    """
    if inner.shape != grid.shape or outer.shape != grid.shape:
        raise ValueError(f"masks: expected the grid's shape {grid.shape}, got {inner.shape} and {outer.shape}")
    box = common_box(inner, outer, grid, 0.0)
    if box is None:
        return []
    grid = cropped(grid, box)
    found = list(_faces(inner[box], outer[box]))
    cells = np.concatenate([each for _, _, each in found])
    if not len(cells):
        return []
    groups = _grouped(cells)
    positions, vectors = _placed(found, grid)
    axes = grid.ct_from_voxel[:3, :3] / grid.spacing_mm
    patches = []
    order = np.argsort(groups, kind="stable")
    for index in np.split(order, np.flatnonzero(np.diff(groups[order])) + 1):
        patch = _trimmed(positions[index], vectors[index], axes)
        if patch is not None and patch.area_mm2 > least_mm2:
            patches.append(patch)
    return sorted(patches, key=lambda each: -each.area_mm2)


def bridged(inner: Mask, outer: Mask, free: Mask, grid: Grid, *, reach_mm: float, slack_mm: float) -> tuple[Mask, Mask]:
    """Return both masks grown through `free` voxels until they meet, where the gap is not much wider than it need be.

    The gap at a voxel is the sum of its distances to both masks. It may be `slack_mm` wider than the narrowest gap (its
    5th percentile, so that a single spot does not decide), and at most `reach_mm`.
    """
    spacing = grid.spacing_mm[::-1]
    to_inner, to_outer = away_from(inner, spacing), away_from(outer, spacing)
    gap = to_inner + to_outer - float(spacing.mean())  # between the voxels' faces, not their centres
    # Many gaps are the same sum of steps: what is rounded must not decide about all of them at once.
    band = free & (gap <= reach_mm + _ROUNDED_MM)
    if not band.any():
        return inner, outer
    band &= gap <= float(np.percentile(gap[band], 5.0)) + slack_mm + _ROUNDED_MM
    nearer = to_inner <= to_outer
    return inner | (band & nearer), outer | (band & ~nearer)


def coverage(mask: Mask, cover: Mask) -> float:
    """Return which share (0 to 1) of a mask's voxel faces looks at `cover`; 0 for an empty mask."""
    faces = _face_count(mask, ~mask)
    return _face_count(mask, cover) / faces if faces else 0.0


def boundary_patches(mask: Mask, grid: Grid, *, least_mm2: float = 0.0) -> list[Patch]:
    """Return the patches of `mask` (K, J, I) that lie on the volume's own boundary, largest first.

    Each side counts for itself: a vessel that is cut at an edge has two flat cuts, not a bent one.
    """
    patches = []
    for axis in range(3):
        for at in (0, mask.shape[axis] - 1):
            only = [slice(None)] * 3
            only[axis] = slice(at, at + 1)
            layer = mask[tuple(only)]
            if not layer.any():
                continue
            # The layer and one beyond it, which is all outside.
            pad = [(0, 0)] * 3
            pad[axis] = (1, 0) if at == 0 else (0, 1)
            first = np.zeros(3)
            first[2 - axis] = at - 1 if at == 0 else at
            matrix = grid.ct_from_voxel.copy()
            matrix[:3, 3] = grid.to_ct(first)
            inner = np.pad(layer, pad)
            beyond = ~np.pad(np.ones(layer.shape, dtype=bool), pad)
            side = Grid((inner.shape[0], inner.shape[1], inner.shape[2]), matrix)
            patches += facing_patches(inner, beyond, side, least_mm2=least_mm2)
    return sorted(patches, key=lambda each: -each.area_mm2)


def where(mask: Mask) -> npt.NDArray[np.intp]:
    """Return the places (N, 3) k, j, i of a mask; many times faster than numpy.argwhere on mostly empty masks."""
    return np.stack(np.unravel_index(np.flatnonzero(mask), mask.shape), axis=1)


def _face_count(inner: Mask, outer: Mask) -> int:
    """Return how many voxel faces lie between two masks."""
    total = 0
    for axis in range(3):
        first, second = np.swapaxes(inner, 0, axis), np.swapaxes(outer, 0, axis)
        total += int(np.count_nonzero(first[:-1] & second[1:])) + int(np.count_nonzero(first[1:] & second[:-1]))
    return total


def _faces(inner: Mask, outer: Mask) -> Iterator[tuple[int, int, npt.NDArray[np.intp]]]:
    """Yield axis, step (1 or -1) and the inner voxels (N, 3) k, j, i that have an outer one that way."""
    for axis in range(3):
        low: list[slice] = [slice(None)] * 3
        high: list[slice] = [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        first, second = tuple(low), tuple(high)
        yield axis, 1, where(inner[first] & outer[second])
        cells = where(inner[second] & outer[first])
        cells[:, axis] += 1
        yield axis, -1, cells


def _grouped(cells: npt.NDArray[np.intp]) -> npt.NDArray[np.int64]:
    """Return a group number (N,) for each cell (N, 3): neighbours, by corners too, share one."""
    low = cells.min(axis=0)
    local = cells - low
    marks = np.zeros(local.max(axis=0) + 1, dtype=bool)
    marks[tuple(local.T)] = True
    labelled, _ = ndimage.label(marks, structure=_EVERY_NEIGHBOUR)
    return np.asarray(labelled[tuple(local.T)], dtype=np.int64)


def _placed(found: list[tuple[int, int, npt.NDArray[np.intp]]], grid: Grid) -> tuple[FloatArray, FloatArray]:
    """Return the faces' centres (N, 3) mm in `ct` and their area vectors (N, 3) mm² along the grid's axes i, j, k."""
    positions, vectors = [], []
    for axis, step, cells in found:
        column = 2 - axis
        ijk = cells[:, ::-1].astype(np.float64)
        ijk[:, column] += 0.5 * step
        positions.append(grid.to_ct(ijk))
        vector = np.zeros(3)
        vector[column] = step * np.delete(grid.spacing_mm, column).prod()
        vectors.append(np.tile(vector, (len(cells), 1)))
    return np.concatenate(positions), np.concatenate(vectors)


def _trimmed(positions: FloatArray, vectors: FloatArray, axes: FloatArray) -> Patch | None:
    """Return the patch of the faces, without its tails; None where the faces cancel."""
    for _ in range(_TRIMS):
        patch = _patch(positions, vectors, axes)
        if patch is None:
            return None
        away = np.linalg.norm(positions - patch.centroid_mm, axis=1)
        near = away <= _TRIM_RADII * patch.diameter_mm / 2.0 + 1.0
        positions, vectors = positions[near], vectors[near]
    return _patch(positions, vectors, axes)


def _patch(positions: FloatArray, vectors: FloatArray, axes: FloatArray) -> Patch | None:
    """Return the patch of the faces, None where their area vectors cancel. axes (3, 3): i, j, k in `ct` as columns."""
    total = vectors.sum(axis=0)
    area, faces = float(np.linalg.norm(total)), float(np.abs(vectors).sum())
    if area <= 1e-6 * faces:
        return None
    # Faces that look backwards belong to the stairs' roughness: they take away from the area, not from the centre.
    weights = np.maximum(vectors @ total, 0.0)
    centroid = (positions * weights[:, None]).sum(axis=0) / weights.sum()
    return Patch(centroid, axes @ (total / area), area, float(np.abs(total).sum()) / faces)
