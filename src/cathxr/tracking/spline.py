"""A clamped uniform cubic B-spline on [0, 1], as matrices. The basis is compiled; SciPy's is the reference."""

import numpy as np
from numba import njit
from scipy.interpolate import BSpline

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
        values, slopes = _basis(self.knots, self.spans, np.asarray(at, dtype=np.float64))
        return values, slopes

    def third_derivatives(self) -> FloatArray:
        """Return the third derivative (spans, count) of each piece, where it is constant."""
        middles = (np.arange(self.spans) + 0.5) / self.spans
        spline = BSpline(self.knots, np.eye(self.count), DEGREE)
        return np.asarray(spline.derivative(3)(middles), dtype=np.float64)


@njit(cache=True, nogil=True)
def _basis(knots, spans, at):  # type: ignore[no-untyped-def]
    """Return values and first derivatives (N, spans + 3) of the cubic basis, by the Cox-de Boor recursion."""
    count = len(at)
    values = np.zeros((count, spans + 3))
    slopes = np.zeros((count, spans + 3))
    left = np.empty(4)
    right = np.empty(4)
    basis = np.empty(4)
    lower = np.empty(4)
    for i in range(count):
        t = at[i]
        piece = min(max(int(t * spans), 0), spans - 1)
        span = piece + 3
        basis[0] = 1.0
        for degree in range(1, 4):
            left[degree] = t - knots[span + 1 - degree]
            right[degree] = knots[span + degree] - t
            saved = 0.0
            for r in range(degree):
                share = basis[r] / (right[r + 1] + left[degree - r])
                basis[r] = saved + right[r + 1] * share
                saved = left[degree - r] * share
            basis[degree] = saved
            if degree == 2:
                lower[:3] = basis[:3]
        for r in range(4):
            values[i, piece + r] = basis[r]
        for r in range(3):
            rise = 3.0 * lower[r] / (knots[piece + r + 4] - knots[piece + r + 1])
            slopes[i, piece + r] -= rise
            slopes[i, piece + r + 1] += rise
    return values, slopes
