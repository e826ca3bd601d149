"""Loose pieces given to what they touch, small holes closed, a person's seeds obeyed."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.seeds import NOTHING, Seed
from cathxr.heart.segmentation.images import box_of
from cathxr.heart.volume import Grid

_MANY = {"pulmonary_veins": "left_atrium"}
"""What may be in several pieces, and what each of them must touch; of everything else the largest is kept."""
_LEAST_ML = 0.3


def tidied(labels: npt.NDArray[np.uint8], grid: Grid, seeds: Sequence[Seed] = ()) -> npt.NDArray[np.uint8]:
    """Return the labels (K, J, I) with each structure in one piece; a loose piece goes to what it touches most.

    Pieces that hold a seed of their structure stay.
    """
    out = labels.copy()
    for key, each in CATALOGUE.items():
        mask = out == each.label
        if not mask.any():
            continue
        box = box_of(mask, 2)
        window = out[box]
        pieces, count = ndimage.label(mask[box])
        if count < 2:
            continue
        sizes = np.bincount(pieces.ravel(), minlength=count + 1)
        sizes[0] = 0
        keep = {int(sizes.argmax())}
        if key in _MANY:
            chamber = ndimage.binary_dilation(window == CATALOGUE[_MANY[key]].label)
            large = np.flatnonzero(sizes * grid.voxel_ml >= _LEAST_ML)
            keep = {int(index) for index in np.unique(pieces[chamber]) if index in large} or keep
        keep |= {int(pieces[at]) for at in _seeded(key, seeds, grid, box)}
        for index, found in enumerate(ndimage.find_objects(pieces), start=1):
            if index not in keep:
                _given_away(window, pieces, index, found, each.label)
    return out


def _seeded(key: str, seeds: Sequence[Seed], grid: Grid, box: tuple[slice, ...]) -> list[tuple[int, ...]]:
    """Return the voxels (k, j, i), counted from the box's first, of the structure's seeds that lie in the box."""
    found = []
    for seed in seeds:
        at = np.round(grid.to_voxel(seed.position_mm)).astype(int)[::-1]
        if seed.structure == key and all(each.start <= n < each.stop for each, n in zip(box, at, strict=True)):
            found.append(tuple(int(n) - each.start for each, n in zip(box, at, strict=True)))
    return found


def _given_away(
    window: npt.NDArray[np.uint8], pieces: npt.NDArray[np.int32], index: int, found: tuple[slice, ...], label: int
) -> None:
    """Give a loose piece, in place, to the structure that it touches most; to none where it touches none."""
    around = tuple(slice(max(each.start - 1, 0), each.stop + 1) for each in found)
    piece = pieces[around] == index
    rim = ndimage.binary_dilation(piece) & ~piece
    touched = np.bincount(window[around][rim], minlength=256)
    touched[[0, label]] = 0
    window[around][piece] = touched.argmax() if touched.any() else 0


def obeyed(
    labels: npt.NDArray[np.uint8],
    blood: npt.NDArray[np.bool_],
    ball: npt.NDArray[np.bool_],
    seed: Seed,
    grid: Grid,
) -> None:
    """Give the seed's voxel, and the blood in the ball about it, the seed's label, in place."""
    value = 0 if seed.structure == NOTHING else CATALOGUE[seed.structure].label
    labels[ball & blood] = value
    at = np.round(grid.to_voxel(seed.position_mm)).astype(int)[::-1]
    if ((at >= 0) & (at < labels.shape)).all():
        labels[tuple(at)] = value
