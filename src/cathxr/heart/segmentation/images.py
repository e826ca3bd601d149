"""Between arrays on a Grid and SimpleITK's images; upright, coarser copies of a volume to reason on."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import SimpleITK as sitk

from cathxr.core import FloatArray
from cathxr.heart.volume import Grid

AIR_HU = -1024.0


def smoothed(values: npt.NDArray[np.float32], sigma_voxels: FloatArray) -> npt.NDArray[np.float32]:
    """Return the values (K, J, I) smoothed by a Gaussian; its standard deviations along k, j, i from about 0.8 voxels.

    Recursive (R. Deriche, "Fast algorithms for low-level vision", 1990): a wide one costs as much as a narrow one.
    """
    image = sitk.GetImageFromArray(np.asarray(values, np.float32))
    return to_array(sitk.SmoothingRecursiveGaussian(image, [float(each) for each in sigma_voxels[::-1]]))


def to_image(array: npt.NDArray[Any], grid: Grid) -> sitk.Image:
    """Return the array (K, J, I) as an image whose physical space is `ct`."""
    image = sitk.GetImageFromArray(array)
    spacing = grid.spacing_mm
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(grid.ct_from_voxel[:3, 3].tolist())
    image.SetDirection((grid.ct_from_voxel[:3, :3] / spacing).ravel().tolist())
    return image


def to_array(image: sitk.Image) -> npt.NDArray[Any]:
    """Return a copy of the image's voxels (K, J, I)."""
    return np.asarray(sitk.GetArrayFromImage(image))


def empty_image(grid: Grid) -> sitk.Image:
    """Return an image of one byte a voxel with the grid's place: what a resampling may refer to."""
    image = sitk.Image([int(size) for size in grid.shape[::-1]], sitk.sitkUInt8)
    spacing = grid.spacing_mm
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(grid.ct_from_voxel[:3, 3].tolist())
    image.SetDirection((grid.ct_from_voxel[:3, :3] / spacing).ravel().tolist())
    return image


def resampled(
    image: sitk.Image, grid: Grid, *, outside: float, transform: sitk.Transform | None = None, nearest: bool = False
) -> npt.NDArray[Any]:
    """Return the image's values (K, J, I) at the grid's voxels, through `transform` from the grid to the image."""
    kind = sitk.sitkNearestNeighbor if nearest else sitk.sitkLinear
    place = transform or sitk.Transform(3, sitk.sitkIdentity)
    return to_array(sitk.Resample(image, empty_image(grid), place, kind, outside, image.GetPixelID()))


def upright(hu: npt.NDArray[np.int16], grid: Grid, spacing_mm: float) -> tuple[npt.NDArray[np.float32], Grid]:
    """Return the volume's HU (K, J, I) on an upright grid of `spacing_mm` that covers it; AIR_HU beyond it.

    Each value is the mean over what it stands for, so that noise goes down with the resolution.
    """
    image = to_image(hu, grid)
    factors = np.maximum(np.round(spacing_mm / grid.spacing_mm), 1).astype(int).tolist()
    if max(factors) > 1:
        image = sitk.BinShrink(image, factors)
    image = sitk.Cast(image, sitk.sitkFloat32)
    k, j, i = (size - 1 for size in grid.shape)
    corners = grid.to_ct([(a, b, c) for a in (0, i) for b in (0, j) for c in (0, k)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    counts = np.maximum(np.floor((high - low) / spacing_mm).astype(int) + 1, 1)
    target = upright_at(low + ((high - low) - (counts - 1) * spacing_mm) / 2.0, counts, spacing_mm)
    return resampled(image, target, outside=AIR_HU), target


def upright_at(low_mm: FloatArray, counts: npt.NDArray[np.int64], spacing_mm: float) -> Grid:
    """Return the upright grid with `counts` (3,) voxels along x, y and z, the first voxel's centre at `low_mm`."""
    matrix = np.diag([spacing_mm, spacing_mm, spacing_mm, 1.0])
    matrix[:3, 3] = low_mm
    return Grid((int(counts[2]), int(counts[1]), int(counts[0])), matrix)


def cropped(grid: Grid, box: tuple[slice, ...]) -> Grid:
    """Return the grid of the voxels in `box` (slices along k, j and i)."""
    matrix = grid.ct_from_voxel.copy()
    matrix[:3, 3] = grid.to_ct(np.array([box[2].start, box[1].start, box[0].start], float))
    return Grid(tuple(each.stop - each.start for each in box), matrix)


def box_of(mask: npt.NDArray[np.bool_], margin: int = 0) -> tuple[slice, ...]:
    """Return the box (slices along each axis) about what is in the mask, `margin` voxels wider on every side."""
    spans = []
    for axis in range(mask.ndim):
        found = np.flatnonzero(mask.any(axis=tuple(other for other in range(mask.ndim) if other != axis)))
        spans.append(slice(max(int(found[0]) - margin, 0), min(int(found[-1]) + 1 + margin, mask.shape[axis])))
    return tuple(spans)


def grid_points(grid: Grid) -> FloatArray:
    """Return the centres (K, J, I, 3) mm of the grid's voxels."""
    k, j, i = np.meshgrid(*(np.arange(size) for size in grid.shape), indexing="ij")
    return grid.to_ct(np.stack([i, j, k], axis=-1))


def ball(grid: Grid, centre_mm: Sequence[float], radius_mm: float) -> npt.NDArray[np.bool_]:
    """Return which voxels' centres (K, J, I) lie within a ball; at least the voxel that holds the centre."""
    mask = np.zeros(grid.shape, bool)
    middle = grid.to_voxel(centre_mm)
    reach = radius_mm / grid.spacing_mm
    low = np.maximum(np.floor(middle - reach).astype(int), 0)
    high = np.minimum(np.ceil(middle + reach).astype(int) + 1, grid.shape[::-1])
    if (low >= high).any():
        return mask
    k, j, i = np.meshgrid(*(np.arange(low[axis], high[axis]) for axis in (2, 1, 0)), indexing="ij")
    offset = (np.stack([i, j, k], axis=-1) - middle) * grid.spacing_mm
    mask[low[2] : high[2], low[1] : high[1], low[0] : high[0]] = (offset**2).sum(axis=-1) <= radius_mm**2
    at = np.clip(np.round(middle).astype(int), 0, np.asarray(grid.shape[::-1]) - 1)
    mask[at[2], at[1], at[0]] = True
    return mask
