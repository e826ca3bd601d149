"""One curve in space fitted to the midlines measured in two pictures: a cubic spline by robust Gauss-Newton.

Unknowns: the control points. Residuals: distance of each measured midline point from the projected curve along its
normal; both views' rounded end; a weak prior on how fast the curvature changes, from what catheters do. The inverse
normal matrix is the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel, arc_length
from cathxr.tracking.spline import CubicBasis

_SPAN_MM = 7.0
_MOST_SPANS = 28
_ITERATIONS = 6
_JERK_SIGMA = 0.004
"""Standard deviation, per mm^2, of the change of curvature along a catheter, over one span: a bend of 20 mm radius that
sets in within 12 mm changes at 0.004."""
_HUBER = 2.5


@dataclass(frozen=True, eq=False)
class CurveFit:
    """The fitted spline, cap centre at parameter 0, towards the entry.

    control (n, 3) mm; covariance (3n, 3n) mm^2 of the control points, point by point, from pixel noise and prior;
    rms_px: of all residuals along the normals; tip_gap_px: largest distance of the ends from the projected end.
    """

    basis: CubicBasis
    control: FloatArray
    covariance: FloatArray
    rms_px: float
    tip_gap_px: float

    def points(self, at: FloatArray) -> FloatArray:
        """Return curve points (N, 3) mm at parameters (N,)."""
        return np.asarray(self.basis.values(at) @ self.control, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _View:
    camera: CameraModel
    detection: Detection
    at: FloatArray


def fit_curve(
    cameras: Sequence[CameraModel], detections: Sequence[Detection], start: FloatArray, starts_at: Sequence[FloatArray]
) -> CurveFit:
    """Return the curve fitted to two or more views.

    start (M, 3) mm: a first guess of the curve, cap centre first; starts_at: for each view the parameter in [0, 1] (arc
    fraction of `start`) of each measured point, NaN-free, negative where the point has no part in the guess.
    """
    along = arc_length(start)
    length = float(along[-1])
    basis = CubicBasis(int(np.clip(round(length / _SPAN_MM), 3, _MOST_SPANS)))
    prior = _prior(basis, length)
    prior_of_all = np.kron(prior, np.eye(3))
    control = _initial(basis, start, along / length, prior)
    views = [
        _View(camera, detection, np.asarray(at))
        for camera, detection, at in zip(cameras, detections, starts_at, strict=True)
    ]
    noise = 1.0
    for _ in range(_ITERATIONS):
        views = [_followed(basis, control, view) for view in views]
        rows, residuals, sigmas = _equations(basis, control, views)
        noise = max(1.0, 1.4826 * float(np.median(np.abs(residuals / sigmas))))
        weights = 1.0 / (sigmas * np.minimum(noise, 50.0))
        weights *= np.sqrt(np.minimum(1.0, _HUBER / np.maximum(np.abs(residuals * weights), 1e-12)))
        design = rows * weights[:, None]
        normal = design.T @ design + prior_of_all
        gradient = design.T @ (residuals * weights) - (prior @ control).reshape(-1)
        step = np.linalg.solve(normal, gradient).reshape(-1, 3)
        control = control + step
        if np.abs(step).max() < 1e-4:
            break
    rms, gap = _misfit(basis, control, views)
    return CurveFit(basis, control, np.linalg.inv(normal), rms, gap)


def _prior(basis: CubicBasis, length: float) -> FloatArray:
    """Return the information matrix (n, n) of the prior on the third derivative by arc length, per axis."""
    jerk = basis.third_derivatives() / (length**3 * _JERK_SIGMA)
    tiny = 1e-9 * np.eye(basis.count)  # keeps the matrix regular where no picture sees anything
    return jerk.T @ jerk + tiny


def _initial(basis: CubicBasis, start: FloatArray, at: FloatArray, prior: FloatArray) -> FloatArray:
    """Return control points (n, 3) that follow the first guess to about half a millimetre."""
    rows = basis.values(at) / 0.5
    solved = np.linalg.solve(rows.T @ rows + prior, rows.T @ (start / 0.5))
    return np.asarray(solved, dtype=np.float64)


def _followed(basis: CubicBasis, control: FloatArray, view: _View) -> _View:
    """Return the view with each point's parameter moved to the foot of its perpendicular on the projected curve."""
    at = np.clip(view.at, 0.0, 1.0)
    values, slopes = basis.values_and_slopes(at)
    pixels, jacobian = view.camera.project_with_jacobian(values @ control)
    speed = (jacobian @ (slopes @ control)[:, :, None])[:, :, 0]
    squared = np.maximum((speed * speed).sum(axis=1), 1e-6)
    step = ((view.detection.curve_px - pixels) * speed).sum(axis=1) / squared
    moved = np.where(view.at < 0.0, -1.0, np.clip(at + np.clip(step, -0.03, 0.03), 0.0, 1.0 + 1e-3))
    moved[0] = 0.0  # the cap centre is the curve's beginning, by definition
    moved[moved > 1.0] = -1.0  # beyond the guess: the other view does not see that far back
    return _View(view.camera, view.detection, moved)


def _equations(
    basis: CubicBasis, control: FloatArray, views: Sequence[_View]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return design rows (R, 3n), residuals (R,) px and their sigmas (R,) px of all views."""
    rows, residuals, sigmas = [], [], []
    for view in views:
        used = view.at >= 0.0
        detection = view.detection
        values = basis.values(view.at[used])
        pixels, jacobian = view.camera.project_with_jacobian(values @ control)
        error = detection.curve_px[used] - pixels
        directions = [(detection.normal_px[used], detection.sigma_px[used], slice(None))]
        if used[0] and detection.tip_px is not None and detection.tip_sigma_px is not None:
            end = detection.tip_px - detection.curve_px[0]
            along = end / np.linalg.norm(end)
            directions.append((along[None], np.array([detection.tip_sigma_px]), slice(0, 1)))
        for normals, sigma, which in directions:
            by_point = (normals[:, None, :] @ jacobian[which])[:, 0, :]
            rows.append((values[which][:, :, None] * by_point[:, None, :]).reshape(len(by_point), -1))
            residuals.append((error[which] * normals).sum(axis=1))
            sigmas.append(sigma)
    return np.vstack(rows), np.concatenate(residuals), np.concatenate(sigmas)


def _misfit(basis: CubicBasis, control: FloatArray, views: Sequence[_View]) -> tuple[float, float]:
    """Return (rms px along the normals, largest distance px of an end from the projected end)."""
    squares, gaps = [], []
    for view in views:
        used = view.at >= 0.0
        pixels = view.camera.project(basis.values(view.at[used]) @ control)
        error = view.detection.curve_px[used] - pixels
        squares.append(np.square((error * view.detection.normal_px[used]).sum(axis=1)))
        end = view.camera.project(basis.values(np.zeros(1)) @ control)[0]
        gaps.append(float(np.linalg.norm(view.detection.curve_px[0] - end)))
    return float(np.sqrt(np.mean(np.concatenate(squares)))), max(gaps)
