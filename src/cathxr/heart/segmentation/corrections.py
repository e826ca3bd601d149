"""A person's seeds in vessels, and of what is no heart: each takes the whole piece of blood that it lies in."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.seeds import NOTHING, Seed
from cathxr.heart.segmentation.atlas import CHAMBERS
from cathxr.heart.segmentation.distances import distance_within, opened
from cathxr.heart.segmentation.flooding import flooded_from
from cathxr.heart.segmentation.images import ball
from cathxr.heart.segmentation.vessels import PARENTS
from cathxr.heart.volume import Grid

SEED_MM = 2.0
"""How far about a seed without a radius its word holds whatever the scan shows."""
_CORE = 0.6
"""A seed this deep within a chamber, of its greatest depth, speaks of the whole chamber."""
_FREE_REACH_MM, _NECK = 25.0, 0.6
"""How far a seed reaches in blood without a label, and through what, of the blood's thickness about it."""
_PER_MM, _PER_SHARE = 10.0, 100.0
_BLOOD = 0.5


def takes_a_piece(seed: Seed) -> bool:
    """Return whether the seed takes a whole piece: one of a chamber moves that chamber's border instead."""
    return seed.structure not in CHAMBERS


def corrected(
    inner: npt.NDArray[np.uint8], share: npt.NDArray[np.float32], seeds: Sequence[Seed], grid: Grid
) -> npt.NDArray[np.uint8]:
    """Return the labels (K, J, I) with the seeds' pieces relabelled, in the seeds' order; what is taken off is 0.

    inner (K, J, I): the labels of the blood, 0 outside. share (K, J, I): of blood, 0 tissue, 1 blood.
    """
    out = inner.copy()
    places = [ball(grid, each.position_mm, each.radius_mm or SEED_MM) for each in seeds]
    for number, seed in enumerate(seeds):
        if not takes_a_piece(seed):
            continue
        value = 0 if seed.structure == NOTHING else CATALOGUE[seed.structure].label
        others = [place for place, each in zip(places, seeds, strict=True) if each.structure != seed.structure]
        near = ball(grid, seed.position_mm, _FREE_REACH_MM)
        out[_piece(out, share, (places[number], near), value, others, grid)] = value
    return out


def _piece(
    inner: npt.NDArray[np.uint8],
    share: npt.NDArray[np.float32],
    seeded: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]],
    value: int,
    others: Sequence[npt.NDArray[np.bool_]],
    grid: Grid,
) -> npt.NDArray[np.bool_]:
    """Return the piece (K, J, I) of blood about the seed: what is labelled as it is, up to the neck that joins it on.

    seeded: the seed's own voxels, and how far it reaches in blood that has no label: there nothing says where to end.

    The neck lies between the place and where its present label springs from, or what other seeds speak of: both
    flood the blood, what is thick and bright before what is narrow and dark.
    """
    place, near = seeded
    blood = share > _BLOOD
    there = inner[place & blood]
    if not len(there):
        return place
    label = int(np.bincount(there).argmax())
    if label == value:
        return place & blood
    region = (inner == label) & blood
    if not label:
        region &= near
        radius = _NECK * float(distance_within(region, grid.spacing_mm[::-1])[place].max())
        region = opened(region, radius, float(grid.spacing_mm[0])) | (place & blood)
    pieces, _ = ndimage.label(region)
    index = np.bincount(pieces[place & region]).argmax()
    region = pieces == index
    depth = distance_within(region, grid.spacing_mm[::-1])
    root = _root(inner, region, depth, place, label)
    for other in others:
        root |= other & region & ~place
    markers = np.where(root, np.uint8(2), np.uint8(0))
    markers[place & region] = 1
    heights = (depth.max() - depth) * _PER_MM + np.clip(1.0 - share, 0.0, 1.0) * _PER_SHARE
    return np.asarray(flooded_from(np.clip(heights, 0.0, 500.0).astype(np.uint16), markers, region) == 1) | place


def _root(
    inner: npt.NDArray[np.uint8],
    region: npt.NDArray[np.bool_],
    depth: npt.NDArray[np.float32],
    place: npt.NDArray[np.bool_],
    label: int,
) -> npt.NDArray[np.bool_]:
    """Return where (K, J, I) the region is certainly what it is labelled: a chamber's middle, a vessel's mouth."""
    if not label:
        return np.zeros_like(region)
    key = next(each.key for each in CATALOGUE.values() if each.label == label)
    if key in CHAMBERS:
        if depth[place].max() > _CORE * depth.max():
            return np.zeros_like(region)
        return np.asarray(region & (depth > _CORE * depth.max()))
    chamber = inner == CATALOGUE[PARENTS[key]].label
    return np.asarray(region & ndimage.binary_dilation(chamber, iterations=2))
