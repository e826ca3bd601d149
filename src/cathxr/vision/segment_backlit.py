"""The back-lit box: a dark catheter before a bright, slowly varying diffuser."""

from typing import Any

import cv2
import numpy as np
from numba import njit

from cathxr.core import PixelArray
from cathxr.vision.segmentation import Coarse, MatteArray, Window

_LEAST_OPACITY = 0.06
"""Anything fainter than this, against the back-light, is taken for unevenness."""
_OPAQUE = 0.45
"""What stays darker than this share of the back-light after thin things are closed is the inlet block or the frame."""
_BRIGHTEST = 1.1
"""No back-light is brighter, by this, than the picture is when thin dark things are closed."""
_LEAST_STRONG = 40
"""Fewer pixels than this that stand out are no sample of a catheter's own darkness."""
_COARSE_WIDTH = 320
"""The first guess works on pictures about this wide: a 4F catheter is then still over two pixels across."""


class BackLitSegmenter:
    """Matte = 1 - picture / back-light, the back-light estimated from each picture around the catheter.

    width_px: the catheter's expected width in the picture; thinner-than-three-widths dark things are candidates.
    """

    def __init__(self, width_px: float) -> None:
        self._width_px = width_px
        self._light: MatteArray = np.empty((0, 0), dtype=np.float32)
        self._step = 1

    def coarse(self, pixels: PixelArray) -> Coarse:
        """Return where dark, thin things are."""
        height, width = pixels.shape[:2]
        step = self._step = max(1, min(round(width / _COARSE_WIDTH), int(self._width_px / 2.5)))
        # the mean of the four middle pixels of each block: the first guess needs no more, and the rest need not be read
        small = _grey(_bytes(cv2.resize(pixels, (width // step, height // step), interpolation=cv2.INTER_LINEAR)))
        if step == 1:  # else the blocks' means have taken most of the noise away
            small = _bytes(cv2.blur(small, (3, 3)))
        reach = 2 * round(1.6 * self._width_px / step) + 1
        kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (reach, reach))
        closed = _bytes(cv2.morphologyEx(small, cv2.MORPH_CLOSE, kernel, borderType=cv2.BORDER_REPLICATE))
        opacity = _opacity(small, closed)
        block = (closed < _OPAQUE * np.percentile(closed[::8, ::8], 90)).astype(np.uint8)
        opaque = _bytes(cv2.dilate(block, np.ones((5, 5), np.uint8)))
        opacity[opaque > 0] = 0.0
        thin = (opacity > _threshold(opacity)).astype(np.uint8)
        self._light = _light(small, closed, thin | opaque, reach)
        # before a wall, or in a corner of the diffuser, a mean of what lies around is brighter than anything there
        opacity = _opacity(small, np.minimum(self._light, _BRIGHTEST * closed.astype(np.float32)))
        opacity[opaque > 0] = 0.0
        found = opacity > _threshold(opacity)
        return Coarse(found.astype(np.uint8) * 255, step)

    @property
    def light(self) -> tuple[MatteArray, int] | None:
        """The back-light as last estimated, float32 at reduced size, and how many pixels each of its own is wide."""
        return (self._light, self._step) if self._light.size else None

    def matte(self, pixels: PixelArray, window: Window) -> MatteArray:
        """Return 1 - picture / back-light in the window."""
        step = self._step
        rows, columns = self._light.shape
        first = (min(window.x0 // step, columns - 1), min(window.y0 // step, rows - 1))
        last = (min(-(-window.x1 // step), columns), min(-(-window.y1 // step), rows))
        block = self._light[first[1] : max(last[1], first[1] + 1), first[0] : max(last[0], first[0] + 1)]
        size = (block.shape[1] * step, block.shape[0] * step)
        light = np.asarray(cv2.resize(block, size, interpolation=cv2.INTER_LINEAR), dtype=np.float32)
        short = (window.y1 - first[1] * step - light.shape[0], window.x1 - first[0] * step - light.shape[1])
        if max(short) > 0:  # a picture whose size is no multiple of the step leaves a rim
            light = np.pad(light, ((0, max(0, short[0])), (0, max(0, short[1]))), mode="edge")
        top, left = window.y0 - first[1] * step, window.x0 - first[0] * step
        light = light[top : top + window.y1 - window.y0, left : left + window.x1 - window.x0]
        return _opacity(_grey(pixels[window.slices]), light)


def _bytes(picture: Any) -> PixelArray:
    """Return what OpenCV made of bytes as what it is."""
    return np.asarray(picture, dtype=np.uint8)


def _grey(pixels: PixelArray) -> PixelArray:
    """Return a picture without its colours."""
    return pixels if pixels.ndim == 2 else _bytes(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY))


def _opacity(picture: PixelArray, light: MatteArray | PixelArray) -> MatteArray:
    """Return 1 - picture / light, float32."""
    result = np.empty(picture.shape, dtype=np.float32)
    # Whole rows or a part of them: always the same kind of array, so that nothing more is compiled while live.
    _fill_opacity(np.ascontiguousarray(picture), np.ascontiguousarray(light), result)
    return result


@njit(cache=True, nogil=True)
def _fill_opacity(picture, light, result):  # type: ignore[no-untyped-def]
    one = np.float32(1.0)
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            behind = np.float32(light[row, column])
            result[row, column] = one - np.float32(picture[row, column]) / max(behind, one)


def _threshold(opacity: MatteArray) -> float:
    """Return half the opacity of what clearly stands out of the noise."""
    sample = np.sort(opacity[::8, ::8], axis=None)
    middle = float(sample[sample.size // 2])
    noise = 1.4826 * float(np.sort(np.abs(sample - middle))[sample.size // 2])
    floor = max(_LEAST_OPACITY, middle + 6.0 * noise)
    strong = np.sort(opacity[opacity > floor])
    if strong.size < _LEAST_STRONG:
        return floor
    levels, _ = cv2.threshold(np.minimum(255.0 * strong, 255.0).astype(np.uint8), 0, 255, cv2.THRESH_OTSU)
    return max(floor, float(levels) / 255.0)


def _light(small: PixelArray, closed: PixelArray, dark: PixelArray, reach: int) -> MatteArray:
    """Return the back-light: a local mean of the picture that leaves out the catheter and opaque parts.

    The closing alone is flat behind the catheter and rides on the noise; a mean of what lies beside it is neither.
    """
    hidden = cv2.dilate(dark, np.ones((5, 5), np.uint8))
    weight = (1 - hidden).astype(np.float32)
    size = (2 * reach + 1, 2 * reach + 1)
    total = cv2.blur(weight, size, borderType=cv2.BORDER_REFLECT_101)
    mean = cv2.blur(small * weight, size, borderType=cv2.BORDER_REFLECT_101)
    # too few bright pixels near by (inside the inlet block): the closing is all there is
    return np.where(total > 0.1, mean / np.maximum(total, 1e-3), closed.astype(np.float32)).astype(np.float32)
