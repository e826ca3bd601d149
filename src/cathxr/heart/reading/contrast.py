"""Judges from the voxels whether a scan shows a bright blood pool. A header's word for contrast proves nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import DataError
from cathxr.heart.volume import Volume

_CELL_MM = 3.0
_BRIGHT_HU, _METAL_HU = 180.0, 1200.0
_OPENING_MM = 4.5
_LARGE_ML, _SURE_ML, _SURE_HU = 60.0, 15.0, 250.0
SAMPLED_SLICES = 32


@dataclass(frozen=True)
class Contrast:
    """is_bright: whether there is a blood pool brighter than tissue. pool_ml, pool_hu: its size and median."""

    is_bright: bool
    pool_ml: float
    pool_hu: float | None


def judge_contrast(planes: Sequence[npt.NDArray[np.int16]], spacing_mm: Sequence[float]) -> Contrast:
    """Return what a sample of slices shows.

    planes: (rows, columns) HU each, evenly spaced. spacing_mm: of columns, of rows, of the sampled slices.

    The largest bright body that is at least 9 mm thick is looked for: thicker than the cortex of bones and calcium.
    Spongy bone is as thick, but no vertebra is both as bright and as large as the blood of a heart or an aorta.
    """
    coarse, cell_mm = _coarse(planes, spacing_mm)
    bright = (coarse > _BRIGHT_HU) & (coarse < _METAL_HU)
    reach = [max(1, round(_OPENING_MM / each)) for each in cell_mm[1:]]
    rows, columns = np.ogrid[-reach[0] : reach[0] + 1, -reach[1] : reach[1] + 1]
    disc = (rows / reach[0]) ** 2 + (columns / reach[1]) ** 2 <= 1.0
    opened = ndimage.binary_opening(bright, disc[None])
    parts, count = ndimage.label(opened)
    if count == 0:
        return Contrast(False, 0.0, None)
    sizes = np.bincount(parts.ravel())[1:]
    largest = int(np.argmax(sizes)) + 1
    pool_ml = float(sizes[largest - 1] * np.prod(cell_mm) / 1000.0)
    pool_hu = float(np.median(coarse[parts == largest]))
    is_bright = pool_ml >= _LARGE_ML or (pool_ml >= _SURE_ML and pool_hu >= _SURE_HU)
    return Contrast(is_bright, pool_ml, pool_hu)


def contrast_of(hu: npt.NDArray[np.int16], spacing_mm: Sequence[float]) -> Contrast:
    """Return the contrast of a whole volume (K, J, I), from a sample of its slices; spacing along i, j, k."""
    step = max(1, len(hu) // SAMPLED_SLICES)
    return judge_contrast(list(hu[step // 2 :: step]), (spacing_mm[0], spacing_mm[1], spacing_mm[2] * step))


def require_contrast(volume: Volume) -> None:
    """Do nothing where the volume shows contrast-filled blood.

    Raises:
        DataError: it does not, so that blood cannot be told from muscle.
    """
    if volume.technical.contrast is False:
        raise DataError(
            "The series shows no contrast in the blood: there is no bright pool, so that chambers cannot be told from "
            "muscle; choose the contrast series (`cathxr heart info` lists it) or give ready masks with --labels."
        )


def _coarse(
    planes: Sequence[npt.NDArray[np.int16]], spacing_mm: Sequence[float]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64]]:
    """Return the slices as means over cells of about 3 mm, and the cells' size along k, j, i."""
    bins = [max(1, round(_CELL_MM / each)) for each in (spacing_mm[1], spacing_mm[0])]
    rows, columns = (size // each for size, each in zip(planes[0].shape, bins, strict=True))
    cut = [
        each[: rows * bins[0], : columns * bins[1]].astype(np.float32).reshape(rows, bins[0], columns, bins[1])
        for each in planes
    ]
    cell = np.array([spacing_mm[2], spacing_mm[1] * bins[0], spacing_mm[0] * bins[1]])
    return np.stack([each.mean(axis=(1, 3)) for each in cut]), cell
