"""A clamped uniform cubic B-spline on [0, 1]. The basis is compiled; SciPy's is the reference."""

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
        values, slopes = _basis(self.spans, np.asarray(at, dtype=np.float64))
        return values, slopes

    def third_derivatives(self) -> FloatArray:
        """Return the third derivative (spans, count) of each piece, where it is constant."""
        middles = (np.arange(self.spans) + 0.5) / self.spans
        spline = BSpline(self.knots, np.eye(self.count), DEGREE)
        return np.asarray(spline.derivative(3)(middles), dtype=np.float64)


@njit(cache=True, nogil=True)
def cubic_pieces(spans, t):  # type: ignore[no-untyped-def]
    """Return (first control point, 4 values, 4 slopes) of the basis functions alive at `t`: Cox-de Boor recursion."""
    piece = min(max(int(t * spans), 0), spans - 1)
    left = np.empty(4)
    right = np.empty(4)
    values = np.empty(4)
    lower = np.empty(3)
    slopes = np.zeros(4)
    values[0] = 1.0
    for degree in range(1, 4):
        left[degree] = t - _knot(piece + 4 - degree, spans)
        right[degree] = _knot(piece + 3 + degree, spans) - t
        saved = 0.0
        for r in range(degree):
            share = values[r] / (right[r + 1] + left[degree - r])
            values[r] = saved + right[r + 1] * share
            saved = left[degree - r] * share
        values[degree] = saved
        if degree == 2:
            lower[:] = values[:3]
    for r in range(3):
        rise = 3.0 * lower[r] / (_knot(piece + r + 4, spans) - _knot(piece + r + 1, spans))
        slopes[r] -= rise
        slopes[r + 1] += rise
    return piece, values, slopes


@njit(cache=True, nogil=True)
def _knot(index, spans):  # type: ignore[no-untyped-def]
    """Return a knot of the clamped uniform knot vector."""
    return min(max((index - 3) / spans, 0.0), 1.0)


@njit(cache=True, nogil=True)
def _basis(spans, at):  # type: ignore[no-untyped-def]
    """Return values and first derivatives (N, spans + 3) of the whole basis."""
    values = np.zeros((len(at), spans + 3))
    slopes = np.zeros((len(at), spans + 3))
    for i in range(len(at)):
        piece, some, rise = cubic_pieces(spans, at[i])
        values[i, piece : piece + 4] = some
        slopes[i, piece : piece + 4] = rise
    return values, slopes
