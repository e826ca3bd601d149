"""Segmentation of a contrast CT: from the volume to the labels of the chambers and great vessels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import DataError, FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.seeds import Seed
from cathxr.heart.segmentation.atlas import CHAMBERS, STRUCTURES, Atlas, load_atlas
from cathxr.heart.segmentation.boundary import Levels, best_two, labelled, local_blood, metal, share_of_blood
from cathxr.heart.segmentation.contrast import Thresholds, thresholds
from cathxr.heart.segmentation.corrections import SEED_MM, corrected, takes_a_piece
from cathxr.heart.segmentation.distances import distance_within, nearest_in
from cathxr.heart.segmentation.findings import judged
from cathxr.heart.segmentation.fit import Fit, fit_atlas, looked_up
from cathxr.heart.segmentation.images import ball, box_of, cropped, resampled, to_image, upright
from cathxr.heart.segmentation.partition import Pinned, beliefs, flooded, largest_pieces, pulls, rival, spread, walks
from cathxr.heart.segmentation.tidy import obeyed, tidied
from cathxr.heart.segmentation.vessels import GROUPS, SPRING_FROM, SPRINGS, grouped, outflows, split
from cathxr.heart.volume import Grid, LabelVolume, Progress, Volume, silent

_SEARCH_MM, _WORK_MM = 2.0, 1.5
_REACH_MM = 35.0
"""How far from the atlas's chambers vessels are followed."""
_BEHIND_MM, _THICK_MM = 6.0, 5.0
_VESSEL_RADIUS_MM = 3.5
_SEED_REACH_MM = 14.0
_NODE_SHARE = 0.35
_SEED_BOX_MM = np.array([[-9.0], [9.0]])


@dataclass(frozen=True, eq=False)
class Segmentation:
    """labels: on the volume's own grid. findings: sentences on what could not be told, and what to do about it."""

    labels: LabelVolume
    findings: tuple[str, ...]
    thresholds: Thresholds


@dataclass(frozen=True, eq=False)
class _Partition:
    """probabilities (G + 1, K, J, I) of each group and of none on `grid`; the levels of blood and tissue there.

    inner (K, J, I): the label of what each group holds: an atrium or one of its veins; 0 outside the blood.
    """

    probabilities: npt.NDArray[np.float32]
    inner: npt.NDArray[np.uint8]
    grid: Grid
    levels: Levels


def segment(volume: Volume, *, seeds: Sequence[Seed] = (), progress: Progress = silent) -> Segmentation:
    """Return the volume's heart in parts: chambers and great vessels, or what could not be separated as one.

    Raises:
        DataError: the volume shows no contrast-filled heart, or a seed lies outside it.
    """
    _check(volume, seeds)
    progress("Looking at the scan's contrast", 0.0)
    coarse, coarse_grid = upright(volume.hu, volume.grid, _SEARCH_MM)
    levels = thresholds(coarse, coarse_grid)
    progress("Looking for the heart", 0.1)
    atlas = load_atlas()
    blood = np.clip((coarse - levels.tissue_hu) / (levels.blood_hu - levels.tissue_hu), 0.0, 1.0).astype(np.float32)
    fit = fit_atlas(atlas, blood, coarse_grid, _pairs(atlas, seeds))
    del coarse, blood
    progress("Telling the chambers apart", 0.35)
    part = _partition(volume, atlas, fit, levels, seeds)
    progress("Drawing the boundaries", 0.6)
    labels = _drawn(volume, part, levels, seeds)
    progress("Checking what was found", 0.9)
    return _judged(volume, labels, fit, levels, [seed.structure for seed in seeds])


def _check(volume: Volume, seeds: Sequence[Seed]) -> None:
    """Refuse seeds outside the volume, and volumes too small to hold a heart."""
    extent = np.asarray(volume.grid.shape[::-1]) * volume.grid.spacing_mm
    if min(extent) < 40.0:
        raise DataError(
            f"The volume is {extent[0]:.0f} x {extent[1]:.0f} x {extent[2]:.0f} mm: too small to hold a heart; "
            "give a series that covers the whole heart."
        )
    for seed in seeds:
        voxel = volume.grid.to_voxel(seed.position_mm)
        if (voxel < -0.5).any() or (voxel > np.asarray(volume.grid.shape[::-1]) - 0.5).any():
            where = ", ".join(f"{value:.1f}" for value in seed.position_mm)
            raise DataError(
                f"The seed of {seed.structure} at ({where}) mm lies outside the scan; correct or remove it."
            )


def _pairs(atlas: Atlas, seeds: Sequence[Seed]) -> FloatArray | None:
    """Return pairs (N, 2, 3) of a chamber's mean seed and its middle in the atlas; None with fewer than three."""
    pairs = []
    for key in CHAMBERS:
        points = [np.asarray(seed.position_mm) for seed in seeds if seed.structure == key]
        if points:
            inside = np.argwhere(atlas.labels.labels == CATALOGUE[key].label)[:, ::-1]
            pairs.append(np.stack([np.mean(points, axis=0), atlas.labels.grid.to_ct(inside.mean(axis=0))]))
    return np.stack(pairs) if len(pairs) >= 3 else None


