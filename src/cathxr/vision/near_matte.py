"""A picture as if it were back-lit, near a predicted line only: so that a matte is followed as a dark catheter is."""

from itertools import pairwise
from typing import Protocol

import numpy as np

from cathxr.core import FloatArray, PixelArray
from cathxr.vision.raw import RawSource
from cathxr.vision.segmentation import MatteArray, Window

_PIECE_WIDTHS = 12.0
_ROOM_WIDTHS = 2.5
_RIM_PX = 8
"""A matte looks about so far around each pixel: nearer to a window's edge it is not what a larger one would give."""
_WHITE = 255.0


class Refreshed(Protocol):
    """A segmenter whose matte can be had without a first guess of the whole picture."""

    def refresh(self, pixels: PixelArray) -> None:
        """Take over a picture's light."""
        ...

    def matte(self, pixels: PixelArray, window: Window) -> MatteArray:
        """Return the matte, as of `segmentation.Segmenter`."""
        ...


class NearMatte:
    """Makes such pictures for one camera, in memory that the next one uses again.

    size_px: width and height of its pictures; width_px: the catheter's.
    """

    def __init__(self, size_px: tuple[int, int], width_px: float) -> None:
        self._size, self._width_px = size_px, width_px
        self._picture: PixelArray | None = None
        self._used: list[Window] = []
        self._light = np.full((2, 2), _WHITE, dtype=np.float32)

    def source(self, pixels: PixelArray, segmenter: Refreshed, path: FloatArray) -> RawSource:
        """Return a picture uint8 (H, W, 3) of the matte near `path` (N, 2) px: dark where the matte is, else white."""
        width, height = self._size
        if self._picture is None:
            self._picture = np.full((height, width, 3), int(_WHITE), dtype=np.uint8)
        for window in self._used:
            self._picture[window.slices] = int(_WHITE)
        segmenter.refresh(pixels)
        self._used = list(_windows(path, self._size, self._width_px))
        for window in self._used:
            matte = segmenter.matte(pixels, window)
            inner, part = _inner(window, self._size)
            self._picture[inner.slices] = np.rint(_WHITE * (1.0 - matte[part])).astype(np.uint8)[..., None]
        return self._picture, self._light, float(max(self._size)), 1.0


def _windows(path: FloatArray, size: tuple[int, int], width_px: float) -> list[Window]:
    """Return blocks of the picture that hold a line (N, 2) px piece by piece, with room around."""
    room = round(_ROOM_WIDTHS * width_px) + _RIM_PX
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    pieces = max(1, int(np.ceil(along[-1] / (_PIECE_WIDTHS * width_px))))
    edges = np.searchsorted(along, np.linspace(0.0, along[-1], pieces + 1))
    result = []
    for first, last in pairwise(edges):
        piece = path[max(first - 1, 0) : last + 2]
        low, high = np.floor(piece.min(axis=0)), np.ceil(piece.max(axis=0))
        x0, y0 = (int(np.clip(low[i] - room, 0, size[i])) for i in range(2))
        x1, y1 = (int(np.clip(high[i] + room + 1, 0, size[i])) for i in range(2))
        if x1 - x0 > 4 * _RIM_PX and y1 - y0 > 4 * _RIM_PX:
            result.append(Window(x0, y0, x1, y1))
    return result


def _inner(window: Window, size: tuple[int, int]) -> tuple[Window, tuple[slice, slice]]:
    """Return a window without its rim, the picture's own edge apart, and that part of what belongs to the window."""
    x0, y0 = window.x0 + (_RIM_PX if window.x0 > 0 else 0), window.y0 + (_RIM_PX if window.y0 > 0 else 0)
    x1 = window.x1 - (_RIM_PX if window.x1 < size[0] else 0)
    y1 = window.y1 - (_RIM_PX if window.y1 < size[1] else 0)
    part = (slice(y0 - window.y0, y1 - window.y0), slice(x0 - window.x0, x1 - window.x0))
    return Window(x0, y0, x1, y1), part
