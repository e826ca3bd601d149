"""Checks that turn what a caller gives into read-only arrays of a stated shape."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
PixelArray = NDArray[np.uint8]

NONE: FloatArray = np.empty(0)
NONE_PAIRS: FloatArray = np.empty((0, 2))
"""Nothing measured, read-only: numbers and pairs of numbers."""
NONE.setflags(write=False)
NONE_PAIRS.setflags(write=False)


def checked(name: str, values: Any, shape: Sequence[int | None]) -> FloatArray:
    """Return `values` as a read-only, finite float64 array of `shape` (None: any length).

    Raises:
        ValueError: the shape differs or a value is not finite.
    """
    if (values is NONE and tuple(shape) == (None,)) or (values is NONE_PAIRS and tuple(shape) == (None, 2)):
        return NONE if values is NONE else NONE_PAIRS  # what records most often have not: nothing to look at
    array = np.array(values, dtype=np.float64)
    if len(array.shape) != len(shape):
        raise _shaped(name, shape, array)
    for want, got in zip(shape, array.shape, strict=True):
        if want is not None and want != got:
            raise _shaped(name, shape, array)
    # a sum of squares is finite where all values are, but for huge ones: one quick look instead of three
    flat = array.ravel()
    if not math.isfinite(flat.dot(flat)) and not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite numbers, got NaN or infinity")
    array.setflags(write=False)
    return array


def _shaped(name: str, shape: Sequence[int | None], array: FloatArray) -> ValueError:
    wanted = tuple("N" if want is None else want for want in shape)
    return ValueError(f"{name}: expected shape {wanted}, got {array.shape}")
