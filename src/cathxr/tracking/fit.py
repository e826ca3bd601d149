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

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel, arc_length
from cathxr.tracking.fit_kernels import end_residuals, gauss_newton, misfit, packed
from cathxr.tracking.spline import DEGREE, CubicBasis

_SPAN_MM = 7.0
_FEWEST_SPANS, _MOST_SPANS = 3, 28
_ITERATIONS = 6
_JERK_SIGMA = 0.004
"""Standard deviation, per mm^2, of the change of curvature along a catheter, over one span: a bend of 20 mm radius that
sets in within 12 mm changes at 0.004."""
_START_MM = 0.5
LEAST_OUTLINE = 7
"""Fewer points of the end's outline than this do not say where it is."""
HIDDEN_MM = 25.0
"""How much of the catheter's beginning may be hidden by the inlet before the entry is a guess too far."""
ALIGNED = 0.25
"""Least cosine between the beginning's direction and the insertion axis for extrapolating the entry."""
_CHORD_MM = 5.0
_ENTRY_SIGMA_MM = np.array([0.05, 1.0, 1.0])
"""The catheter comes out at the inlet's centre, the box's origin, with some play across the axis."""
_ENTRY_SIGMA_RAD = 0.12
"""And about along the axis: by how much a short guide lets it tilt."""
_NO_PART_PX = 1e4
_NEAR_RADII = 8.0
"""The outline of the end is mostly made by this much of the catheter's end, which is sampled more finely."""


@dataclass(frozen=True, eq=False)
class CurveFit:
    """The fitted spline, cap centre at parameter 0, towards the entry.

    control (n, 3) mm; information (3n, 3n) per mm^2 of the control points, point by point: its inverse is their
    covariance from pixel noise and prior; rms_px: of all residuals along the normals; tip_gap_px: largest distance of
    the ends from the projected end, of views without an outline; ends_off_px: for each view, how far each point of its
    end's outline lies outside the fitted tube's silhouette; caps: whether it is the rounded end's.
    """

    basis: CubicBasis
    control: FloatArray
    information: FloatArray
    rms_px: float
    tip_gap_px: float
    ends_off_px: tuple[FloatArray, ...] = ()
    caps: tuple[NDArray[np.bool_], ...] = ()

    def points(self, at: FloatArray) -> FloatArray:
        """Return curve points (N, 3) mm at parameters (N,)."""
        return np.asarray(self.basis.values(at) @ self.control, dtype=np.float64)

    def covariance_of(self, gain: FloatArray) -> FloatArray:
        """Return the covariance (m, m) of a linear function of the control points with derivative `gain` (m, 3n)."""
        return np.asarray(gain @ np.linalg.solve(self.information, gain.T), dtype=np.float64)


def camera_table(cameras: Sequence[CameraModel]) -> FloatArray:
    """Return the cameras' numbers (V, 21) as the compiled fit takes them."""
    return np.stack(
        [
            packed(
                each.camera_from_box.rotation,
                each.camera_from_box.translation_mm,
                np.concatenate([each.intrinsics.focal_px, each.intrinsics.centre_px, each.intrinsics.distortion]),
            )
            for each in cameras
        ]
    )


@dataclass(frozen=True, eq=False)
class Guess:
    """A first guess of the curve: its spline and length, mm; at: each measured point's parameter, view by view.

    A negative parameter is that of a point without a part in the curve. at_inlet: it goes on to the inlet, x = 0.
    """

    basis: CubicBasis
    control: FloatArray
    prior: FloatArray
    length_mm: float
    at: FloatArray
    at_inlet: bool


def guess_of(points: FloatArray, starts_at: Sequence[FloatArray]) -> Guess:
    """Return a first guess from points (M, 3) mm, cap centre first.

    starts_at: for each view the parameter in [0, 1] (arc fraction of the points) of each measured point, negative where
    it has no part in the guess. Where the curve's beginning is hidden, it is carried on straight to the inlet.
    """
    seen_mm = float(arc_length(points)[-1])
    reached = to_inlet(points)
    at_inlet = reached is not None
    points = points if reached is None else reached
    along = arc_length(points)
    length = float(along[-1])
    starts_at = [np.where(each < 0.0, -1.0, each * seen_mm / length) for each in starts_at]
    basis = _basis(int(np.clip(round(length / _SPAN_MM), _FEWEST_SPANS, _MOST_SPANS)))
    prior = _jerk_information(basis.spans) / (length**3 * _JERK_SIGMA) ** 2
    prior = prior + 1e-9 * np.eye(basis.count)  # keeps the matrix regular where no picture sees anything
    rows = basis.values(along / length) / _START_MM
    control = np.linalg.solve(rows.T @ rows + prior, rows.T @ (points / _START_MM))
    return Guess(basis, np.asarray(control, dtype=np.float64), prior, length, np.concatenate(starts_at), at_inlet)


