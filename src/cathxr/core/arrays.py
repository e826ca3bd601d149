"""Checks that turn what a caller gives into read-only arrays of a stated shape."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
PixelArray = NDArray[np.uint8]


def checked(name: str, values: Any, shape: Sequence[int | None]) -> FloatArray:
    """Return `values` as a read-only, finite float64 array of `shape` (None: any length).

    Raises:
        ValueError: the shape differs or a value is not finite.
    """
    array = np.array(values, dtype=np.float64)
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=False)
    )
    if not fits:
        wanted = tuple("N" if want is None else want for want in shape)
        raise ValueError(f"{name}: expected shape {wanted}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite numbers, got NaN or infinity")
    array.setflags(write=False)
    return array
