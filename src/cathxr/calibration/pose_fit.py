"""The poses of all cameras together, by weighted least squares, with honest covariances.

What is uncertain: each fiducial's pixel; its place on the cross, where the rig states a std (one error for both
cameras); and each lens. A fiducial's place is marginalised, which gives the poses of a bundle adjustment with priors to
first order, and its errors are tenths of a millimetre out of hundreds. The lens enters the covariance, never the
weights: poses are used with the lens as the rig states it, and a pose that takes up the lens's error where the
fiducials are cancels most of it there. Weights that knew of that error would give a better pose and worse points: with
eight fiducials, 0.1 px and a lens from fifteen pictures of a board, 0.33 mm over the ROI instead of 0.03.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import minimize

from cathxr.calibration.pose_view import Linear, PoseView, lens_covariance
from cathxr.core import CalibrationError, FloatArray, Pose
from cathxr.geometry.pose import perturbed

PRIOR_FREEDOM = 8.0
"""What the detector's own sigma_px counts against the residuals, in degrees of freedom: four fiducials leave two."""
COMMON_PX = 0.015
"""Std, along each axis, of what shifts all fiducials of a picture alike, such as shading by a light from one side. No
residual shows it, for the pose turns along; 0.01 to 0.02 px on clean pictures of the twin."""
_STEPS = 30
_SCALE_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class PoseFit:
    """Poses by camera. All covariances include the noise scale.

    covariance (6, 6), covariance_with_intrinsics (6, 9): see `Provenance`. residual_px (N, 2): measured less projected.
    noise_scale: pixel noise over stated sigma_px, after the residuals. misfit: root of chi-square per degree of freedom
    under the stated errors, 1 where all is as stated.
    """

    poses: Mapping[str, Pose]
    covariance: Mapping[str, FloatArray]
    covariance_with_intrinsics: Mapping[str, FloatArray]
    residual_px: Mapping[str, FloatArray]
    noise_scale: Mapping[str, float]
    misfit: Mapping[str, float]


def fitted(views: Sequence[PoseView], start: Mapping[str, Pose]) -> PoseFit:
    """Return the poses of the views' cameras, from starting poses near them.

    Raises:
        CalibrationError: it does not converge.
    """
    markers = _shared_markers(views)
    scales = np.ones(len(views))
    poses = [start[view.camera.name] for view in views]
    for _ in range(_SCALE_ROUNDS):
        poses = _converged(views, poses, scales, markers)
        linear = [Linear.of(view, pose) for view, pose in zip(views, poses, strict=True)]
        scales = _noise_scales(views, linear, markers)
        if markers is None:  # without shared fiducial errors the scale of a camera does not move its pose
            break
    return _with_errors(views, poses, linear, scales, markers)


def gain_of(view: PoseView, linear: Linear) -> tuple[FloatArray, FloatArray]:
    """Return (6, R) from a single view's pixels to its pose, and the covariance (R, R) of those pixels, as stated."""
    places = linear.by_marker @ block_diag(*view.marker_covariance) @ linear.by_marker.T
    weight_covariance = np.diag(linear.pixel_variance) + places
    return _gain(linear.by_pose, weight_covariance), weight_covariance + _shared_part([view], [linear])


def pose_of(view: PoseView, start: Pose) -> Pose:
    """Return the pose of one view alone, with its errors as stated.

    Raises:
        CalibrationError: it does not converge.
    """
    return _converged([view], [start], np.ones(1), _shared_markers([view]))[0]


@dataclass(frozen=True, eq=False)
class _Markers:
    """The fiducials whose places are uncertain: covariance (3 M, 3 M), and for each view its columns (3 N,) in it."""

    covariance: FloatArray
    columns: tuple[np.ndarray, ...]


def _shared_markers(views: Sequence[PoseView]) -> _Markers | None:
    each = {
        name: view.marker_covariance[i]
        for view in views
        for i, name in enumerate(view.names)
    }  # fmt: skip
    if not any(matrix.any() for matrix in each.values()):
        return None
    place = {name: 3 * i for i, name in enumerate(each)}
    columns = tuple(np.concatenate([place[name] + np.arange(3) for name in view.names]) for view in views)
    return _Markers(block_diag(*each.values()), columns)


def _pixel_covariance(linear: Sequence[Linear], scales: FloatArray, markers: _Markers | None) -> FloatArray:
    """Return the covariance (R, R) of all views' pixels for given noise scales, lenses exact."""
    total = np.diag(
        np.concatenate([scale**2 * each.pixel_variance for scale, each in zip(scales, linear, strict=True)])
    )
    if markers is not None:
        by_place = np.zeros((len(total), len(markers.covariance)))
        row = 0
        for each, columns in zip(linear, markers.columns, strict=True):
            rows = slice(row, row + len(each.residual))
            by_place[rows, columns] = each.by_marker
            row = rows.stop
        total = total + by_place @ markers.covariance @ by_place.T
    return total


def _converged(
    views: Sequence[PoseView], poses: Sequence[Pose], scales: FloatArray, markers: _Markers | None
) -> list[Pose]:
    """Return the poses at which the weighted squared error is least: Gauss-Newton with halved steps."""
    current = list(poses)
    for _ in range(_STEPS):
        linear = [Linear.of(view, pose) for view, pose in zip(views, current, strict=True)]
        covariance = _pixel_covariance(linear, scales, markers)
        step = _gain(block_diag(*(each.by_pose for each in linear)), covariance) @ np.concatenate(
            [each.residual for each in linear]
        )
        inverse = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        before = _squared(views, current, inverse)
        for fraction in 0.5 ** np.arange(12):
            moved = [perturbed(pose, fraction * each) for pose, each in zip(current, step.reshape(-1, 6), strict=True)]
            if _squared(views, moved, inverse) <= before * (1.0 + 1e-9) + 1e-12:
                break
        else:
            return current  # no step is better: this is the least
        current = moved
        if (np.abs(step.reshape(-1, 6)) < [1e-12] * 3 + [1e-9] * 3).all():
            return current
    names = " and ".join(view.camera.name for view in views)
    raise CalibrationError(
        f"The pose of the {names} camera does not settle: check the fiducials' names and places, and the lens."
    )


