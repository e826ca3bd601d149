"""Scatterers that stay where they are: a random complex number at every point of a lattice fixed in the volume.

Integer arithmetic only up to the last step, so that NumPy and the shader draw the same numbers.
"""

import math

import numba as nb
import numpy as np

from cathxr.core import FloatArray

_jit = nb.njit(cache=True, nogil=True)

UNIT = 147.80054127099798
"""Root mean square of the complex number made of four independent bytes as in `deviate`: sqrt(4 · (256² - 1) / 12)."""


@_jit
def mixed(key: np.uint32) -> np.uint32:
    """Return a key with its bits thoroughly mixed (two rounds of xor-shift and multiply; constants: C. Wellons)."""
    h = np.uint32(key)
    h = np.uint32(h ^ (h >> np.uint32(16)))
    h = np.uint32(h * np.uint32(0x7FEB352D))
    h = np.uint32(h ^ (h >> np.uint32(15)))
    h = np.uint32(h * np.uint32(0x846CA68B))
    return np.uint32(h ^ (h >> np.uint32(16)))


@_jit
def lattice_key(x: int, y: int, z: int) -> np.uint32:
    """Return the key of a lattice point; coordinates may be negative and wrap at 32 bits."""
    a = np.uint32(x & 0xFFFFFFFF) * np.uint32(0x85EBCA77)
    b = np.uint32(y & 0xFFFFFFFF) * np.uint32(0xC2B2AE3D)
    c = np.uint32(z & 0xFFFFFFFF) * np.uint32(0x27D4EB2F)
    return np.uint32(np.uint32(a + b) + c)


@_jit
def real_part(h: np.uint32) -> float:
    """Return the real part of the deviate that a mixed key holds: the sum of two bytes, about 0."""
    return float((h & np.uint32(255)) + ((h >> np.uint32(8)) & np.uint32(255))) - 255.0


@_jit
def imaginary_part(h: np.uint32) -> float:
    """Return the imaginary part, from the other two bytes."""
    return float(((h >> np.uint32(16)) & np.uint32(255)) + (h >> np.uint32(24))) - 255.0


@_jit
def scatterers_at(x: float, y: float, z: float, out: FloatArray) -> None:
    """Add the scatterer field (real, imaginary) at a point, in cells of the lattice: mean 0, mean square UNIT².

    Linear between the lattice's points, with weights whose squares sum to one.
    """
    x0, y0, z0 = math.floor(x), math.floor(y), math.floor(z)
    fx, fy, fz = x - x0, y - y0, z - z0
    real, imaginary = 0.0, 0.0
    for corner in range(8):
        dx, dy, dz = corner & 1, (corner >> 1) & 1, corner >> 2
        weight = (fx if dx else 1.0 - fx) * (fy if dy else 1.0 - fy) * (fz if dz else 1.0 - fz)
        h = mixed(lattice_key(int(x0) + dx, int(y0) + dy, int(z0) + dz))
        real += weight * real_part(h)
        imaginary += weight * imaginary_part(h)
    squares = (fx * fx + (1.0 - fx) ** 2) * (fy * fy + (1.0 - fy) ** 2) * (fz * fz + (1.0 - fz) ** 2)
    scale = 1.0 / math.sqrt(squares)
    out[0] += real * scale
    out[1] += imaginary * scale
