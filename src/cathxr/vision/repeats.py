"""Finds pictures that repeat the one before to the last bit: a frozen camera, not a new picture."""

import numpy as np

from cathxr.core import Image, PixelArray

_ROW_STEP = 16
"""Sensor noise makes a sixteenth of the rows differ in any fresh picture, so the full comparison is rarely needed."""


class RepeatCounter:
    """Counts how many pictures in a row, before the present one, were identical to it.

    The last picture is kept, not copied; only some of its rows are, to see when its memory has been used again for the
    picture after it. Those rows decide then.
    """

    def __init__(self) -> None:
        self._last: PixelArray | None = None
        self._rows: PixelArray | None = None
        self._count = 0
        self._counted: tuple[int, int] | None = None

    def count(self, image: Image) -> int:
        """Return how many pictures just before `image` were the same to the last bit; asked again, the same."""
        counted = (image.seq, image.t_ns)
        if counted == self._counted:
            return self._count
        self._counted = counted
        pixels = image.pixels
        last, rows = self._last, self._rows
        some = pixels[::_ROW_STEP]
        same = last is not None and rows is not None and rows.shape == some.shape and np.array_equal(rows, some)
        if same and last is not None and not np.may_share_memory(last, pixels):
            same = np.array_equal(last, pixels)
        self._last = pixels
        self._count = self._count + 1 if same else 0
        if not same:
            self._rows = some.copy()
        return self._count

    def reset(self) -> None:
        """Forget what came before."""
        self._last = self._rows = None
        self._counted = None
        self._count = 0
