"""What separates a catheter from its background, whatever the light: the contract every segmenter keeps."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cathxr.core import PixelArray

MatteArray = NDArray[np.float32]

BLACK_LEVEL = 12
"""A picture whose brightest hundredth is below this grey level shows nothing."""
WHITE_LEVEL = 250
"""A picture whose darkest thousandth is above this grey level shows nothing: all of it is saturated."""


@dataclass(frozen=True)
class Window:
    """A block of pixels: columns x0 to x1 - 1, rows y0 to y1 - 1."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Row and column slices into a picture."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    @property
    def corners(self) -> tuple[int, int, int, int]:
        """x0, y0, x1, y1, as compiled code takes them."""
        return self.x0, self.y0, self.x1, self.y1


@dataclass(frozen=True, eq=False)
class Coarse:
    """A first guess on a reduced picture: `mask` uint8 0 or 255, one pixel for `step` x `step` picture pixels."""

    mask: PixelArray
    step: int


class Segmenter(Protocol):
    """Separates catheter from background in one camera's pictures. `coarse` is called first for each picture."""

    def coarse(self, pixels: PixelArray) -> Coarse:
        """Return where a catheter may be, at reduced size."""
        ...

    def matte(self, pixels: PixelArray, window: Window) -> MatteArray:
        """Return float32 (h, w): about 0 on the background and up to 1 on the catheter, half-way at its edge."""
        ...


def blank_reason(pixels: PixelArray) -> str | None:
    """Return why a picture shows nothing at all ("black picture", "white picture"), None when it shows something."""
    sample = pixels[::10, ::10] if pixels.ndim == 2 else pixels[::10, ::10, 1]
    ordered = np.sort(sample, axis=None)
    dark, bright = ordered[ordered.size // 1000], ordered[(99 * ordered.size) // 100]
    if bright < BLACK_LEVEL:
        return "black picture"
    if dark > WHITE_LEVEL:
        return "white picture"
    if int(sample.max()) - int(sample.min()) < 3:
        return "blank picture"
    return None
