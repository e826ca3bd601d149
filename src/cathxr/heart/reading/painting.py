"""Puts the masks of structures onto one grid, as labels of the catalogue."""

import numpy as np
import numpy.typing as npt
import SimpleITK as sitk

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.volume import Grid, LabelVolume

ORDER = (
    "blood_pool", "left_heart", "right_heart", "myocardium", "inferior_vena_cava", "superior_vena_cava", "aorta",
    "pulmonary_artery", "pulmonary_veins", "right_ventricle", "left_ventricle", "right_atrium", "left_atrium",
    "left_atrial_appendage", "coronary_arteries",
)  # fmt: skip
"""Where masks overlap the later one holds: blood over muscle, parts over wholes."""

Mask = npt.NDArray[np.bool_]


class Canvas:
    """Labels that masks are painted on, one structure at a time, in any sequence: `ORDER` decides overlaps."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self._labels = np.zeros(grid.shape, np.uint8)
        self._keys: set[str] = set()
        rank = {CATALOGUE[key].label: place for place, key in enumerate(ORDER, start=1)}
        self._ranks = np.array([rank.get(label, 0) for label in range(256)], np.uint8)

    def paint(self, key: str, mask: Mask) -> None:
        """Give the voxels of `mask` (K, J, I) to a structure, but for those that a later one of `ORDER` has."""
        label = CATALOGUE[key].label
        free = self._ranks[self._labels] <= self._ranks[label]
        self._labels[mask & free] = label
        if mask.any():
            self._keys.add(key)

    def finished(self) -> LabelVolume:
        """Return the labels; a structure that nothing is left of keeps its name."""
        return LabelVolume(self._labels, self.grid, {CATALOGUE[key].label: key for key in sorted(self._keys)})


def onto(labels: npt.NDArray[np.uint8], grid: Grid, target: Grid) -> npt.NDArray[np.uint8]:
    """Return labels (K, J, I) of one grid on another, each voxel that of the nearest centre, 0 outside."""
    if is_same_grid(grid, target):
        return labels
    resampled = sitk.Resample(
        _image(labels, grid), _image_of_grid(target), sitk.Transform(), sitk.sitkNearestNeighbor, 0, sitk.sitkUInt8
    )
    return np.asarray(sitk.GetArrayFromImage(resampled))


def is_same_grid(one: Grid, other: Grid) -> bool:
    """Return whether two grids have the same voxels, within a hundredth of one."""
    if one.shape != other.shape:
        return False
    depth, rows, columns = one.shape
    corners = np.array([[i, j, k] for i in (0, columns - 1) for j in (0, rows - 1) for k in (0, depth - 1)], float)
    return bool(np.abs(other.to_voxel(one.to_ct(corners)) - corners).max() < 0.01)


def _image(values: npt.NDArray[np.uint8], grid: Grid) -> sitk.Image:
    image = sitk.GetImageFromArray(values)
    _place(image, grid)
    return image


def _image_of_grid(grid: Grid) -> sitk.Image:
    """Return an image that has the grid, for its geometry; a byte a voxel for the moment."""
    depth, rows, columns = grid.shape
    image = sitk.Image([columns, rows, depth], sitk.sitkUInt8)
    _place(image, grid)
    return image


def _place(image: sitk.Image, grid: Grid) -> None:
    image.SetSpacing(grid.spacing_mm.tolist())
    image.SetOrigin(grid.ct_from_voxel[:3, 3].tolist())
    image.SetDirection((grid.ct_from_voxel[:3, :3] / grid.spacing_mm).ravel().tolist())
