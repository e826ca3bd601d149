"""The acoustic volume: what the simulated ultrasound needs to know of the tissues, as one small RGBA texture.

R impedance, G scatter amplitude, B attenuation, A how steeply the impedance changes. See docs/acoustic-volume.md.

A label map has stairs. Each pool is therefore smoothed widely, and the smooth field g is turned back into a distance
from the boundary, s = sigma * Phi^-1(g), which is exact for a plane; a profile of the wanted width is made from s. The
edge is as sharp as the texture can hold, and lies where it was, but the stairs are gone.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.special import ndtr, ndtri

from cathxr.core import DataError, FloatArray
from cathxr.heart.acoustic_codes import AcousticVolume, codes_of, encoded
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.boxes import Mask, box_around
from cathxr.heart.facing import boxes_of, coverage, cropped
from cathxr.heart.model import Opening
from cathxr.heart.resample import Float32, sampler
from cathxr.heart.shell import Pool, shell_codes, stub_distance, wall_of
from cathxr.heart.tissues import hu_knots, properties
from cathxr.heart.volume import Grid, LabelVolume, Progress, Volume, silent

MARGIN_MM = 12.0
"""How far the volume goes on beyond the labelled structures: a wall, what is around it, and some lung."""
_EDGE_VOXELS = 0.6
"""Standard deviation of an edge's profile in texture voxels: narrower ones would show the texture's own grid."""
_SMOOTH_LABEL_VOXELS = 1.5
_SMOOTH_TEXTURE_VOXELS = 0.8
_MOST_SMOOTH_MM = 2.2
_TAIL = 1e-4
_COVERED = 0.4
_RIM_MM = 1.0
"""Where this share of a pool's surface has a labelled wall, that is its wall; at bare rims it gets a thin one."""


def acoustic_volume(
    labels: LabelVolume,
    *,
    volume: Volume | None = None,
    openings: Mapping[str, Opening] | None = None,
    size: int = 128,
    progress: Progress = silent,
) -> AcousticVolume:
    """Return the acoustic volume over the labelled structures and a margin, along the labels' axes.

    volume: the CT on the labels' grid; what lies outside the labelled blood is taken from its numbers. Without it,
    walls of usual thickness are put around the pools, then fat, pericardium and lung; vessels whose `openings`
    (optional) lead out of the heart go on as short tubes. size: voxels along the longest side.

    Raises:
        DataError: nothing is labelled.
        ValueError: the CT is not on the labels' grid, or `size` is not from 16 to 256.
    """
    if not 16 <= size <= 256:
        raise ValueError(f"size: expected 16 to 256, got {size}")
    if volume is not None and (
        volume.grid.shape != labels.grid.shape
        or not np.allclose(volume.grid.ct_from_voxel, labels.grid.ct_from_voxel, atol=1e-3)
    ):
        raise ValueError("volume: expected the labels' grid")
    grid = texture_grid(labels, size)
    step = float(grid.spacing_mm[0])
    edge_mm = _EDGE_VOXELS * step
    progress("Acoustic volume: blood", 0.0)
    pools = _pools(labels, grid)
    if volume is None:
        pools += _stubs(openings or {}, labels, grid)
    blood = _united(pools, grid, edge_mm)
    progress("Acoustic volume: tissue", 0.5)
    if volume is None:
        around = shell_codes(pools, _wall(labels, grid), grid, edge_mm=edge_mm)
    else:
        around = _ct_codes(labels, volume, grid)
    progress("Acoustic volume: interfaces", 0.9)
    inside = codes_of(properties(["blood"]))[0].astype(np.float32)
    fields = [around[at] + blood * (inside[at] - around[at]) for at in range(4)]
    return encoded(fields, grid)


def texture_grid(labels: LabelVolume, size: int) -> Grid:
    """Return the texture's grid: cubic voxels along the labels' axes, `size` of them along the longest side.

    Raises:
        DataError: nothing is labelled.
    """
    box = box_around(labels.labels)
    if box is None:
        raise DataError("The label volume is empty, so that there is nothing to make an acoustic volume of.")
    source = labels.grid
    low = np.array([box[2].start, box[1].start, box[0].start]) - 0.5
    high = np.array([box[2].stop, box[1].stop, box[0].stop]) - 0.5
    extent = (high - low) * source.spacing_mm + 2.0 * MARGIN_MM
    step = float(extent.max()) / size
    counts = np.ceil(extent / step - 1e-6).astype(int)
    middle = source.to_ct((low + high) / 2.0)
    axes = source.ct_from_voxel[:3, :3] / source.spacing_mm
    matrix = np.eye(4)
    matrix[:3, :3] = axes * step
    matrix[:3, 3] = middle - matrix[:3, :3] @ ((counts - 1) / 2.0)
    return Grid((int(counts[2]), int(counts[1]), int(counts[0])), matrix)


def _distance(mask: Mask, source: Grid, target: Grid) -> Float32:
    """Return the distance (K', J', I') mm from a mask's smoothed boundary, inside positive, as far as ±3 sigma."""
    sigma = _sigma(source, target)
    smooth = sampler(source, target, sigma_mm=sigma)(mask)
    return np.asarray(sigma * ndtri(np.clip(smooth, _TAIL, 1.0 - _TAIL)), dtype=np.float32)


def _sigma(source: Grid, target: Grid) -> float:
    """Return how widely labels are smoothed, mm: their stairs' width, and what the texture can hold."""
    wide = max(_SMOOTH_LABEL_VOXELS * source.spacing_mm.max(), _SMOOTH_TEXTURE_VOXELS * target.spacing_mm.max())
    return float(min(wide, _MOST_SMOOTH_MM))