def _partition(volume: Volume, atlas: Atlas, fit: Fit, levels: Thresholds, seeds: Sequence[Seed]) -> _Partition:
    """Return who owns the blood, on an upright grid of 1.5 mm about the heart."""
    hu, grid = _about(volume, fit, seeds)
    index = fit.index_in(atlas.labels.grid, grid)
    distances = looked_up(atlas.distances, index)
    reached = distances[: len(CHAMBERS)].min(axis=0) < _REACH_MM
    for seed in seeds:
        reached |= ball(grid, seed.position_mm, _SEED_REACH_MM)
    muscle = _muscle(hu, looked_up((atlas.labels.labels == 11).astype(np.float32)[None], index)[0], levels)
    core = _core(hu, levels, muscle)
    blood = local_blood(hu, core & reached, grid, levels.blood_hu)
    share = ((hu - muscle) / np.maximum(blood - muscle, 20.0)).astype(np.float32)
    bright = reached & (share > _NODE_SHARE)
    if bright.sum() * grid.voxel_ml < 20.0:
        raise DataError(
            "Where the heart should be there is hardly any contrast-filled blood; give a contrast-enhanced phase."
        )
    groups = grouped(distances)
    prior = beliefs(groups[:, bright])
    to_own = distances[[STRUCTURES.index(key) for key in SPRING_FROM.values()]][:, bright]
    pull, believed = pulls(prior, to_own, len(CHAMBERS))
    pinned = _pinned(seeds, grid)
    nodes = np.zeros_like(bright)
    nodes[bright] = believed
    for pin in pinned:
        nodes.ravel()[pin.voxels] = bright.ravel()[pin.voxels]
    believed = nodes[bright]
    found = walks(share, nodes, prior[:, believed], pull[believed], pinned)
    nodes, found = _followed(share, nodes, found, bright, pinned, grid)
    likely = spread(found, nodes)
    owner = np.where(nodes & (share > 0.5), likely.argmax(axis=0), len(GROUPS))
    likely = outflows(likely, owner, distances, share, grid)
    owner = np.where(owner < len(GROUPS), likely.argmax(axis=0), len(GROUPS))
    inner = np.zeros(grid.shape, np.uint8)
    for number, key in enumerate(GROUPS):
        for member, part in split(owner == number, key, distances, grid).items():
            inner[part] = CATALOGUE[member].label
    if seeds:
        said = corrected(inner, share, seeds, grid)
        changed = said != inner
        inner = said
        likely[:, changed] = _of_labels(said[changed])
    return _Partition(likely, inner, grid, Levels(blood, muscle, grid))


def _followed(
    share: npt.NDArray[np.float32],
    nodes: npt.NDArray[np.bool_],
    found: npt.NDArray[np.float32],
    bright: npt.NDArray[np.bool_],
    pinned: Sequence[Pinned],
    grid: Grid,
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.float32]]:
    """Return the nodes (K, J, I) and probabilities (G + 1, N) with the vessels followed away from the heart."""
    sure = largest_pieces(share, nodes, found)
    for pin in pinned:
        sure.ravel()[pin.voxels] = nodes.ravel()[pin.voxels]
    outside = _behind(nodes, found, bright, grid) & ~nodes
    radius = _VESSEL_RADIUS_MM / _WORK_MM
    further, likely = flooded(share, sure, found[:, sure[nodes]], outside, bright & ~sure, radius)
    loser = rival(share, further, likely, SPRINGS)
    if loser is not None and not any(pin.group == loser for pin in pinned):
        # Its root was taken for a piece of the other's: without it, it is found as what leads out of its ventricle.
        sure[sure] = found[:, sure[nodes]].argmax(axis=0) != loser
        further, likely = flooded(share, sure, found[:, sure[nodes]], outside, bright & ~sure, radius)
    return further, likely


def _behind(
    nodes: npt.NDArray[np.bool_], found: npt.NDArray[np.float32], bright: npt.NDArray[np.bool_], grid: Grid
) -> npt.NDArray[np.bool_]:
    """Return where (K, J, I) thick bright things lie behind the left atrium: the descending aorta, the spine."""
    atrium = np.zeros(nodes.shape, bool)
    atrium[nodes] = found.argmax(axis=0) == list(GROUPS).index("left_atrium")
    if not atrium.any():
        return atrium
    back = np.quantile(np.nonzero(atrium)[1], 0.99) + _BEHIND_MM / grid.spacing_mm[1]
    thick = distance_within(bright, grid.spacing_mm[::-1]) > _THICK_MM
    return np.asarray(thick & (np.arange(nodes.shape[1])[:, None] > back))


