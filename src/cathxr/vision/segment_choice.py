"""Chooses how to separate the catheter: by an empty picture, by the back-light, or by colour."""

import cv2
import numpy as np

from cathxr.core import PixelArray
from cathxr.vision.segment_background import BackgroundSegmenter
from cathxr.vision.segment_backlit import BackLitSegmenter
from cathxr.vision.segment_colour import ColourSegmenter
from cathxr.vision.segmentation import MatteArray, Segmenter

_COLOURED_SATURATION = 105
"""A back-light is white: under this median saturation (0-255) even where the white balance turns it orange (a blue of
0.6 of the red is 102). Green cloth has 116 and more in the photographs of docs/photographs.md."""


class SegmenterChoice:
    """Holds one segmenter of each kind that this camera may need."""

    def __init__(self, width_px: float, background: PixelArray | None) -> None:
        self._width_px = width_px
        self._background = None if background is None else BackgroundSegmenter(background)
        self._back_lit = BackLitSegmenter(width_px)
        self._is_back_lit = False
        self._colour: ColourSegmenter | None = None

    @property
    def light(self) -> tuple[MatteArray, int] | None:
        """The back-light as last seen and how many pixels each of its own is wide; None where nothing is back-lit."""
        return self._back_lit.light if self._is_back_lit else None

    def for_picture(self, pixels: PixelArray) -> Segmenter:
        """Return the segmenter for a picture: an empty picture when one was given, else by what lies behind."""
        self._is_back_lit = False
        if self._background is not None:
            return self._background
        if is_coloured(pixels):
            self._colour = self._colour or ColourSegmenter()
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
