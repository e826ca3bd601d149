"""Points from two or more views, with their covariance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.geometry.camera import CameraModel

_ITERATIONS = 10


@dataclass(frozen=True, eq=False)
class Triangulation:
    """points_box (N, 3) mm; covariance_mm2 (N, 3, 3) of pixel noise; residual_px (V, N, 2) measured minus projected."""

    points_box: FloatArray
    covariance_mm2: FloatArray
    residual_px: FloatArray


def nearest_to_rays(origins: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the points (N, 3) nearest in the least-squares sense to V rays each.

    origins (V, 3) mm, directions (V, N, 3) unit.

    Raises:
        ValueError: all rays of a point are parallel.
    """
    projectors = np.eye(3) - directions[..., :, None] * directions[..., None, :]
    normal = projectors.sum(axis=0)
    right = (projectors @ origins[:, None, :, None]).sum(axis=0)
    if (np.linalg.det(normal) < 1e-9).any():
        raise ValueError("directions: expected rays that are not parallel")
    return np.asarray(np.linalg.solve(normal, right)[..., 0], dtype=np.float64)


def triangulate(
    cameras: Sequence[CameraModel], pixels: FloatArray, *, sigma_px: FloatArray | float = 1.0
) -> Triangulation:
    """Return the points seen at `pixels` (V, N, 2) raw px by the V cameras: least squares on reprojection error.

    sigma_px: standard deviation of each pixel coordinate, one number or (V, N).

    Raises:
        ValueError: fewer than two cameras, parallel rays, shapes that do not fit, or a sigma that is not positive.
    """
    measured = np.asarray(pixels, dtype=np.float64)
    if len(cameras) < 2 or measured.ndim != 3 or measured.shape[0] != len(cameras) or measured.shape[2] != 2:
        raise ValueError(
            f"pixels: expected shape ({max(2, len(cameras))}, N, 2) for at least two cameras, got {measured.shape}"
        )
    sigma = np.asarray(sigma_px, dtype=np.float64)
    if sigma.ndim not in (0, 2) or not (sigma > 0).all():
        raise ValueError(f"sigma_px: expected positive numbers, one or (V, N), got shape {sigma.shape}")
    weight = 1.0 / np.square(np.broadcast_to(sigma, measured.shape[:2]))
    origins = np.stack([camera.centre_box for camera in cameras])
    directions = np.stack([camera.ray(each) for camera, each in zip(cameras, measured, strict=True)])
    points = nearest_to_rays(origins, directions)
    for _ in range(_ITERATIONS):
        residual, information, gradient = _normal_equations(cameras, measured, points, weight)
        step = np.linalg.solve(information, gradient[..., None])[..., 0]
        points = points + step
        if np.abs(step).max(initial=0.0) < 1e-10:
            break
    residual, information, _ = _normal_equations(cameras, measured, points, weight)
    return Triangulation(points, np.asarray(np.linalg.inv(information), dtype=np.float64), residual)


def _normal_equations(
    cameras: Sequence[CameraModel], measured: FloatArray, points: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return residuals (V, N, 2), information (N, 3, 3) and gradient (N, 3) of the reprojection error."""
    residual = np.empty_like(measured)
    information = np.zeros((len(points), 3, 3))
    gradient = np.zeros((len(points), 3))
    for view, camera in enumerate(cameras):
        pixels, jacobian = camera.project_with_jacobian(points)
        residual[view] = measured[view] - pixels
        weighted = jacobian * weight[view][:, None, None]
        information += weighted.transpose(0, 2, 1) @ jacobian
        gradient += (weighted.transpose(0, 2, 1) @ residual[view][..., None])[..., 0]
    return residual, information, gradient
