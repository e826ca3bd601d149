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
    """Return (first control point, 4 values, 4 slopes) of the basis functions alive at `t`: Cox-de Boor, unrolled."""
    piece = min(max(int(t * spans), 0), spans - 1)
    k1, k2, k3 = _knot(piece + 1, spans), _knot(piece + 2, spans), _knot(piece + 3, spans)
    k4, k5, k6 = _knot(piece + 4, spans), _knot(piece + 5, spans), _knot(piece + 6, spans)
    right = (t - k3) / (k4 - k3)
    left = 1.0 - right
    q0 = (k4 - t) / (k4 - k2) * left
    q1 = (t - k2) / (k4 - k2) * left + (k5 - t) / (k5 - k3) * right
    q2 = (t - k3) / (k5 - k3) * right
    w0, w1, w2 = 1.0 / (k4 - k1), 1.0 / (k5 - k2), 1.0 / (k6 - k3)
    values = (
        (k4 - t) * w0 * q0,
        (t - k1) * w0 * q0 + (k5 - t) * w1 * q1,
        (t - k2) * w1 * q1 + (k6 - t) * w2 * q2,
        (t - k3) * w2 * q2,
    )
    r0, r1, r2 = 3.0 * q0 * w0, 3.0 * q1 * w1, 3.0 * q2 * w2
    return piece, values, (-r0, r0 - r1, r1 - r2, r2)


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
        for k in range(4):
            values[i, piece + k] = some[k]
            slopes[i, piece + k] = rise[k]
    return values, slopes