def to_inlet(points: FloatArray) -> FloatArray | None:
    """Return a curve (M, 3) mm, tip first, that ends at x = 0: cut there, or carried on straight where that is near.

    None where it neither crosses x = 0 nor makes for it.
    """
    crossing = np.flatnonzero((points[:-1, 0] > 0.0) & (points[1:, 0] <= 0.0))
    if crossing.size:
        last = int(crossing[-1])
        if last >= 1:
            share = points[last, 0] / (points[last, 0] - points[last + 1, 0])
            entry = points[last] + share * (points[last + 1] - points[last])
            # what lies behind the inlet's plane is held as it lies in front of it
            return np.asarray(np.vstack([points[: last + 1], entry]), dtype=np.float64)
        return None
    behind = np.linalg.norm(points - points[-1], axis=1)
    chord = points[-1] - points[int(np.argmax(behind < _CHORD_MM))]
    length = float(np.linalg.norm(chord))
    missing = float(points[-1, 0])
    if length < 1e-6 or missing > HIDDEN_MM or chord[0] > -ALIGNED * length:
        return None
    if missing < _START_MM:
        return None if missing < 0.0 else points
    count = max(1, round(missing / 1.0))
    steps = np.arange(1, count + 1)[:, None] / count
    return np.asarray(np.vstack([points, points[-1] - steps * chord * (missing / chord[0])]), dtype=np.float64)


def fit_curve(
    table: FloatArray,
    detections: Sequence[Detection],
    guess: Guess,
    *,
    radius_mm: float,
    without_end: int | None = None,
) -> CurveFit:
    """Return the curve fitted to two or more views.

    table: see `camera_table`. radius_mm: of the catheter. without_end: a view whose end's outline has no part.
    """
    basis = guess.basis
    at = guess.at.copy()
    view = np.repeat(np.arange(len(detections)), [len(each.curve_px) for each in detections])
    curve = np.concatenate([each.curve_px for each in detections])
    normal = np.concatenate([each.normal_px for each in detections])
    sigma = np.concatenate([each.sigma_px for each in detections])
    ends = [_end(each) for each in detections]
    tip_along = np.stack([along for along, _ in ends])
    tip_sigma = np.array([spread for _, spread in ends])
    entry = np.zeros((3, 2))
    if guess.at_inlet:
        entry[:, 0] = 1.0 / _ENTRY_SIGMA_MM**2
        entry[1:, 1] = 1.0 / (_ENTRY_SIGMA_RAD * guess.length_mm / (DEGREE * basis.spans)) ** 2
    half = np.concatenate([each.half_width_px for each in detections])
    end = np.concatenate([each.end_px for each in detections])
    end_sigma = np.concatenate([each.end_sigma_px for each in detections])
    end_view = np.repeat(np.arange(len(detections)), [len(each.end_px) for each in detections])
    if without_end is not None:
        end_sigma = np.where(end_view == without_end, _NO_PART_PX, end_sigma)
    outlined = np.array([len(each.end_px) >= LEAST_OUTLINE for each in detections])
    end_at = np.zeros(len(end))
    reach = min(0.5, _NEAR_RADII * radius_mm / guess.length_mm)
    control, information, balls = gauss_newton(
        basis.spans,
        guess.control,
        guess.prior,
        entry,
        table,
        at,
        view,
        curve,
        normal,
        sigma,
        half,
        end_at,
        end_view,
        end,
        end_sigma,
        tip_along,
        tip_sigma,
        outlined,
        radius_mm,
        reach,
        _ITERATIONS,
    )
    rms, gap = misfit(basis.spans, control, table, at, view, curve, normal)
    off = end_residuals(basis.spans, control, table, end_at, end_view, end, balls)
    ends_off = tuple(off[end_view == which] for which in range(len(detections)))
    caps = tuple((end_at <= 0.0)[end_view == which] for which in range(len(detections)))
    return CurveFit(basis, control, information, float(rms), float(gap), ends_off, caps)


def _end(detection: Detection) -> tuple[FloatArray, float]:
    """Return (unit direction of the midline at the tip, standard deviation of the tip along it), px."""
    assert detection.tip_px is not None
    assert detection.tip_sigma_px is not None
    along = detection.tip_px - detection.curve_px[0]
    return along / max(float(np.linalg.norm(along)), 1e-9), detection.tip_sigma_px


@lru_cache(maxsize=_MOST_SPANS)
def _basis(spans: int) -> CubicBasis:
    return CubicBasis(spans)


@lru_cache(maxsize=_MOST_SPANS)
def _jerk_information(spans: int) -> FloatArray:
    """Return the information (n, n) of the third derivative by the parameter, at unit sigma."""
    jerk = _basis(spans).third_derivatives()
    information = jerk.T @ jerk
    information.setflags(write=False)
    return information
