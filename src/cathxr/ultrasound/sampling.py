"""Trilinear look-up in the coded volume, as a graphics card does it."""

import numba as nb
import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.ultrasound.field import Scales


def packed(scales: Scales) -> FloatArray:
    """Return the greatest scatter, attenuation and interface, as numbers for the loops."""
    return np.array([scales.scatter_max, scales.attenuation_max_db_cm_mhz, scales.interface_max_per_mm])


@nb.njit(cache=True, nogil=True)
def codes_at(rgba: npt.NDArray[np.uint8], i: float, j: float, k: float, out: FloatArray) -> None:
    """Write the four codes (0 to 1) at voxel coordinates; outside, the nearest voxel's."""
    depth, rows, columns = rgba.shape[0], rgba.shape[1], rgba.shape[2]
    i = min(max(i, 0.0), columns - 1.0)
    j = min(max(j, 0.0), rows - 1.0)
    k = min(max(k, 0.0), depth - 1.0)
    i0, j0, k0 = int(i), int(j), int(k)
    i1, j1, k1 = min(i0 + 1, columns - 1), min(j0 + 1, rows - 1), min(k0 + 1, depth - 1)
    fi, fj, fk = i - i0, j - j0, k - k0
    for c in range(4):
        near = (rgba[k0, j0, i0, c] * (1.0 - fi) + rgba[k0, j0, i1, c] * fi) * (1.0 - fj) + (
            rgba[k0, j1, i0, c] * (1.0 - fi) + rgba[k0, j1, i1, c] * fi
        ) * fj
        far = (rgba[k1, j0, i0, c] * (1.0 - fi) + rgba[k1, j0, i1, c] * fi) * (1.0 - fj) + (
            rgba[k1, j1, i0, c] * (1.0 - fi) + rgba[k1, j1, i1, c] * fi
        ) * fj
        out[c] = (near * (1.0 - fk) + far * fk) / 255.0


@nb.njit(cache=True, nogil=True)
def first_code_at(rgba: npt.NDArray[np.uint8], i: float, j: float, k: float) -> float:
    """Return the first code (0 to 1) at voxel coordinates: impedance."""
    depth, rows, columns = rgba.shape[0], rgba.shape[1], rgba.shape[2]
    i = min(max(i, 0.0), columns - 1.0)
    j = min(max(j, 0.0), rows - 1.0)
    k = min(max(k, 0.0), depth - 1.0)
    i0, j0, k0 = int(i), int(j), int(k)
    i1, j1, k1 = min(i0 + 1, columns - 1), min(j0 + 1, rows - 1), min(k0 + 1, depth - 1)
    fi, fj, fk = i - i0, j - j0, k - k0
    near = (rgba[k0, j0, i0, 0] * (1.0 - fi) + rgba[k0, j0, i1, 0] * fi) * (1.0 - fj) + (
        rgba[k0, j1, i0, 0] * (1.0 - fi) + rgba[k0, j1, i1, 0] * fi
    ) * fj
    far = (rgba[k1, j0, i0, 0] * (1.0 - fi) + rgba[k1, j0, i1, 0] * fi) * (1.0 - fj) + (
        rgba[k1, j1, i0, 0] * (1.0 - fi) + rgba[k1, j1, i1, 0] * fi
    ) * fj
    return float((near * (1.0 - fk) + far * fk) / 255.0)
