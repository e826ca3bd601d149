"""What one picture of the empty, back-lit box says about its light and its focus."""

from dataclasses import dataclass

import cv2
import numpy as np

from cathxr.core import FloatArray, PixelArray, RigCamera, Roi
from cathxr.geometry import CameraModel

LEVELS = (0.6, 0.95)
"""Between these shares of full scale the brightest part of the ROI should be."""
MOST_SATURATED = 0.001
LEAST_EVENNESS = 0.5
MOST_BLUR_PX = 1.3
"""An edge wider than this (standard deviation) costs the tracker accuracy; a sharp lens gives about 0.7."""
_SATURATED_DN = 254
_REBLUR_PX = 1.5
_EDGES = 0.02
_LEAST_STEP = 0.15


@dataclass(frozen=True)
class LightAndFocus:
    """level: of the ROI's brightest part, share of full scale; saturated: share of the ROI's pixels.

    evenness: the ROI's dark end (5 %) over its bright end (95 %). blur_px: standard deviation of the edges' width in
    the whole picture, None where there is no edge to tell by.
    """

    level: float
    saturated: float
    evenness: float
    blur_px: float | None


def light_and_focus(pixels: PixelArray, camera: RigCamera, roi: Roi) -> LightAndFocus:
    """Return the figures of a picture (H, W, 3) BGR or (H, W), uint8, of the empty box with the back light on."""
    grey = pixels if pixels.ndim == 2 else np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    hull = cv2.convexHull(CameraModel.of(camera).project(roi.corners_mm).astype(np.float32))
    mask = np.zeros(grey.shape, dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.rint(hull).astype(np.int32), 1)
    inside = grey[mask > 0]
    if len(inside) == 0:
        return LightAndFocus(0.0, 0.0, 0.0, None)
    # Slow changes only: neither noise nor a speck on the diffuser is unevenness.
    slow = np.asarray(cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 8.0))[mask > 0]
    dark, bright = np.percentile(slow, [5.0, 95.0])
    return LightAndFocus(
        level=float(bright) / 255.0,
        saturated=float((inside >= _SATURATED_DN).mean()),
        evenness=float(dark / max(bright, 1.0)),
        blur_px=blur_px(grey.astype(np.float64)),
    )


def blur_px(grey: FloatArray) -> float | None:
    """Return the standard deviation of the blur of a picture's strongest edges, px; None where there are none.

    An edge blurred once more by a known width loses slope by a known ratio (Zhuo and Sim, 2011).
    """
    step = float(np.percentile(grey, 99.5) - np.percentile(grey, 0.5))
    if step < _LEAST_STEP * 255.0:
        return None
    first, again = _slope(grey), _slope(np.asarray(cv2.GaussianBlur(grey, (0, 0), _REBLUR_PX), dtype=np.float64))
    border = np.zeros(grey.shape, dtype=bool)
    border[8:-8, 8:-8] = True
    # Only the ridge of an edge, where the slope is greatest across it.
    ridge = (first >= np.asarray(cv2.dilate(first, np.ones((3, 3))))) & border & (first > _EDGES * step)
    if ridge.sum() < 20:
        return None
    strong = ridge & (first >= np.percentile(first[ridge], 80.0))
    ratio = np.median(first[strong] / np.maximum(again[strong], 1e-9))
    if ratio <= 1.001:
        return float("inf")
    # The slope itself is taken over three pixels, which blurs by about 0.7 px: that is taken off again.
    measured = _REBLUR_PX / np.sqrt(ratio**2 - 1.0)
    return float(np.sqrt(max(measured**2 - 0.5, 0.0)))


def _slope(grey: FloatArray) -> FloatArray:
    across = cv2.Sobel(grey, cv2.CV_64F, 1, 0, ksize=3, scale=0.125)
    down = cv2.Sobel(grey, cv2.CV_64F, 0, 1, ksize=3, scale=0.125)
    return np.hypot(across, down)
