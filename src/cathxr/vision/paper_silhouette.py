"""The paper method's silhouette of a back-lit catheter: smoothing, contrast, adaptive threshold, gaps, artefacts."""

from dataclasses import dataclass

import cv2
import numpy as np

from cathxr.core import PixelArray

_LEAST_CONTRAST = 18.0
"""Grey levels between the back-light and the darkest thing in view, below which there is nothing to see."""
_MOST_GAIN = 8.0
_THRESHOLD_BELOW_MEAN = 50.0
"""Of 255 after the contrast adjustment. The window's mean sits near 80 % of the range, so this cuts near half level."""
_INLET_REACH_MM = 15.0
"""How far beside the inlet's centre, and how far from it, a catheter's entry may appear."""
_ENTRY_GAP_MM = 8.0
_FACE_DEPTH_MM = 10.0


@dataclass(frozen=True, eq=False)
class Silhouette:
    """mask uint8 (H, W), 0 or 255: the one silhouette that comes from the inlet; empty when `reason` says why not."""

    mask: PixelArray
    reason: str | None = None


def silhouette(cutout: PixelArray, px_per_mm: float, *, diameter_mm: float, inlet_row: float) -> Silhouette:
    """Return the catheter's silhouette in a rectified cut-out uint8 (H, W) whose first column is x = 0.

    inlet_row: the row of the inlet's centre, px. diameter_mm: the catheter's, which sets every window's size.
    """
    diameter_px = diameter_mm * px_per_mm
    face = round(_FACE_DEPTH_MM * px_per_mm)
    adjusted = contrast_adjusted(np.asarray(cv2.GaussianBlur(cutout, (5, 5), 1.0), dtype=np.uint8), face=face)
    if adjusted is None:
        return Silhouette(np.zeros_like(cutout), "no catheter")
    window = _odd(6.0 * diameter_px)
    dark = cv2.adaptiveThreshold(
        adjusted, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, window, _THRESHOLD_BELOW_MEAN
    )
    closed = np.asarray(cv2.morphologyEx(dark, cv2.MORPH_CLOSE, _disc(0.5 * diameter_px)), dtype=np.uint8)
    cut = face_depth(closed, diameter_px=diameter_px, deepest=face)
    if cut is None:
        return Silhouette(np.zeros_like(cutout), "inlet not visible")
    closed[:, :cut] = 0
    found = from_inlet(closed, px_per_mm, cut=cut, inlet_row=inlet_row, least_area=0.5 * diameter_px * diameter_px)
    without_holes(found.mask, largest_area=0.8 * diameter_px * diameter_px)
    return found


def contrast_adjusted(grey: PixelArray, *, face: int) -> PixelArray | None:
    """Return the picture stretched to 0-255 between its darkest pixel and its brightest tenth, None without contrast.

    face: how many first columns may show the inlet block. It is darker than a translucent catheter, so the darkest
    pixel is looked for beyond it first. The gain is limited, so that an empty picture's noise stays below the
    threshold that follows.
    """
    brightest = float(np.percentile(grey[::2, ::2], 90))
    for darkest in (float(grey[:, face:].min()), float(grey.min())):
        if brightest - darkest >= _LEAST_CONTRAST:
            lifted = np.maximum(grey, np.uint8(darkest)) - np.uint8(darkest)
            gain = min(255.0 / (brightest - darkest), _MOST_GAIN)
            return np.asarray(cv2.convertScaleAbs(lifted, alpha=gain), dtype=np.uint8)
    return None


def without_holes(mask: PixelArray, *, largest_area: float) -> None:
    """Fill, in place, the holes of a 0 or 255 mask up to an area in px: glare on the tube, not the inside of a loop."""
    left, top, width, height = cv2.boundingRect(mask)
    block = mask[top : top + height, left : left + width]
    if block.size == 0:
        return
    # The frame of background joins all that is open to the outside, so that only what is enclosed stays small.
    outside = cv2.copyMakeBorder(cv2.bitwise_not(block), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=255)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(outside, connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] <= largest_area
    small[[0, int(labels[0, 0])]] = False
    block[small[labels[1:-1, 1:-1]]] = 255


def face_depth(mask: PixelArray, *, diameter_px: float, deepest: int) -> int | None:
    """Return how many first columns show the inlet block's face, which perspective brings past x = 0; None if too many.

    The face is dark too, but much wider than a catheter: what survives an opening with twice its diameter.
    """
    strip = mask[:, : deepest + round(2.0 * diameter_px)]
    wide = cv2.morphologyEx(strip, cv2.MORPH_OPEN, np.ones((round(2.2 * diameter_px), 1), dtype=np.uint8))
    covered = np.asarray(wide, dtype=np.uint8).max(axis=0) > 0
    if not covered[: max(2, round(0.3 * diameter_px))].any():
        return 0
    bare = np.flatnonzero(~covered[max(2, round(0.3 * diameter_px)) :])
    if len(bare) == 0:
        return None
    depth = int(bare[0]) + max(2, round(0.3 * diameter_px))
    # A little more, for the rounded corners that closing leaves where the catheter comes out of the face.
    return depth + round(0.4 * diameter_px) if depth <= deepest else None


def from_inlet(mask: PixelArray, px_per_mm: float, *, cut: int, inlet_row: float, least_area: float) -> Silhouette:
    """Return the one component of a 0 or 255 mask that reaches the inlet; all others are artefacts."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    nothing = np.zeros_like(mask)
    large = [label for label in range(1, count) if stats[label, cv2.CC_STAT_AREA] >= least_area]
    reaching = [label for label in large if stats[label, cv2.CC_STAT_LEFT] <= cut + _ENTRY_GAP_MM * px_per_mm]
    entering = [
        label
        for label in reaching
        if abs(_first_row(labels, stats[label], label) - inlet_row) <= _INLET_REACH_MM * px_per_mm
    ]
    if not entering:
        return Silhouette(nothing, "no catheter at the inlet" if large else "no catheter")
    areas = sorted((int(stats[label, cv2.CC_STAT_AREA]) for label in entering), reverse=True)
    if len(areas) > 1 and areas[1] > 0.5 * areas[0]:
        return Silhouette(nothing, "two blobs at the inlet")
    best = max(entering, key=lambda label: int(stats[label, cv2.CC_STAT_AREA]))
    return Silhouette(np.asarray(labels == best, dtype=np.uint8) * np.uint8(255))


def _first_row(labels: np.ndarray, stats: np.ndarray, label: int) -> float:
    """Return the mean row of a component's first column, px."""
    left, top, height = (int(stats[each]) for each in (cv2.CC_STAT_LEFT, cv2.CC_STAT_TOP, cv2.CC_STAT_HEIGHT))
    return top + float(np.flatnonzero(labels[top : top + height, left] == label).mean())


def _odd(size: float) -> int:
    """Return the nearest odd whole number, at least 3."""
    return max(3, 2 * round((size - 1) / 2) + 1)


def _disc(diameter: float) -> np.ndarray:
    """Return a round structuring element about `diameter` px wide."""
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (_odd(diameter), _odd(diameter))))
