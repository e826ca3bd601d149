"""Any catheter before any static background, given a picture of the empty box: what changed, light apart."""

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import PixelArray
from cathxr.vision.near_change import changed_near
from cathxr.vision.segment_difference import (
    COARSE_WIDTH,
    Weights,
    difference,
    grown,
    lit,
    matte_from,
    noise_level,
    reduced,
    sampled,
    standing_out,
    with_channels,
    without_bodies,
)
from cathxr.vision.segmentation import Coarse, MatteArray, Window

_LIGHT_STEP = 4
"""The light's change is estimated on pixels this many coarse pixels wide."""
_LIGHT_REACH = 31
"""And by the median of so many of them: much wider than a catheter, so that no catheter enters it."""
_QUICK_STEP = 2
"""While tracking, on pixels so many times as wide again, each by a few samples of the picture."""
_OCTAVES_PER_LEVEL = 1.0 / 48.0
_OCTAVES = np.log2(np.arange(256, dtype=np.float32) + 4.0)
"""Of each grey level, a little raised so that the darkest are not infinitely far apart."""
_WEIGHTS = Weights(plain=1.0, shade=0.6)
_WEAK, _STRONG = 4.0, 8.0
"""In sigmas of the noise."""
_FAINTEST = 9.0
"""Grey levels below which no difference is believed however quiet the camera is."""
_RELATIVE_ERROR = 0.03
_BODY = 16
"""What is wider than this part of the picture is no catheter."""
_EDGE_SHARE = 0.6
"""A background edge may shift by about this share of a coarse pixel (a knock, the camera's warming)."""


_DARKER, _BAND_SHARE = 0.85, 0.01
"""A catheter before a back-light lets less of the light through than the first, everywhere but on its edges: what is
brighter and more than two pixels of the first guess wide, on more than the second share of it, is a band of another
colour."""
_LEAST_CHANGED = 60


