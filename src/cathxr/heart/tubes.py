"""A straight tube that carries a vessel on from its mouth, where a model ends there."""

import numpy as np

from cathxr.core import FloatArray
from cathxr.heart.boxes import Mask
from cathxr.heart.model import Opening
from cathxr.heart.volume import Grid

_OF_MOUTH = 0.94
"""The tube's diameter as a share of the mouth's: its wall then stands inside the rim, and no sliver runs around it."""


def carried_on(mouth: Opening, direction: FloatArray, length_mm: float, grid: Grid) -> Mask:
    """Return which voxels' centres (K, J, I) lie in the tube that goes on from `mouth` along a unit direction (3,).

    Its sections parallel to the mouth's plane are discs, so that it fits the mouth however slanted it leaves it.
    """
    k, j, i = (each.astype(np.float32) for each in np.indices(grid.shape))
    away = grid.to_ct(np.stack([i, j, k], axis=-1)) - mouth.centroid_mm
    slope = float(direction @ mouth.normal)
    if slope <= 0.0:
        raise ValueError("direction: expected one that leads out of the mouth")
    along = (away @ mouth.normal) / slope
    aside = np.linalg.norm(away - along[..., None] * direction, axis=-1)
    return np.asarray((along > 0.0) & (along < length_mm) & (aside < 0.5 * _OF_MOUTH * mouth.diameter_mm))


def end_of(mouth: Opening, key: str, name: str, direction: FloatArray, length_mm: float) -> Opening:
    """Return the far opening of such a tube: parallel to the mouth's plane."""
    centre = np.round(mouth.centroid_mm + length_mm * direction, 2)
    return Opening(f"{key}_end", f"{name}, end of the stub", key, centre, mouth.normal, mouth.diameter_mm)
