"""How far each voxel is from a mask. Needs the extra `heart` (SimpleITK)."""

import numpy as np
import numpy.typing as npt
import SimpleITK as sitk

from cathxr.core import FloatArray

Float32 = npt.NDArray[np.float32]


def away_from(mask: npt.NDArray[np.bool_], spacing_mm: FloatArray) -> Float32:
    """Return the distance (K, J, I) mm to the nearest voxel of the mask: 0 in it, infinite where it is empty.

    spacing_mm (3,): along k, j and i. Exact: Maurer, Qi and Raghavan, "A linear time algorithm for computing exact
    Euclidean distance transforms of binary images in arbitrary dimensions", IEEE TPAMI 2003.
    """
    if not mask.any():
        return np.full(mask.shape, np.inf, np.float32)
    image = sitk.GetImageFromArray(np.ascontiguousarray(mask).view(np.uint8))
    image.SetSpacing([float(each) for each in np.asarray(spacing_mm)[::-1]])
    signed = sitk.SignedMaurerDistanceMap(image, insideIsPositive=False, squaredDistance=False, useImageSpacing=True)
    away: Float32 = sitk.GetArrayFromImage(signed)
    return np.maximum(away, np.float32(0.0), out=away)