def _pools(labels: LabelVolume, grid: Grid) -> list[Pool]:
    """Return every labelled pool of blood as a distance field on the texture's grid."""
    pools = []
    margin = int(np.ceil(4.0 * _sigma(labels.grid, grid) / labels.grid.spacing_mm.min())) + 1
    boxes = boxes_of(labels, margin)
    muscle = [value for value, key in labels.names.items() if key == "myocardium"]
    for key in sorted(boxes):
        anatomy = CATALOGUE.get(key)
        if anatomy is None or anatomy.blood:
            box = boxes[key]
            near = labels.labels[box]
            mask = np.isin(near, [value for value, name in labels.names.items() if name == key])
            wall = wall_of(key)
            if "myocardium" in boxes and coverage(mask, np.isin(near, muscle)) >= _COVERED:
                wall = replace(wall, thickness_mm=_RIM_MM)
            # The box's outermost voxels go on for ever: they are empty, or the volume's own boundary.
            pools.append(Pool(wall, _distance(mask, cropped(labels.grid, box), grid)))
    return pools


def _stubs(openings: Mapping[str, Opening], labels: LabelVolume, grid: Grid) -> list[Pool]:
    """Return the tubes through which blood goes on beyond the openings that lead out of the labelled heart."""
    return [
        Pool(wall_of("pulmonary_veins"), stub_distance(opening, grid))
        for key, opening in sorted(openings.items())
        if leads_out(key, labels)
    ]


def leads_out(key: str, labels: LabelVolume) -> bool:
    """Return whether an opening leads out of what is labelled: a vessel without a label of its own, or a cut one."""
    present = set(labels.names.values())
    if "_end" in key:
        return True
    if "pulmonary_vein" in key:
        return "pulmonary_veins" not in present
    beyond = {"aortic_valve": "aorta", "pulmonary_valve": "pulmonary_artery"}.get(key, key)
    return beyond in ("aorta", "pulmonary_artery", "superior_vena_cava", "inferior_vena_cava") and beyond not in present


def _united(pools: list[Pool], grid: Grid, edge_mm: float) -> Float32:
    """Return the share of blood (K, J, I), 0 to 1. Pools that touch add up to one, without a seam between them."""
    total = np.zeros(grid.shape, dtype=np.float32)
    for pool in pools:
        total += ndtr(pool.distance_mm / edge_mm).astype(np.float32)
    return np.minimum(total, 1.0, out=total)


def _wall(labels: LabelVolume, grid: Grid) -> Float32 | None:
    """Return the labelled myocardium's distance field; None where there is none."""
    mask = labels.mask("myocardium")
    return _distance(mask, labels.grid, grid) if mask.any() else None


def _ct_codes(labels: LabelVolume, volume: Volume, grid: Grid) -> list[Float32]:
    """Return the four fields (K', J', I') of what is not labelled blood, from the CT's numbers.

    Blood's own voxels are left out of the average, so that blood does not lighten the wall beside it.
    """
    near = _near(labels.grid, grid)
    hu, keys, part = volume.hu[near], labels.labels[near], cropped(labels.grid, near)
    blood = np.isin(keys, [label for label, key in labels.names.items() if key != "myocardium"])
    inside = hu[blood]
    median = float(np.median(inside[:: max(len(inside) // 1_000_000, 1)])) if len(inside) else None
    knots, values = hu_knots(median)
    steps = np.arange(-1100, 4200)
    table = codes_of(np.stack([np.interp(steps, knots, values[:, at]) for at in range(3)], axis=1)).astype(np.float32)
    muscle = codes_of(properties(["myocardium"]))[0].astype(np.float32)
    sigma = max(0.6 * float(part.spacing_mm.max()), 0.6 * float(grid.spacing_mm.max()))
    take = sampler(part, grid, sigma_mm=sigma)
    free = np.logical_not(blood, out=blood)
    weight = take(free)
    walls = [label for label, key in labels.names.items() if key == "myocardium"]

    def coded(codes: Float32, of_muscle: np.float32) -> Iterator[Float32]:
        """Yield each slice's codes, 0 in the blood."""
        by_hu = codes[np.clip(np.arange(-32768, 32768), steps[0], steps[-1]) - steps[0]]
        for numbers, structures, outside in zip(hu, keys, free, strict=True):
            plane = np.take(by_hu, numbers.astype(np.int32) + 32768)
            if walls:
                plane[np.isin(structures, walls)] = of_muscle
            plane *= outside
            yield plane

    fields = []
    for at in range(4):
        summed = take.of_slices(coded(table[:, at], muscle[at]))
        fields.append(np.where(weight > 1e-3, summed / np.maximum(weight, 1e-3), muscle[at]).astype(np.float32))
    return fields


def _near(source: Grid, target: Grid) -> tuple[slice, slice, slice]:
    """Return the part of `source` that `target` covers, with a little more."""
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * (np.array(target.shape[::-1]) - 1)
    at: FloatArray = source.to_voxel(target.to_ct(corners))
    low = np.clip(np.floor(at.min(axis=0)).astype(int) - 4, 0, np.array(source.shape[::-1]) - 1)
    high = np.clip(np.ceil(at.max(axis=0)).astype(int) + 5, 1, source.shape[::-1])
    return slice(low[2], high[2]), slice(low[1], high[1]), slice(low[0], high[0])
