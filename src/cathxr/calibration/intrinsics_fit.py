"""The lens and the board's poses that explain the corners best, by least squares; and how sure the lens is then.

Zhang, "A flexible new technique for camera calibration", PAMI 2000, with OpenCV's lens model. The poses are eliminated
(Schur complement), so that a round costs hardly more than the projections.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cathxr.core import FloatArray

LENS = 9
"""focal x y, centre x y, k1 k2 p1 p2 k3: the order of `Provenance.covariance`."""

_POSE = 6
_ROUNDS = 40
_REWEIGHTED = 3
_HUBER = 3.0
"""A corner's residual counts in full up to this many standard deviations."""
_LEAST_NOISE_PX = 0.002
"""No real corner is known better: keeps made-up, exact corners from giving standard deviations of zero."""


@dataclass(frozen=True, eq=False)
class BoardCorners:
    """One view for the fit: points_mm (N, 3) of the board, corners_px (N, 2) in the picture."""

    points_mm: FloatArray
    corners_px: FloatArray


@dataclass(frozen=True, eq=False)
class LensFit:
    """What came of it.

    lens (9,); poses (V, 6): rotation vector and translation, mm, camera from board; residuals_px: found minus computed,
    (N, 2) a view; noise_px: standard deviation of one coordinate; covariance (9, 9), the prior counted in; inflation:
    by how much variances were raised because errors within a view are alike.
    """

    lens: FloatArray
    poses: FloatArray
    residuals_px: tuple[FloatArray, ...]
    noise_px: float
    covariance: FloatArray
    inflation: float

    @property
    def rms_px(self) -> float:
        """Root mean square distance between corners found and computed, as OpenCV counts it."""
        return float(np.sqrt(np.mean(np.sum(np.concatenate(self.residuals_px) ** 2, axis=1))))

    @property
    def view_rms_px(self) -> FloatArray:
        """The same for each view, (V,)."""
        return np.array([np.sqrt(np.mean(np.sum(each**2, axis=1))) for each in self.residuals_px])


def fit_lens(
    views: Sequence[BoardCorners], lens: FloatArray, poses: FloatArray, *, prior_std: FloatArray, robust: bool = True
) -> LensFit:
    """Return the fit from a start lens (9,) and poses (V, 6).

    prior_std (9,): how far from 0 each lens value may be expected, infinite where nothing is known; matters only where
    the views do not determine it. robust: views and corners that fit badly count less.
    """
    weights = [np.ones(len(view.points_mm)) for view in views]
    noise = 1.0
    for _ in range(_REWEIGHTED if robust else 2):
        lens, poses, residuals = _solved(views, lens, poses, weights, (noise / prior_std) ** 2)
        noise = _noise_px(residuals, weights)
        if robust:
            weights = _weights(residuals)
    lens, poses, residuals = _solved(views, lens, poses, weights, (noise / prior_std) ** 2)
    noise = _noise_px(residuals, weights)
    covariance, inflation = _covariance(views, lens, poses, residuals, weights, noise=noise, prior_std=prior_std)
    return LensFit(lens, poses, tuple(residuals), noise, covariance, inflation)


def _weights(residuals: Sequence[FloatArray]) -> list[FloatArray]:
    """Return each corner's weight: a view's by its own scatter, a corner's by Huber's rule within its view."""
    spreads = np.array([max(1.4826 * float(np.median(np.abs(each))), 1e-9) for each in residuals])
    usual = float(np.median(spreads))
    result = []
    for each, spread in zip(residuals, spreads, strict=True):
        own = float(np.clip((usual / spread) ** 2, 0.01, 4.0))
        far = np.abs(each).max(axis=1) / (_HUBER * max(spread, 0.5 * usual))
        result.append(own / np.maximum(far, 1.0))
    return result


def _noise_px(residuals: Sequence[FloatArray], weights: Sequence[FloatArray]) -> float:
    """Return the standard deviation of one coordinate of a corner of weight 1."""
    total = sum(float((weight[:, None] * each**2).sum()) for each, weight in zip(residuals, weights, strict=True))
    free = sum(2 * len(each) for each in residuals) - _POSE * len(residuals) - LENS
    return max(float(np.sqrt(total / max(free, 1))), _LEAST_NOISE_PX)


