"""A picture as if it were back-lit, near a predicted line only: so that a matte is followed as a dark catheter is."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray, PixelArray
from cathxr.vision.near_change import darken, spans_near
from cathxr.vision.raw import RawSource
from cathxr.vision.segmentation import MatteArray, Window

_PIECE_WIDTHS = 12.0
_ROOM_WIDTHS = 1.75
_RIM_PX = 8
"""A matte looks about so far around each pixel: nearer to a window's edge it is not what a larger one would give."""
_WHITE = 255.0


class Refreshed(Protocol):
    """A segmenter whose matte can be had without a first guess of the whole picture."""

    def refresh(self, pixels: PixelArray) -> None:
        """Take over a picture's light."""
        ...

    def matte_near(self, pixels: PixelArray, window: Window, spans: NDArray[np.int64]) -> MatteArray:
        """Return the matte, as of `segmentation.Segmenter`, wanted at spans int64 (rows, 2), columns of each row."""
        ...


class NearMatte:
    """Makes such pictures for one camera, in memory that the next one uses again.

    size_px: width and height of its pictures; width_px: the catheter's.
    """

    def __init__(self, size_px: tuple[int, int], width_px: float) -> None:
        self._size, self._width_px = size_px, width_px
        self._picture: PixelArray | None = None
        self._used: list[Window] = []
        self._room = float(round(_ROOM_WIDTHS * width_px) + _RIM_PX)
        self._spans = np.zeros((size_px[1], 2), dtype=np.int64)
        self._light = np.full((2, 2), _WHITE, dtype=np.float32)

    def source(self, pixels: PixelArray, segmenter: Refreshed, path: FloatArray) -> RawSource:
        """Return a picture uint8 (H, W, 3) of the matte near `path` (N, 2) px: dark where the matte is, else white."""
        width, height = self._size
        if self._picture is None:
            self._picture = np.full((height, width, 3), int(_WHITE), dtype=np.uint8)
        for window in self._used:
            self._picture[window.slices] = int(_WHITE)
        segmenter.refresh(pixels)
        pieces = list(_pieces(path, self._size, self._width_px, self._room))
        self._used = [window for window, _, _ in pieces]
        for window, first, last in pieces:
            corners = window.corners
            spans_near(path, first, last, self._room, corners, self._spans)
            matte = segmenter.matte_near(pixels, window, self._spans)
            darken(matte, self._spans, _RIM_PX, corners, self._picture)
        return self._picture, self._light, float(max(self._size)), 1.0


def _pieces(path: FloatArray, size: tuple[int, int], width_px: float, room: float) -> Iterator[tuple[Window, int, int]]:
    """Yield blocks of the picture that hold a line (N, 2) px piece by piece, with `room` px around.

    Each comes with the first and the last of the line's points that it holds.
    """
    steps = np.diff(path, axis=0)
    along = np.zeros(len(path))
    np.cumsum(np.sqrt(steps[:, 0] ** 2 + steps[:, 1] ** 2), out=along[1:])
    pieces = max(1, int(np.ceil(along[-1] / (_PIECE_WIDTHS * width_px))))
    edges = np.searchsorted(along, np.linspace(0.0, along[-1], pieces + 1))
    for first, last in pairwise(edges.tolist()):
        begin, end = max(first - 1, 0), min(last + 1, len(path) - 1)
        low, high = path[begin : end + 1].min(axis=0) - room, path[begin : end + 1].max(axis=0) + room
        x0, y0 = max(0, math.floor(low[0])), max(0, math.floor(low[1]))
        x1, y1 = min(size[0], math.ceil(high[0]) + 1), min(size[1], math.ceil(high[1]) + 1)
        if min(x1 - x0, y1 - y0) > 2 * _RIM_PX:
            yield Window(x0, y0, x1, y1), begin, end