class BackgroundSegmenter:
    """Compares each picture with one of the empty box, after fitting how the light and the white balance changed.

    The change of light is a smooth gain for each channel: the local median of picture / background. It follows
    exposure, white balance, vignetting and wide shadows; a catheter is too thin to move it.

    background: uint8 (H, W) or (H, W, 3), same camera, same place.
    """

    def __init__(self, background: PixelArray) -> None:
        self._background = with_channels(background)
        self._step = max(1, round(background.shape[1] / COARSE_WIDTH))
        self._small = reduced(background, self._step)
        self._tiny = reduced(self._small, _LIGHT_STEP)
        box = np.ones((3, 3), dtype=np.uint8)
        spread = with_channels(np.asarray(cv2.morphologyEx(self._small, cv2.MORPH_GRADIENT, box), dtype=np.uint8))
        self._edges = _EDGE_SHARE * 0.5 * spread.max(axis=2).astype(np.float32)
        self._gain: MatteArray = np.ones((*self._tiny.shape[:2], self._tiny.shape[2]), dtype=np.float32)
        self._gain_px = self._step * _LIGHT_STEP
        self._quick_px = self._gain_px * _QUICK_STEP
        self._quick = sampled(self._background, self._quick_px)
        self._noise = 1.0
        self._faintest = _FAINTEST

    def coarse(self, pixels: PixelArray) -> Coarse:
        """Return where the picture differs from the empty box; also fits the light for the `matte` that follows."""
        small = reduced(self._matched(pixels), self._step)
        self._gain = _gain(reduced(small, _LIGHT_STEP), self._tiny, _LIGHT_REACH)
        self._gain_px = self._step * _LIGHT_STEP
        expected = lit(self._small, self._gain, _LIGHT_STEP, (0, 0))
        values = difference(small, expected, _WEIGHTS.plain, _WEIGHTS.shade)
        noise = noise_level(values)
        self._noise = 1.5 * noise  # a full-size pixel is noisier than the mean of some, but neighbours are alike
        self._faintest = max(_FAINTEST, _STRONG * noise)
        apart = standing_out(values, expected, self._edges, max(noise, _FAINTEST / _STRONG), _RELATIVE_ERROR)
        return Coarse(without_bodies(grown(apart, _WEAK, _STRONG), small.shape[1] // _BODY), self._step)

    def refresh(self, pixels: PixelArray) -> None:
        """Fit the light of a picture for the `matte` that follows; how noisy pictures are is known from before."""
        seen = self._matched(sampled(pixels, self._quick_px))
        self._gain = _gain(seen, self._quick, _LIGHT_REACH // _QUICK_STEP | 1)
        self._gain_px = self._quick_px

    def changed_darker(self, pixels: PixelArray) -> Coarse | None:
        """Return `coarse` where all that changed is darker than the empty picture, else None."""
        changed = self.coarse(pixels)
        inside = changed.mask > 0
        if np.count_nonzero(inside) < _LEAST_CHANGED:
            return None
        small = reduced(self._matched(pixels), self._step).mean(axis=2)
        expected = lit(self._small, self._gain, _LIGHT_STEP, (0, 0)).mean(axis=2)
        bright = (inside & (small > _DARKER * expected)).astype(np.uint8)
        band = cv2.morphologyEx(bright, cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8))
        return None if np.count_nonzero(band) > _BAND_SHARE * np.count_nonzero(inside) else changed

    def matte(self, pixels: PixelArray, window: Window) -> MatteArray:
        """Return the share of each pixel in the window that is not background."""
        rows, columns = window.slices
        picture = np.ascontiguousarray(self._matched(pixels[rows, columns]))
        expected = lit(self._background[rows, columns], self._gain, self._gain_px, (window.y0, window.x0))
        values = difference(picture, expected, _WEIGHTS.plain, _WEIGHTS.shade)
        return matte_from(values, self._noise, self._faintest, plateau_px=self._step + 1)

    def matte_near(self, pixels: PixelArray, window: Window, spans: NDArray[np.int64]) -> MatteArray:
        """Return `matte`, right where spans int64 (rows, 2), first and stop column of each row, say and 8 px inside."""
        rows, columns = window.slices
        picture = np.ascontiguousarray(self._matched(pixels[rows, columns]))
        values = changed_near(
            picture, self._background, self._gain, self._gain_px, window.corners, spans, _WEIGHTS.plain, _WEIGHTS.shade
        )
        return matte_from(values, self._noise, self._faintest, plateau_px=self._step + 1)

    def _matched(self, pixels: PixelArray) -> PixelArray:
        """Return the picture with as many channels as the background."""
        channels = self._background.shape[2]
        if pixels.ndim == 3 and pixels.shape[2] == 3 and channels == 1:
            return with_channels(np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8))
        if pixels.ndim == 2 and channels == 3:
            return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
        return with_channels(pixels)


def _gain(picture: PixelArray, background: PixelArray, reach: int) -> MatteArray:
    """Return the smooth gain float32 (h, w, C) between two reduced pictures uint8 (h, w, C).

    reach: it is the median of so many pixels each way, odd.
    """
    ratio = _OCTAVES[picture] - _OCTAVES[background]
    middle = np.median(ratio[::3, ::3].reshape(-1, ratio.shape[2]), axis=0)
    levels = np.clip((ratio - middle) / _OCTAVES_PER_LEVEL + 128.5, 0, 255).astype(np.uint8)
    reach = min(reach, 2 * (min(levels.shape[:2]) // 2) - 1)
    median = np.asarray(cv2.medianBlur(levels, max(3, reach)), dtype=np.float32)
    smooth = np.asarray(cv2.GaussianBlur(median, (5, 5), 0), dtype=np.float32).reshape(levels.shape)
    return np.asarray(np.exp2((smooth - 128.0) * _OCTAVES_PER_LEVEL + middle), dtype=np.float32)
