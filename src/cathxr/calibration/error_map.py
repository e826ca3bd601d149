"""How well a rig can know a point: the error that calibration alone leaves, over the region of interest."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, Rig
from cathxr.geometry.calibration_error import camera_errors, point_covariances


@dataclass(frozen=True)
class ErrorSummary:
    """Expected error over the region of interest, mm: root mean square, 95th percentile, greatest."""

    mean_mm: float
    p95_mm: float
    max_mm: float


def expected_error_mm(rig: Rig, points_box: FloatArray) -> FloatArray:
    """Return the expected error (N,), mm, of points (N, 3) in `box`: root of the trace of their covariance.

    Raises:
        ValueError: a point lies behind a camera.
    """
    covariances = point_covariances(list(camera_errors(rig).values()), np.asarray(points_box, dtype=np.float64))
    return np.asarray(np.sqrt(np.trace(covariances, axis1=1, axis2=2)), dtype=np.float64)


def roi_grid(rig: Rig, *, count: int = 9) -> FloatArray:
    """Return evenly spaced points (count^3, 3) of the region of interest, corners included."""
    axes = [np.linspace(low, high, count) for low, high in zip(rig.roi.min_mm, rig.roi.max_mm, strict=True)]
    return np.asarray(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3), dtype=np.float64)


def error_summary(rig: Rig) -> ErrorSummary:
    """Return the expected error over the region of interest.

    Raises:
        ValueError: part of the region lies behind a camera.
    """
    error = expected_error_mm(rig, roi_grid(rig))
    return ErrorSummary(float(np.sqrt(np.square(error).mean())), float(np.percentile(error, 95.0)), float(error.max()))