def _squared(views: Sequence[PoseView], poses: Sequence[Pose], inverse: FloatArray) -> float:
    try:
        each = [view.residual_px(pose).ravel() for view, pose in zip(views, poses, strict=True)]
    except ValueError:  # behind the camera
        return np.inf
    residual = np.concatenate(each)
    return float(residual @ inverse @ residual)


def _gain(by_pose: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the (P, R) that weighted least squares takes from residuals to the pose.

    Raises:
        CalibrationError: the fiducials leave a pose open.
    """
    # Radians and millimetres differ by orders of magnitude: judge and solve in units that make the columns alike.
    root = np.linalg.cholesky(covariance)
    white = np.linalg.solve(root, by_pose)
    size = np.linalg.norm(white, axis=0)
    left, singular, right = np.linalg.svd(white / size, full_matrices=False)
    if singular[-1] < 1e-7 * singular[0]:
        raise CalibrationError("The fiducials in view leave a camera's pose open: use four that span a plane.")
    inverse = (right.T / singular) @ left.T / size[:, None]
    return np.asarray(inverse @ np.linalg.inv(root), dtype=np.float64)


def _shared_part(views: Sequence[PoseView], linear: Sequence[Linear]) -> FloatArray:
    """Return the covariance (R, R) of what all fiducials of a picture share: the lens's error and a common shift."""
    parts = []
    for view, each in zip(views, linear, strict=True):
        shift = np.tile(np.eye(2), (len(view.names), 1))
        lens = each.by_intrinsics @ lens_covariance(view) @ each.by_intrinsics.T
        parts.append(lens + COMMON_PX**2 * shift @ shift.T)
    return np.asarray(block_diag(*parts), dtype=np.float64)


def _noise_scales(views: Sequence[PoseView], linear: Sequence[Linear], markers: _Markers | None) -> FloatArray:
    """Return each camera's pixel noise over its stated sigma: the mode under a scaled inverse chi-square prior.

    Restricted maximum likelihood (Patterson and Thompson, Biometrika 1971), so that fiducials' places and lenses take
    their share of the residuals. Without those it is the closed form (nu0 + sum r^2) / (nu0 + nu).
    """
    by_pose = block_diag(*(each.by_pose for each in linear))
    # Contrasts that no pose changes: what is left of the pixels once the poses are taken out.
    contrast = np.linalg.svd(by_pose)[0][:, by_pose.shape[1] :]
    rest = contrast.T @ np.concatenate([each.residual for each in linear])
    fixed = _pixel_covariance(linear, np.zeros(len(views)), markers) + _shared_part(views, linear)
    owner = np.concatenate([np.full(len(each.residual), i) for i, each in enumerate(linear)])
    variance = np.concatenate([each.pixel_variance for each in linear])

    def objective(logarithm: FloatArray) -> float:
        covariance = contrast.T @ (np.diag(np.exp(logarithm)[owner] * variance) + fixed) @ contrast
        root = np.linalg.cholesky(covariance)
        white = np.linalg.solve(root, rest)
        prior = PRIOR_FREEDOM * (logarithm + np.exp(-logarithm)).sum()
        return float(2.0 * np.log(np.diag(root)).sum() + white @ white + prior)

    best = minimize(objective, np.zeros(len(views)), method="L-BFGS-B", bounds=[(-4.0, 25.0)] * len(views))
    return np.asarray(np.exp(0.5 * best.x), dtype=np.float64)


def _with_errors(
    views: Sequence[PoseView],
    poses: Sequence[Pose],
    linear: Sequence[Linear],
    scales: FloatArray,
    markers: _Markers | None,
) -> PoseFit:
    pixels = _pixel_covariance(linear, scales, markers)
    gain = _gain(block_diag(*(each.by_pose for each in linear)), pixels)
    total = gain @ (pixels + _shared_part(views, linear)) @ gain.T
    names = [view.camera.name for view in views]
    covariance, cross, misfit, row = {}, {}, {}, 0
    for i, (name, view, each) in enumerate(zip(names, views, linear, strict=True)):
        mine, rows = slice(6 * i, 6 * i + 6), slice(row, row + len(each.residual))
        covariance[name] = 0.5 * (total[mine, mine] + total[mine, mine].T)
        # The pixels' residuals are measured minus those of the stated lens, whose error is stated minus true.
        cross[name] = -gain[mine, rows] @ each.by_intrinsics @ lens_covariance(view)
        misfit[name] = _misfit(view, each)
        row = rows.stop
    return PoseFit(
        dict(zip(names, poses, strict=True)),
        covariance,
        cross,
        {name: each.residual.reshape(-1, 2) for name, each in zip(names, linear, strict=True)},
        {name: float(scale) for name, scale in zip(names, scales, strict=True)},
        misfit,
    )


def _misfit(view: PoseView, linear: Linear) -> float:
    """Return the root of chi-square per degree of freedom of one view under its stated errors."""
    _, covariance = gain_of(view, linear)
    contrast = np.linalg.svd(linear.by_pose)[0][:, 6:]
    rest = contrast.T @ linear.residual
    square = float(rest @ np.linalg.solve(contrast.T @ covariance @ contrast, rest))
    return float(np.sqrt(square / len(rest)))
