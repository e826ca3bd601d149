"""Undistortion and perspective warp in one look-up table: a raw picture to a cut-out of its rectified mm plane."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray, PixelArray, Rig
from cathxr.geometry.fiducial_plane import FiducialPlane

_MOST_PIXELS = 4_000_000


@dataclass(frozen=True, eq=False)
class PaperWarp:
    """A fixed map from raw pixels to the rectified plane, cropped to what the ROI can cover in the picture.

    px_per_mm: of the cut-out, that of the raw picture at the plane's middle. origin_mm (2,): where the centre of its
    first pixel lies. size_px: width and height. Columns run along +x of `box`, from the inlet at x = 0; rows along +y
    (top) or +z (front).
    """

    plane: FiducialPlane
    px_per_mm: float
    origin_mm: FloatArray
    size_px: tuple[int, int]
    _lookup: NDArray[np.int16]
    _fraction: NDArray[np.uint16]

    @classmethod
    def of(cls, rig: Rig, camera: str) -> Self:
        """Return the warp of one camera of a rig.

        Raises:
            ConfigError: the rig's markers cannot carry the paper method.
        """
        plane = FiducialPlane.of(rig, camera)
        low, high = _apparent_roi(rig, plane)
        middle = 0.5 * (low + high)
        step = plane.to_pixels(middle + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
        area = abs(float(np.linalg.det(np.stack([step[1] - step[0], step[2] - step[0]]))))
        extent = high - low
        px_per_mm = min(float(np.sqrt(area)), float(np.sqrt(_MOST_PIXELS / extent.prod())))
        width, height = (int(each) for each in np.ceil(extent * px_per_mm) + 1)
        grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
        raw = plane.to_pixels(low + grid / px_per_mm).astype(np.float32)
        lookup, fraction = cv2.convertMaps(raw[..., 0], raw[..., 1], cv2.CV_16SC2)
        return cls(
            plane,
            px_per_mm,
            low,
            (width, height),
            np.asarray(lookup, dtype=np.int16),
            np.asarray(fraction, dtype=np.uint16),
        )

    def rectified(self, grey: PixelArray) -> PixelArray:
        """Return the cut-out uint8 (height, width) of a raw grey picture; where that ends, its edge repeats."""
        return np.asarray(
            cv2.remap(grey, self._lookup, self._fraction, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
            dtype=np.uint8,
        )

    def to_mm(self, points_px: FloatArray) -> FloatArray:
        """Return mm on the plane (..., 2) of cut-out pixels (..., 2), column and row."""
        return np.asarray(self.origin_mm + points_px / self.px_per_mm, dtype=np.float64)

    def to_cutout(self, points_mm: FloatArray) -> FloatArray:
        """Return cut-out pixels (..., 2) of mm on the plane (..., 2). Inverse of `to_mm`."""
        return np.asarray((points_mm - self.origin_mm) * self.px_per_mm, dtype=np.float64)


def _apparent_roi(rig: Rig, plane: FiducialPlane) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the plane's rectangle that the ROI covers as this camera sees it, cut at x = 0."""
    seen = plane.apparent(rig.roi.corners_mm)
    low, high = seen.min(axis=0), seen.max(axis=0)
    low[0] = 0.0
    return low, high
