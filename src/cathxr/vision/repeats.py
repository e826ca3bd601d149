"""Finds pictures that repeat the one before to the last bit: a frozen camera, not a new picture."""

import numpy as np

from cathxr.core import PixelArray

_ROW_STEP = 16
"""Sensor noise makes a sixteenth of the rows differ in any fresh picture, so the full comparison is rarely needed."""


class RepeatCounter:
    """Counts how many pictures in a row, before the present one, were identical to it."""

    def __init__(self) -> None:
        self._last: PixelArray | None = None
        self._count = 0

    def count(self, pixels: PixelArray) -> int:
        """Return how many pictures just before `pixels` were the same to the last bit."""
        last = self._last
        if last is None or last.shape != pixels.shape:
            self._last = pixels.copy()
            self._count = 0
            return 0
        same = np.array_equal(last[::_ROW_STEP], pixels[::_ROW_STEP]) and np.array_equal(last, pixels)
        if same:
            self._count += 1
        else:
            self._count = 0
            np.copyto(last, pixels)
        return self._count

    def reset(self) -> None:
        """Forget what came before."""
        self._last = None
        self._count = 0
