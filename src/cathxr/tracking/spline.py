"""A clamped uniform cubic B-spline on [0, 1]. The basis is compiled; SciPy's is the reference."""

import numpy as np
from numba import njit

from cathxr.core import FloatArray

DEGREE = 3


class CubicBasis:
    """The basis of `spans` polynomial pieces: spans + 3 control points."""

    def __init__(self, spans: int) -> None:
        if spans < 1:
            raise ValueError(f"spans: expected at least 1, got {spans}")
        self.spans = spans
        self.count = spans + DEGREE
        self.knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, spans + 1), np.ones(DEGREE)])

    def values(self, at: FloatArray) -> FloatArray:
        """Return the basis (N, count) at parameters (N,); outside [0, 1] the first and last piece go on."""
        return self.values_and_slopes(at)[0]

    def slopes(self, at: FloatArray) -> FloatArray:
        """Return the basis' first derivative (N, count)."""
        return self.values_and_slopes(at)[1]

    def values_and_slopes(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return `values` and `slopes` for the price of one."""
        values, slopes = _basis(self.spans, np.asarray(at, dtype=np.float64))
        return values, slopes

    def third_derivatives(self) -> FloatArray:
        """Return the third derivative (spans, count) of each piece, where it is constant."""
        # each piece's slope is a quadratic: its second difference over a quarter is exact
        step = 0.25 / self.spans
        middles = (np.arange(self.spans) + 0.5) / self.spans
        before, at, after = (self.slopes(middles + move) for move in (-step, 0.0, step))
        return np.asarray((before - 2.0 * at + after) / step**2, dtype=np.float64)

    def jerk_information(self) -> FloatArray:
        """Return the information (count, 4) that third derivatives of unit sigma give: element (i, i - d) at (i, d)."""
        jerk = self.third_derivatives()
        whole = jerk.T @ jerk
        result = np.zeros((self.count, DEGREE + 1))
        for apart in range(DEGREE + 1):
            result[apart:, apart] = np.diagonal(whole, -apart)
        return result


_PART = (1.0, 1.0, 0.5, 1.0 / 3.0)
"""The inverse of how many spans lie between two knots: the end's knots coincide, no others."""


@njit(cache=True, nogil=True)
def cubic_pieces(spans, t):  # type: ignore[no-untyped-def]
    """Return (first control point, 4 values, 4 slopes) of the basis functions alive at `t`: Cox-de Boor, unrolled.

    Counted in spans all knots are whole numbers, and what is divided by is one, two or three.
    """
    x = t * spans
    piece = min(max(int(x), 0), spans - 1)
    k1, k2, k4 = max(piece - 2, 0), max(piece - 1, 0), piece + 1
    k5, k6 = min(piece + 2, spans), min(piece + 3, spans)
    right = x - piece
    left = 1.0 - right
    p0, p1 = _PART[k4 - k2] * left, _PART[k5 - piece] * right
    q0 = (k4 - x) * p0
    q1 = (x - k2) * p0 + (k5 - x) * p1
    q2 = right * p1
    w0, w1, w2 = _PART[k4 - k1], _PART[k5 - k2], _PART[k6 - piece]
    values = (
        (k4 - x) * w0 * q0,
        (x - k1) * w0 * q0 + (k5 - x) * w1 * q1,
        (x - k2) * w1 * q1 + (k6 - x) * w2 * q2,
        right * w2 * q2,
    )
    rise = 3.0 * spans
    r0, r1, r2 = rise * q0 * w0, rise * q1 * w1, rise * q2 * w2
    return piece, values, (-r0, r0 - r1, r1 - r2, r2)


@njit(cache=True, nogil=True)
def _basis(spans, at):  # type: ignore[no-untyped-def]
    """Return values and first derivatives (N, spans + 3) of the whole basis."""
    values = np.zeros((len(at), spans + 3))
    slopes = np.zeros((len(at), spans + 3))
    for i in range(len(at)):
        piece, some, rise = cubic_pieces(spans, at[i])
        for k in range(4):
            values[i, piece + k] = some[k]
            slopes[i, piece + k] = rise[k]
    return values, slopes