def _projected(view: BoardCorners, lens: FloatArray, pose: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return residuals (2 N,), and the computed corners' derivatives by lens (2 N, 9) and pose (2 N, 6)."""
    matrix = np.array([[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]])
    corners, slopes = cv2.projectPoints(view.points_mm, pose[:3], pose[3:], matrix, lens[4:])[:2]
    residual = (view.corners_px - corners.reshape(-1, 2)).ravel()
    return residual, np.asarray(slopes[:, _POSE:], dtype=np.float64), np.asarray(slopes[:, :_POSE], dtype=np.float64)


def _cost(
    views: Sequence[BoardCorners], lens: FloatArray, poses: FloatArray, weights: Sequence[FloatArray], hold: FloatArray
) -> float:
    total = float(hold @ lens**2)
    for view, pose, weight in zip(views, poses, weights, strict=True):
        total += float(np.repeat(weight, 2) @ _projected(view, lens, pose)[0] ** 2)
    return total


def _solved(
    views: Sequence[BoardCorners], lens: FloatArray, poses: FloatArray, weights: Sequence[FloatArray], hold: FloatArray
) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Return lens, poses and residuals of least weighted squares, by Levenberg and Marquardt's method."""
    damping = 1e-4
    best = _cost(views, lens, poses, weights, hold)
    for _ in range(_ROUNDS):
        step_lens, step_poses = _step(views, lens, poses, weights, hold, damping=damping)
        tried_lens, tried_poses = lens + step_lens, poses + step_poses
        cost = _cost(views, tried_lens, tried_poses, weights, hold) if (tried_lens[:2] > 0).all() else np.inf
        if not cost <= best:
            damping *= 10.0
            if damping > 1e10:
                break
            continue
        gained = best - cost
        lens, poses, best, damping = tried_lens, tried_poses, cost, max(0.1 * damping, 1e-12)
        if gained <= 1e-12 * best + 1e-18:
            break
    residuals = [_projected(view, lens, pose)[0].reshape(-1, 2) for view, pose in zip(views, poses, strict=True)]
    return lens, poses, residuals


def _step(
    views: Sequence[BoardCorners],
    lens: FloatArray,
    poses: FloatArray,
    weights: Sequence[FloatArray],
    hold: FloatArray,
    *,
    damping: float,
) -> tuple[FloatArray, FloatArray]:
    normal, right = np.diag(hold), -hold * lens
    normal = normal.astype(np.float64)
    parts = []
    for view, pose, weight in zip(views, poses, weights, strict=True):
        residual, by_lens, by_pose = _projected(view, lens, pose)
        each = np.repeat(weight, 2)[:, None]
        own = by_pose.T @ (each * by_pose)
        own[np.diag_indices(_POSE)] *= 1.0 + damping
        cross = by_lens.T @ (each * by_pose)
        gain = np.linalg.solve(own, cross.T).T
        toward = by_pose.T @ (each[:, 0] * residual)
        normal += by_lens.T @ (each * by_lens) - gain @ cross.T
        right += by_lens.T @ (each[:, 0] * residual) - gain @ toward
        parts.append((own, cross, toward))
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled = normal / np.outer(scale, scale) + damping * np.eye(LENS)
    step = np.linalg.lstsq(scaled, right / scale, rcond=1e-14)[0] / scale
    return step, np.array([np.linalg.solve(own, toward - cross.T @ step) for own, cross, toward in parts])


def _covariance(
    views: Sequence[BoardCorners],
    lens: FloatArray,
    poses: FloatArray,
    residuals: Sequence[FloatArray],
    weights: Sequence[FloatArray],
    *,
    noise: float,
    prior_std: FloatArray,
) -> tuple[FloatArray, float]:
    """Return the lens's covariance (9, 9) and the inflation in it.

    Were all corners' errors independent, the scores that the views contribute would scatter as their information says.
    Errors that a view's corners share (a bent board, motion, a lens the model does not fit) make them scatter more: by
    the ratio of the two, one number for all directions and so a stable one, the variances are raised. After Liang and
    Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 1986, with views as clusters and
    with the expectation, leverage included, of independent errors as the yardstick.
    """
    information, scores = [], []
    for view, pose, residual, weight in zip(views, poses, residuals, weights, strict=True):
        _, by_lens, by_pose = _projected(view, lens, pose)
        each = np.repeat(weight, 2)[:, None]
        gain = np.linalg.lstsq(by_pose.T @ (each * by_pose), by_pose.T @ (each * by_lens), rcond=None)[0]
        free = by_lens - by_pose @ gain
        information.append(free.T @ (each * free))
        scores.append(free.T @ (each[:, 0] * residual.ravel()))
    total = sum(information, start=np.diag((noise / prior_std) ** 2))
    scale = np.sqrt(np.maximum(np.diag(total), 1e-12))
    inverse = np.linalg.pinv(total / np.outer(scale, scale), rcond=1e-15, hermitian=True) / np.outer(scale, scale)
    seen = sum(float(score @ inverse @ score) for score in scores)
    expected = sum(float(np.trace(inverse @ (each - each @ inverse @ each))) for each in information)
    inflation = max(1.0, seen / max(noise**2 * expected, 1e-300))
    covariance = inflation * noise**2 * inverse
    return 0.5 * (covariance + covariance.T), inflation
