"""The labels at the scan's own resolution: blood at half level, borders along walls or where the partition has them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import SimpleITK as sitk
from scipy import ndimage

from cathxr.heart.segmentation.distances import distance_within
from cathxr.heart.segmentation.flooding import flooded_from
from cathxr.heart.segmentation.images import resampled, to_image
from cathxr.heart.segmentation.sampling import largest_two
from cathxr.heart.volume import Grid

_LIGHT_SMOOTHING_VOXELS = 0.6
_CERTAIN = 0.6
_METAL_THIN_MM = 3.0


@dataclass(frozen=True, eq=False)
class Levels:
    """blood_hu (K, J, I) on `grid`: the local level of blood; tissue_hu: of the muscle about it."""

    blood_hu: npt.NDArray[np.float32]
    tissue_hu: float
    grid: Grid


def local_blood(
    hu: npt.NDArray[np.float32], core: npt.NDArray[np.bool_], grid: Grid, otherwise_hu: float, reach_mm: float = 6.0
) -> npt.NDArray[np.float32]:
    """Return the level HU of blood (K, J, I) about each voxel: the mean of the core near it, else `otherwise_hu`."""
    sigma = reach_mm / grid.spacing_mm[::-1]
    weight = ndimage.gaussian_filter(core.astype(np.float32), sigma)
    total = ndimage.gaussian_filter(np.where(core, hu, np.float32(0.0)), sigma)
    return np.asarray((total + 1e-3 * otherwise_hu) / (weight + 1e-3), np.float32)


def share_of_blood(hu: npt.NDArray[np.int16], grid: Grid, levels: Levels) -> npt.NDArray[np.float32]:
    """Return the share of blood (K, J, I) at the scan's voxels: 0 tissue, 1 blood of the local level."""
    blood = resampled(to_image(levels.blood_hu, levels.grid), grid, outside=float(levels.blood_hu.mean()))
    smooth = ndimage.gaussian_filter(hu, _LIGHT_SMOOTHING_VOXELS, output=np.float32)
    smooth -= np.float32(levels.tissue_hu)
    blood -= np.float32(levels.tissue_hu)
    return np.asarray(smooth / np.maximum(blood, 20.0), np.float32)


def best_two(
    probabilities: npt.NDArray[np.float32], coarse: Grid, blood: npt.NDArray[np.bool_], grid: Grid
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """Return, within the blood, the likeliest group's number from 1 (the last: none), and its lead over the second."""
    matrix = np.linalg.inv(coarse.ct_from_voxel) @ grid.ct_from_voxel
    backwards = [2, 1, 0]  # from i, j, k to k, j, i
    index_from_voxel = np.column_stack([matrix[:3, :3][backwards][:, backwards], matrix[:3, 3][backwards]])
    return largest_two(probabilities, blood, index_from_voxel)


def metal(hu: npt.NDArray[np.int16], grid: Grid, metal_hu: float) -> npt.NDArray[np.bool_]:
    """Return where (K, J, I) thin things are brighter than any blood: stents, calcium, leads, clips."""
    bright = hu > metal_hu
    if not bright.any():
        return np.asarray(bright)
    thick = distance_within(bright, grid.spacing_mm[::-1]) > _METAL_THIN_MM / 2.0
    radius = [max(round(_METAL_THIN_MM / spacing), 1) for spacing in grid.spacing_mm]
    grown = sitk.GetArrayFromImage(sitk.BinaryDilate(sitk.GetImageFromArray(thick.astype(np.uint8)), radius)) > 0
    return np.asarray(bright & ~grown)


def labelled(
    share: npt.NDArray[np.float32],
    blood: npt.NDArray[np.bool_],
    best: npt.NDArray[np.uint8],
    lead: npt.NDArray[np.float32],
) -> npt.NDArray[np.uint8]:
    """Return the structure's number (K, J, I) of each voxel of the blood, 0 elsewhere.

    What is certain stays; the rest is flooded from there, bright before dark and certain before doubtful, so that
    borders come to lie in walls that partial volume has made pale, and elsewhere where the partition is undecided.
    """
    certain = np.where(blood & (lead > _CERTAIN), best, np.uint8(0))
    landscape = np.clip(1.0 - share, 0.0, 1.0) + 0.5 * (1.0 - lead)
    flooded = flooded_from(np.round(landscape * 200.0).astype(np.uint16), certain, blood)
    return np.asarray(np.where(flooded > 0, flooded, np.where(blood, best, 0)), np.uint8)
