"""The sector as a picture in mm: scan conversion of the polar image."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.ultrasound.image import PolarImage


@dataclass(frozen=True, eq=False)
class FanPicture:
    """A scan-converted picture. The transducer is in the middle of the top edge; distal is on the left.

    grey: uint8 (H, W), 0 outside the sector. inside: bool (H, W). mm_per_px: size of a pixel.
    face_px: column and row of the transducer's face on the sector's centre line.
    """

    grey: npt.NDArray[np.uint8]
    inside: npt.NDArray[np.bool_]
    mm_per_px: float
    face_px: tuple[float, float]

    def pixel_of(self, across_mm: float, along_mm: float) -> tuple[float, float]:
        """Return column and row of a point: mm towards distal, and mm along the centre line from the face."""
        return self.face_px[0] - across_mm / self.mm_per_px, self.face_px[1] + along_mm / self.mm_per_px


def fan_picture(image: PolarImage, *, mm_per_px: float = 0.2) -> FanPicture:
    """Return the picture of a polar image, bilinear between lines and samples.

    Raises:
        ValueError: mm_per_px is not positive.
    """
    if not mm_per_px > 0.0:
        raise ValueError(f"mm_per_px: expected a positive number, got {mm_per_px}")
    of = image.settings
    half = of.sector_rad / 2.0
    reach = of.apex_mm + of.depth_mm
    wide = reach * np.sin(min(half, np.pi / 2.0))
    top = of.apex_mm * np.cos(half) - of.apex_mm
    columns = int(np.ceil(2.0 * wide / mm_per_px)) + 1
    rows = int(np.ceil((of.depth_mm - top) / mm_per_px)) + 1
    across = ((columns - 1) / 2.0 - np.arange(columns)) * mm_per_px
    along = np.arange(rows) * mm_per_px + top
    z, x = np.meshgrid(across, along + of.apex_mm)
    share = np.arctan2(z, x) / of.sector_rad + 0.5
    depth = (np.hypot(x, z) - of.apex_mm) / of.depth_mm
    inside = (share >= 0.0) & (share <= 1.0) & (depth >= 0.0) & (depth <= 1.0)
    grey = _bilinear(image.grey.astype(float), share * of.lines - 0.5, depth * of.samples - 0.5)
    picture = np.where(inside, np.floor(grey + 0.5), 0.0).astype(np.uint8)
    return FanPicture(picture, inside, mm_per_px, ((columns - 1) / 2.0, -top / mm_per_px))


def _bilinear(values: FloatArray, line: FloatArray, sample: FloatArray) -> FloatArray:
    """Return values between lines and samples, the edge's beyond it."""
    line = np.clip(line, 0.0, values.shape[0] - 1.0)
    sample = np.clip(sample, 0.0, values.shape[1] - 1.0)
    i = np.minimum(line.astype(int), values.shape[0] - 2)
    j = np.minimum(sample.astype(int), values.shape[1] - 2)
    a, b = line - i, sample - j
    near = values[i, j] * (1.0 - a) + values[i + 1, j] * a
    far = values[i, j + 1] * (1.0 - a) + values[i + 1, j + 1] * a
    return np.asarray(near * (1.0 - b) + far * b)