def _about(volume: Volume, fit: Fit, seeds: Sequence[Seed]) -> tuple[npt.NDArray[np.float32], Grid]:
    """Return the HU on an upright grid of 1.5 mm about the fitted atlas and the seeds."""
    hu, whole = upright(volume.hu, volume.grid, _WORK_MM)
    corners = fit.grid.to_ct([np.zeros(3), np.asarray(fit.grid.shape[::-1]) - 1.0])
    points = np.concatenate([corners, *(seed.position_mm + _SEED_BOX_MM for seed in seeds)])
    last = np.asarray(whole.shape[::-1]) - 1
    low = np.clip(np.floor(whole.to_voxel(points.min(axis=0))), 0, last).astype(int)
    high = np.clip(np.ceil(whole.to_voxel(points.max(axis=0))), 0, last).astype(int)
    box = tuple(slice(int(low[axis]), int(high[axis]) + 1) for axis in (2, 1, 0))
    return hu[box], cropped(whole, box)


def _muscle(hu: npt.NDArray[np.float32], wall: npt.NDArray[np.float32], levels: Thresholds) -> float:
    """Return the HU of the heart's own muscle: the median where the fitted atlas has it and the scan no blood."""
    values = hu[(wall > 0.9) & (hu > levels.tissue_hu - 60.0) & (hu < levels.boundary_hu)]
    if len(values) < 500:
        return levels.tissue_hu
    return float(np.clip(np.median(values), levels.tissue_hu - 20.0, (levels.tissue_hu + levels.low_hu) / 2.0 + 20.0))


def _core(hu: npt.NDArray[np.float32], levels: Thresholds, muscle: float) -> npt.NDArray[np.bool_]:
    """Return where (K, J, I) there is blood for certain, no edge of it within 2 mm or so."""
    bright = (hu > muscle + 0.55 * (levels.low_hu - muscle)) & (hu < levels.metal_hu)
    return np.asarray(ndimage.binary_erosion(bright, ndimage.generate_binary_structure(3, 3)))


def _of_labels(labels: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """Return the probabilities (G + 1, N) of groups that are certain, from labels (N,); 0 is none."""
    group = np.full(256, len(GROUPS), np.int64)
    for number, members in enumerate(GROUPS.values()):
        group[[CATALOGUE[member].label for member in members]] = number
    return np.asarray(np.arange(len(GROUPS) + 1)[:, None] == group[labels], np.float32)


def _pinned(seeds: Sequence[Seed], grid: Grid) -> list[Pinned]:
    """Return the voxels that chambers' seeds speak of."""
    keys = list(GROUPS)
    return [
        Pinned(np.flatnonzero(ball(grid, seed.position_mm, seed.radius_mm or SEED_MM)), keys.index(seed.structure))
        for seed in seeds
        if not takes_a_piece(seed)
    ]


def _drawn(volume: Volume, part: _Partition, levels: Thresholds, seeds: Sequence[Seed]) -> npt.NDArray[np.uint8]:
    """Return the labels (K, J, I) at the scan's resolution."""
    own = to_image((part.probabilities[-1] < 0.9).astype(np.uint8), part.grid)
    box = box_of(resampled(own, volume.grid, outside=0, nearest=True) > 0, 2)
    grid = cropped(volume.grid, box)
    hu = volume.hu[box]
    share = share_of_blood(hu, grid, part.levels)
    blood = (share > 0.5) & ~metal(hu, grid, levels.metal_hu)
    best, lead = best_two(part.probabilities, part.grid, blood, grid)
    drawn = _named(labelled(share, blood, best, lead), part, grid)
    drawn = tidied(drawn, grid, seeds)
    for seed in seeds:
        obeyed(drawn, blood, ball(grid, seed.position_mm, seed.radius_mm or SEED_MM), seed, grid)
    labels = np.zeros(volume.grid.shape, np.uint8)
    labels[box] = drawn
    return labels


def _named(groups: npt.NDArray[np.uint8], part: _Partition, grid: Grid) -> npt.NDArray[np.uint8]:
    """Return the labels (K, J, I) from the groups' numbers: within a group the nearest voxel of `inner` decides."""
    labels = np.zeros(groups.shape, np.uint8)
    for number, members in enumerate(GROUPS.values(), start=1):
        mask = groups == number
        own = [CATALOGUE[member].label for member in members]
        known = np.isin(part.inner, own)
        if len(own) == 1 or not known.any():
            labels[mask] = own[0]
            continue
        _, at = nearest_in(known, 1.0)
        nearest = to_image(part.inner.ravel()[at], part.grid)
        labels[mask] = resampled(nearest, grid, outside=own[0], nearest=True)[mask]
    return labels


def _judged(
    volume: Volume, labels: npt.NDArray[np.uint8], fit: Fit, levels: Thresholds, seeded: Sequence[str]
) -> Segmentation:
    """Return the segmentation with what cannot be believed taken together, and said."""
    if not labels.any():
        raise DataError(
            "Where the heart should be there is hardly any contrast-filled blood; give a contrast-enhanced phase."
        )
    box = box_of(labels > 0, 1)
    merged, findings = judged(labels[box], cropped(volume.grid, box), fit.difference, seeded)
    labels[box] = merged
    names = {each.label: each.key for each in CATALOGUE.values() if (merged == each.label).any()}
    return Segmentation(LabelVolume(labels, volume.grid, names), findings, levels)
