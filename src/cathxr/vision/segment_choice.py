"""Chooses how to separate the catheter: by an empty picture, by the back-light, or by colour."""

import cv2
import numpy as np

from cathxr.core import PixelArray
from cathxr.vision.segment_background import BackgroundSegmenter
from cathxr.vision.segment_backlit import BackLitSegmenter
from cathxr.vision.segment_colour import ColourSegmenter
from cathxr.vision.segmentation import Coarse, MatteArray, Segmenter, Window

_COLOURED_SATURATION = 105
"""A back-light is white: under this median saturation (0-255) even where the white balance turns it orange (a blue of
0.6 of the red is 102). Green cloth has 116 and more in the photographs of docs/photographs.md."""


_REACH = 9
"""How many pixels of a first guess beside what changed belong to it."""


class DarkChange:
    """A dark catheter before a back-light, where the empty picture says what else is dark.

    The first guess is what both ways of looking agree on; the matte, and following it near its prediction, are those of
    the back-light, which are finer.
    """

    def __init__(self, back_lit: BackLitSegmenter, changed: Coarse) -> None:
        self._back_lit, self._changed = back_lit, changed

    def coarse(self, pixels: PixelArray) -> Coarse:
        """Return what is dark before the back-light and was not there in the empty picture."""
        found = self._back_lit.coarse(pixels)
        size = (found.mask.shape[1], found.mask.shape[0])
        grown = cv2.dilate(self._changed.mask, np.ones((_REACH, _REACH), dtype=np.uint8))
        changed = cv2.resize(grown, size, interpolation=cv2.INTER_NEAREST)
        return Coarse(np.asarray(cv2.bitwise_and(found.mask, changed), dtype=np.uint8), found.step)

    def matte(self, pixels: PixelArray, window: Window) -> MatteArray:
        """Return 1 - picture / back-light in the window."""
        return self._back_lit.matte(pixels, window)


class SegmenterChoice:
    """Holds one segmenter of each kind that this camera may need."""

    def __init__(self, width_px: float, background: PixelArray | None) -> None:
        self._background = None if background is None else BackgroundSegmenter(background)
        self._coloured = background is not None and is_coloured(background)
        self._back_lit = BackLitSegmenter(width_px)
        self._is_back_lit = False
        self._colour: ColourSegmenter | None = None
        self._other: BackgroundSegmenter | ColourSegmenter | None = None

    @property
    def light(self) -> tuple[MatteArray, int] | None:
        """The back-light as last seen and how many pixels each of its own is wide; None where nothing is back-lit."""
        return self._back_lit.light if self._is_back_lit else None

    @property
    def refreshed(self) -> BackgroundSegmenter | ColourSegmenter | None:
        """What separates the catheter where nothing is back-lit, once a picture has been looked at; else None."""
        return self._other

    def for_picture(self, pixels: PixelArray) -> Segmenter:
        """Return the segmenter for a picture: an empty picture when one was given, else by what lies behind."""
        self._is_back_lit, self._other = False, None
        if self._background is not None:
            changed = None if self._coloured else self._background.changed_darker(pixels)
            if changed is None:
                self._other = self._background
                return self._background
            self._is_back_lit = True
            return DarkChange(self._back_lit, changed)
        if is_coloured(pixels):
            self._other = self._colour = self._colour or ColourSegmenter()
            return self._colour
        self._is_back_lit = True
        return self._back_lit


def is_coloured(pixels: PixelArray) -> bool:
    """Return whether most of the picture has a colour, so that it is no back-light."""
    if pixels.ndim == 2:
        return False
    small = np.ascontiguousarray(pixels[::16, ::16])
    hsv = cv2.cvtColor(small, cv2.COLOR_BGR2HSV)
    return float(np.median(hsv[..., 1])) > _COLOURED_SATURATION
