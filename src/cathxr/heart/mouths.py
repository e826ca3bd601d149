"""Where vessels leave a chamber that includes them, or whose wall has holes: tubes, and places the wall leaves bare."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.away import Float32, away_from
from cathxr.heart.boxes import Box, Mask, box_around
from cathxr.heart.facing import Patch, coverage, cropped, facing_patches, where
from cathxr.heart.volume import Grid

_STEP_MM = 1.0
"""Tubes are sought on a grid about this fine; finer ones are thinned out."""
_CORE_SHARE = 0.65
_CORE_MM = (5.0, 11.0)
"""The ball that must fit into the chamber's body but not into a vessel: this share of the largest, within bounds."""
_LEAST_LENGTH_MM = 7.0
_LEAST_ML = 0.25
_SLAB_MM = 1.5
_SLABS = 16
_SPAN = 5
"""The direction is that from this many slabs back to the end."""
_FEWEST_POINTS = 4
_EVERY_NEIGHBOUR = np.ones((3, 3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class Mouth:
    """Where a vessel leaves. end: where the chamber's own voxels stop. junction: where the vessel leaves the body.

    junction is None where it is not known. length_mm: from the junction to the end; 0 for a hole in the wall.
    """

    end: Patch
    junction: Patch | None = None
    length_mm: float = 0.0


def tubes(chamber: Mask, grid: Grid) -> list[Mouth]:
    """Return the tubes that stick out of the chamber (K, J, I), longest first.

    The chamber's body is what a ball of about two thirds of its largest inscribed one can reach (an opening, in the
    sense of morphology); what is left over and is long enough is a vessel or an appendage.
    """
    chamber, grid = _thinned(chamber, grid)
    box = box_around(chamber, 2)
    if box is None:
        return []
    # Closed, because contrast that is not yet mixed leaves holes in a label, which would pass for the chamber's end.
    chamber, grid = np.pad(ndimage.binary_closing(chamber[box]), 1), _padded(cropped(grid, box))
    spacing = grid.spacing_mm[::-1]
    depth = away_from(~chamber, spacing)
    radius = float(np.clip(_CORE_SHARE * depth.max(), *_CORE_MM))
    seeds = depth >= radius
    if not seeds.any():
        return []
    # A ball's worth more than the radius, so that the steps of the grid leave no rind.
    body = chamber & (away_from(seeds, spacing) <= radius + spacing.max())
    parts, count = ndimage.label(chamber & ~body, structure=_EVERY_NEIGHBOUR)
    away = away_from(body, spacing)
    found = []
    for number, span in enumerate(ndimage.find_objects(parts, count), start=1):
        mouth = _tube(parts == number, body, away, grid, span)
        if mouth is not None:
            found.append(mouth)
    return sorted(found, key=lambda each: -each.length_mm)


def bare_patches(chamber: Mask, covered: Mask, grid: Grid, *, least_mm2: float, least_cover: float) -> list[Patch]:
    """Return where the chamber's surface is bare of `covered` voxels (wall, other blood): its mouths, largest first.

    Nothing is returned where less than `least_cover` (0 to 1) of the surface is covered: the wall is not known then.
    """
    box = box_around(chamber | covered, 1)
    if box is None:
        return []
    grid, chamber, covered = cropped(grid, box), chamber[box], covered[box]
    bare = facing_patches(chamber, ~(chamber | covered), grid)
    if coverage(chamber, covered) < least_cover:
        return []
    return [each for each in bare if each.area_mm2 >= least_mm2]


def _tube(part: Mask, body: Mask, away: Float32, grid: Grid, span: Box) -> Mouth | None:
    """Return the mouth of one part that sticks out of the body; None where it is no tube. span: the part's box."""
    wide: Box = tuple(  # type: ignore[assignment]  # a tuple of three, which tuple() does not know
        slice(max(each.start - 1, 0), each.stop + 1) for each in span
    )
    part, body, away, grid = part[wide], body[wide], away[wide], cropped(grid, wide)
    length = float(away[part].max())
    if length < _LEAST_LENGTH_MM or np.count_nonzero(part) * grid.voxel_ml < _LEAST_ML:
        return None
    junctions = facing_patches(body, part, grid)
    if not junctions:
        return None
    points = grid.to_ct(where(part)[:, ::-1])
    end = _far_end(points, away[part], junctions[0], grid)
    return None if end is None else Mouth(end, junctions[0], length)


def _far_end(points: FloatArray, away: Float32, junction: Patch, grid: Grid) -> Patch | None:
    """Return the tube's far end: where its cross-section, from the tip, first is half of what it is near there.

    Labels often end in a ragged tail, thinner than the vessel; that is passed over. None where the tube is too short.
    """
    tip = points[away >= away.max() - 2.0].mean(axis=0)
    direction = _unit(tip - junction.centroid_mm)
    last, slabs = _slabs(points, tip, direction, grid)
    for _ in range(2):
        counts = [len(each) for each in slabs if len(each)]
        full = [each for each in slabs if len(each) >= max(_FEWEST_POINTS, 0.6 * float(np.median(counts)))]
        if len(full) < 2:
            return None
        direction = _unit(full[0].mean(axis=0) - full[min(_SPAN, len(full) - 1)].mean(axis=0))
        last, slabs = _slabs(points, tip, direction, grid)
    areas = np.array([len(each) for each in slabs]) * grid.voxel_ml * 1000.0 / _SLAB_MM
    usual = float(np.median(areas[areas > 0.0]))
    first = int(np.argmax(areas >= 0.5 * usual))
    # The widest of it and the next two: a rounded or oblique end makes the first look narrow.
    chosen = first + int(np.argmax(areas[first : first + 3]))
    middle = slabs[chosen].mean(axis=0)
    height = last - first * _SLAB_MM
    centre = middle + direction * (height - float((middle - tip) @ direction))
    return Patch(centre, direction, float(areas[chosen]), 1.0)


def _slabs(points: FloatArray, tip: FloatArray, direction: FloatArray, grid: Grid) -> tuple[float, list[FloatArray]]:
    """Return how far along `direction` the points reach beyond the tip, and the points of each slab from there back."""
    along = (points - tip) @ direction
    last = float(along.max()) + float(np.abs(direction @ grid.ct_from_voxel[:3, :3]).max()) / 2.0
    depth = last - along
    return last, [points[(depth >= at) & (depth < at + _SLAB_MM)] for at in np.arange(_SLABS) * _SLAB_MM]


def _thinned(mask: Mask, grid: Grid) -> tuple[Mask, Grid]:
    """Return the mask and the grid with every nth voxel along each axis, so that it is about `_STEP_MM` fine."""
    steps = [max(round(_STEP_MM / float(each)), 1) for each in grid.spacing_mm]
    thin = mask[:: steps[2], :: steps[1], :: steps[0]]
    matrix = grid.ct_from_voxel.copy()
    matrix[:3, :3] *= np.array(steps)
    return thin, Grid((thin.shape[0], thin.shape[1], thin.shape[2]), matrix)


def _padded(grid: Grid) -> Grid:
    """Return the grid with one voxel more on every side."""
    matrix = grid.ct_from_voxel.copy()
    matrix[:3, 3] = grid.to_ct([-1.0, -1.0, -1.0])
    return Grid((grid.shape[0] + 2, grid.shape[1] + 2, grid.shape[2] + 2), matrix)


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))
