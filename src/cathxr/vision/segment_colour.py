"""A catheter of another colour than the box, without back-light and without a picture of the empty box."""

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import PixelArray
from cathxr.vision.segment_difference import (
    COARSE_WIDTH,
    Weights,
    difference,
    enlarged,
    grown,
    matte_from,
    noise_level,
    not_touching,
    reduced,
    without_bodies,
)
from cathxr.vision.segmentation import Coarse, MatteArray, Window

_LIGHT_STEP = 4
_LIGHT_REACH = 25
_WEIGHTS = Weights(plain=0.5, shade=0.08)
"""Seams, creases and shadows of the lining differ from it in brightness, a catheter differs in colour."""
_WEAK, _STRONG = 4.0, 8.0
_FAINTEST = 9.0
_BODY = 16
"""What is wider than this part of the picture is no catheter."""
_OF_STRONGEST = 0.3
"""Reflections that tint the lining are far fainter than a catheter; some part of a catheter stands out clearly."""
_SEAM = np.ones((3, 3), dtype=np.uint8)
"""Seams between the lining's panels are dark lines thinner than this, in pixels of the first guess."""
_SAME_HUE_RAD = 0.7
_SAME_SATURATION = 0.35
_RIM = 5
"""Light pixels (about 8 picture pixels each at 1280 wide) around what is not lining, where the two mix."""


class ColourSegmenter:
    """Compares each picture with its own wide median: the lining in that light, for the catheter is too thin to count.

    Only where that median has the picture's dominant colour is a catheter looked for: not on frames, lamps or beyond.
    """

    def __init__(self) -> None:
        self._step = 1
        self._lining: PixelArray = np.zeros((1, 1, 3), dtype=np.uint8)
        self._noise = 1.0
        self._faintest = _FAINTEST

    def coarse(self, pixels: PixelArray) -> Coarse:
        """Return what differs in colour from the lining around it."""
        picture = _coloured(pixels)
        self._step = max(1, round(picture.shape[1] / COARSE_WIDTH))
        small = reduced(picture, self._step)
        tiny = reduced(small, _LIGHT_STEP)
        self._lining = _lining(tiny)
        expected = enlarged(self._lining, _LIGHT_STEP, small.shape[:2], (0, 0))
        values = difference(small, expected, _WEIGHTS.plain, _WEIGHTS.shade)
        inside = _enlarged_mask(lining_mask(self._lining), small.shape[:2])
        noise = noise_level(values)
        self._noise = 1.5 * noise  # a full-size pixel is noisier than the mean of some, but neighbours are alike
        self._faintest = strong = max(_FAINTEST, _STRONG * noise)
        weak = strong * _WEAK / _STRONG
        candidates = np.where(values > weak, inside, np.uint8(0))
        values[without_bodies(candidates, small.shape[1] // _BODY) == 0] = 0.0
        certain = values[values > strong]
        if certain.size:
            strong = max(strong, _OF_STRONGEST * float(np.percentile(certain, 95)))
        found = cv2.morphologyEx(grown(values, weak, strong), cv2.MORPH_OPEN, _SEAM)
        # Frame parts hang together with what is not lining; a catheter hangs in front of the lining.
        outside = np.asarray(inside == 0, dtype=np.uint8)
        return Coarse(not_touching(np.asarray(found, dtype=np.uint8), outside), self._step)

    def refresh(self, pixels: PixelArray) -> None:
        """Take over a picture's lining for the `matte` that follows; how noisy pictures are is known from before."""
        rows, columns = self._lining.shape[:2]
        step = self._step * _LIGHT_STEP
        tiny = reduced(_coloured(pixels[: rows * step, : columns * step]), step)
        self._lining = _lining(tiny)

    def matte(self, pixels: PixelArray, window: Window) -> MatteArray:
        """Return the share of each pixel in the window that has another colour than the lining."""
        rows, columns = window.slices
        picture = np.ascontiguousarray(_coloured(pixels[rows, columns]))
        expected = enlarged(self._lining, _LIGHT_STEP * self._step, picture.shape[:2], (window.y0, window.x0))
        values = difference(picture, expected, _WEIGHTS.plain, _WEIGHTS.shade)
        return matte_from(values, self._noise, self._faintest, plateau_px=self._step + 1)

    def matte_near(self, pixels: PixelArray, window: Window, spans: NDArray[np.int64]) -> MatteArray:
        """Return `matte`; spans, the columns that are wanted of each row, are too few to be worth a difference."""
        del spans
        return self.matte(pixels, window)


def _lining(tiny: PixelArray) -> PixelArray:
    """Return a reduced picture uint8 (h, w, 3) without what is as thin as a catheter."""
    reach = min(_LIGHT_REACH, 2 * (min(tiny.shape[:2]) // 2) - 1)
    return np.asarray(cv2.medianBlur(tiny, max(3, reach)), dtype=np.uint8)


def lining_mask(lining: PixelArray) -> PixelArray:
    """Return where a small, median-filtered picture uint8 (h, w, 3) has its dominant colour, 0 or 1, its rim left out.

    The dominant colour is the mean, weighted by saturation, of the pixels nearest to the most frequent hue.
    """
    lab = cv2.cvtColor(lining, cv2.COLOR_BGR2LAB).astype(np.float32)[..., 1:] - 128.0
    strength = np.hypot(lab[..., 0], lab[..., 1])
    hue = np.arctan2(lab[..., 1], lab[..., 0])
    counts, edges = np.histogram(hue, bins=36, range=(-np.pi, np.pi), weights=strength)
    best = int(np.argmax(counts + np.roll(counts, 1) + np.roll(counts, -1)))
    dominant = 0.5 * (edges[best] + edges[best + 1])
    apart = np.abs(np.angle(np.exp(1j * (hue - dominant))))
    same_hue = apart < _SAME_HUE_RAD
    usual = float(np.median(strength[same_hue]))
    same = (same_hue & (strength > _SAME_SATURATION * usual)).astype(np.uint8)
    # The picture's own edge is no rim: the lining goes on behind it.
    return np.asarray(cv2.erode(same, np.ones((_RIM, _RIM), dtype=np.uint8), borderValue=1), dtype=np.uint8)


def _enlarged_mask(mask: PixelArray, shape: tuple[int, ...]) -> PixelArray:
    return np.asarray(cv2.resize(mask, (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST), dtype=np.uint8)


def _coloured(pixels: PixelArray) -> PixelArray:
    """Return the picture in BGR."""
    colour = pixels if pixels.ndim == 3 else cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR)
    return np.asarray(colour, dtype=np.uint8)
