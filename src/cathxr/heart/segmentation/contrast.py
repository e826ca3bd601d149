"""What the scan's own contrast is: the HU of blood and of muscle, from what is bright and thick."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import DataError
from cathxr.heart.segmentation.distances import distance_within
from cathxr.heart.volume import Grid

_LEAST_CONTRAST_HU = 70.0
_CORE_MM = 6.0
_PIECE_ML = 8.0
_WIDTH_HU = 12.0


@dataclass(frozen=True)
class Thresholds:
    """HU of the scan. tissue: muscle about the blood. blood: the pools' typical level; low: the least of their levels.

    boundary: half way between tissue and `blood`; where a pool is brighter or darker, its own half-way level is used.
    metal: what is brighter, and thin, is no blood.
    """

    tissue_hu: float
    blood_hu: float
    low_hu: float
    boundary_hu: float
    metal_hu: float
    how: str


def thresholds(hu: npt.NDArray[np.float32], grid: Grid) -> Thresholds:
    """Return the levels, from a coarse upright copy of the volume (K, J, I), about 2 mm.

    Tissue is the most frequent value between -20 and 160 HU. What is clearly brighter and thicker than 12 mm is blood
    or spongy bone; the brightest such pieces are blood, for bone with contrast blood about it is darker than the blood.

    Raises:
        DataError: nothing thick is brighter than tissue: the scan shows no contrast-filled blood.
    """
    smooth = ndimage.gaussian_filter(hu, 1.0)
    tissue = _mode(smooth[(smooth > -20.0) & (smooth < 160.0)], _WIDTH_HU)
    if tissue is None:
        raise DataError("The volume holds no soft tissue; give a CT of the chest in Hounsfield units.")
    bright = smooth > tissue + _LEAST_CONTRAST_HU
    core = distance_within(bright, grid.spacing_mm[::-1]) > _CORE_MM
    pieces, count = ndimage.label(core)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:] * grid.voxel_ml
    kept = [index + 1 for index in np.flatnonzero(sizes >= _PIECE_ML * 0.25)]
    if not kept:
        raise _no_contrast()
    medians = np.asarray(ndimage.median(smooth, pieces, kept))
    top = float(medians.max())
    good = [index for index, level in zip(kept, medians, strict=True) if level > tissue + 0.5 * (top - tissue)]
    values = smooth[np.isin(pieces, good)]
    blood = _mode(values, _WIDTH_HU)
    if blood is None or blood < tissue + _LEAST_CONTRAST_HU or len(values) * grid.voxel_ml < _PIECE_ML:
        raise _no_contrast()
    low = float(max(np.quantile(values, 0.03), tissue + 0.4 * (blood - tissue)))
    return Thresholds(
        tissue_hu=tissue,
        blood_hu=blood,
        low_hu=low,
        boundary_hu=(tissue + blood) / 2.0,
        metal_hu=max(1200.0, 2.2 * blood),
        how="tissue: the most frequent value of soft tissue; blood: the most frequent value within thick bright pieces",
    )


def _no_contrast() -> DataError:
    """Return the error for a scan without contrast medium in the heart."""
    return DataError(
        "The scan shows no contrast-filled heart (nothing thick is brighter than muscle); "
        "give a contrast-enhanced phase, or a ready mask with --labels."
    )


def _mode(values: npt.NDArray[np.float32], width_hu: float) -> float | None:
    """Return the most frequent value, found in a histogram smoothed by `width_hu`; None without enough values."""
    if values.size < 100:
        return None
    low, high = float(values.min()), float(values.max())
    edges = np.arange(np.floor(low), np.ceil(high) + 6.0, 5.0)
    if len(edges) < 3:
        return (low + high) / 2.0
    counts, edges = np.histogram(values, bins=edges)
    smooth = ndimage.gaussian_filter1d(counts.astype(float), width_hu / 5.0)
    at = int(smooth.argmax())
    return float((edges[at] + edges[at + 1]) / 2.0)
