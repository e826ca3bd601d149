"""Finds pictures that repeat the one before to the last bit: a frozen camera, not a new picture."""

import numpy as np
from numba import njit

from cathxr.core import Image, PixelArray

_LEAST_STEP = 16
_MOST_ROWS = 45
"""Sensor noise makes every such sample of rows differ in any fresh picture, so the full comparison is rarely needed."""


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
        some = pixels[:: max(_LEAST_STEP, -(-len(pixels) // _MOST_ROWS))]
        last, rows = self._last, self._rows
        same = last is not None and rows is not None and rows.shape == some.shape and _equal(rows, some)
        if same and last is not None and not np.may_share_memory(last, pixels):
            same = np.array_equal(last, pixels)
        self._last = pixels
        self._count = self._count + 1 if same else 0
        if rows is None or rows.shape != some.shape:
            self._rows = some.copy()
        elif not same:
            np.copyto(rows, some)
        return self._count

    def reset(self) -> None:
        """Forget what came before."""
        self._last = None
        self._counted = None
        self._count = 0


def _equal(rows: PixelArray, some: PixelArray) -> bool:
    """Return whether two stacks of rows are the same; the first byte that differs ends the comparison."""
    if not (rows.flags.c_contiguous and some[0].flags.c_contiguous):
        return np.array_equal(rows, some)
    return bool(_same(rows.reshape(len(rows), -1), some.reshape(len(some), -1)))


@njit(cache=True, nogil=True)
def _same(rows, some):  # type: ignore[no-untyped-def]
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            if rows[i, j] != some[i, j]:
                return False
    return True
