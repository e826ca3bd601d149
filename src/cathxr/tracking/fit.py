"""One curve in space fitted to the midlines measured in two pictures: a cubic spline by robust Gauss-Newton.

Unknowns: the control points. Residuals: distance of each measured midline point from the projected curve along its
normal; both views' rounded end; a weak prior on how fast the curvature changes, from what catheters do. The inverse
normal matrix is the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.geometry import CameraModel
from cathxr.tracking.band import forward
from cathxr.tracking.fit_kernels import gauss_newton
from cathxr.tracking.guess_kernels import EXTRA_POINTS, carried_to_inlet, fit_points, length_of, spans_of
from cathxr.tracking.pair_work import PairWork
from cathxr.tracking.spline import DEGREE, CubicBasis

_ITERATIONS = 6
_JERK_SIGMA = 0.004
"""Standard deviation, per mm^2, of the change of curvature along a catheter, over one span: a bend of 20 mm radius that
sets in within 12 mm changes at 0.004."""
_ENTRY_SIGMA_MM = np.array([0.05, 1.0, 1.0])
"""The catheter comes out at the inlet's centre, the box's origin, with some play across the axis."""
_ENTRY_SIGMA_RAD = 0.12
"""And about along the axis: by how much a short guide lets it tilt."""
_NEAR_RADII = 8.0
"""The outline of the end is mostly made by this much of the catheter's end, which is sampled more finely."""


@dataclass(frozen=True, eq=False)
class CurveFit:
    """The fitted spline, cap centre at parameter 0, towards the entry.

    control (n, 3) mm; factor (3n, 12): the banded Cholesky factor, see `band.factorise`, of the control points'
    information per mm^2, point by point, from pixel noise and prior; rms_px: of all residuals along the normals;
    tip_gap_px: largest distance of the ends from the projected end, of views without an outline; end_off_px (E,): how
    far each point of the views' ends' outlines lies outside the fitted tube's silhouette; caps (E,): whether it is the
    rounded end's.
    """

    spans: int
    control: FloatArray
    factor: FloatArray
    rms_px: float
    tip_gap_px: float
    end_off_px: FloatArray
    caps: NDArray[np.bool_]

    def points(self, at: FloatArray) -> FloatArray:
        """Return curve points (N, 3) mm at parameters (N,)."""
        return np.asarray(_basis(self.spans).values(at) @ self.control, dtype=np.float64)

    def covariance_of(self, gain: FloatArray) -> FloatArray:
        """Return the covariance (m, m) of a linear function of the control points with derivative `gain` (m, 3n)."""
        half = np.ascontiguousarray(gain.T)
        forward(self.factor, len(self.factor), half)
        return np.asarray(half.T @ half, dtype=np.float64)


def camera_table(cameras: Sequence[CameraModel]) -> FloatArray:
    """Return the cameras' numbers (V, 21) as the compiled fit takes them."""
    return np.stack([each.numbers for each in cameras])


@dataclass(frozen=True, eq=False)
class Guess:
    """A first guess of the curve: its spline and length, mm; at: each measured point's parameter, view by view.

    A negative parameter is that of a point without a part in the curve. prior (n, 4): information on each axis of the
    control points, see `band.factorise`. at_inlet: it goes on to the inlet, x = 0.
    """

    spans: int
    control: FloatArray
    prior: FloatArray
    length_mm: float
    at: FloatArray
    at_inlet: bool


def guess_of(points: FloatArray, starts_at: FloatArray, work: PairWork) -> Guess | None:
    """Return a first guess from points (M, 3) mm, cap centre first; None where they make no curve.

    starts_at: the parameter in [0, 1] (arc fraction of the points) of each measured point, view by view, negative where
    it has no part in the guess. Where the curve's beginning is hidden, it is carried on straight to the inlet.
    """
    room = np.empty((len(points) + EXTRA_POINTS, 3))
    room[: len(points)] = points
    seen_mm = length_of(room, len(points))
    count, at_inlet = carried_to_inlet(room, len(points))
    length = length_of(room, count)
    if not length > 0.0:
        return None
    spans = spans_of(length)
    scale = 1.0 / (length**3 * _JERK_SIGMA) ** 2
    if not fit_points(spans, room, count, length, _jerk_information(spans), scale, work.arrays):
        return None
    size = spans + DEGREE
    arrays = work.arrays
    at = np.where(starts_at < 0.0, -1.0, starts_at * (seen_mm / length))
    return Guess(spans, arrays.control[:size].copy(), arrays.prior[:size].copy(), length, at, at_inlet)


def fit_curve(
    table: FloatArray, work: PairWork, guess: Guess, *, radius_mm: float, without_end: int | None = None
) -> CurveFit | None:
    """Return the curve fitted to two or more views; None where it runs away.

    table: see `camera_table`. work: what the views measured. radius_mm: of the catheter. without_end: a view whose
    end's outline has no part.
    """
    arrays, size = work.arrays, guess.spans + DEGREE
    arrays.control[:size] = guess.control
    arrays.prior[:size] = guess.prior
    arrays.at[: work.points] = guess.at
    entry = np.zeros((3, 2))
    if guess.at_inlet:
        entry[:, 0] = 1.0 / _ENTRY_SIGMA_MM**2
        entry[1:, 1] = 1.0 / (_ENTRY_SIGMA_RAD * guess.length_mm / (DEGREE * guess.spans)) ** 2
    good, rms, gap = gauss_newton(
        guess.spans,
        table,
        entry,
        radius_mm,
        min(0.5, _NEAR_RADII * radius_mm / guess.length_mm),
        _ITERATIONS,
        -1 if without_end is None else without_end,
        work.points,
        work.outline,
        arrays,
    )
    if not good:
        return None
    return CurveFit(
        guess.spans,
        arrays.control[:size].copy(),
        arrays.band[: 3 * size].copy(),
        rms,
        gap,
        arrays.end_off[: work.outline].copy(),
        arrays.end_at[: work.outline] <= 0.0,
    )


@lru_cache(maxsize=32)
def _basis(spans: int) -> CubicBasis:
    return CubicBasis(spans)


@lru_cache(maxsize=32)
def _jerk_information(spans: int) -> FloatArray:
    """Return the information (n, 4) of the third derivative by the parameter, at unit sigma."""
    information = _basis(spans).jerk_information()
    information.setflags(write=False)
    return information
