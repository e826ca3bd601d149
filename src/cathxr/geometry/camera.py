"""One camera model: OpenCV's pinhole with k1 k2 p1 p2 k3, placed in the box. All vectorised over points.

Equations: OpenCV documentation, "Camera Calibration and 3D Reconstruction" (after Brown, 1971).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from cathxr.core import FloatArray, Intrinsics, Pose, RigCamera
from cathxr.geometry import camera_kernels


@dataclass(frozen=True, eq=False)
class CameraModel:
    """Projects points of `box` (mm) to raw pixels and back to rays. Pixel (0, 0) is the first pixel's centre."""

    intrinsics: Intrinsics
    camera_from_box: Pose
    size_px: tuple[int, int]

    @classmethod
    def of(cls, camera: RigCamera) -> Self:
        """Return the model of a rig's camera."""
        return cls(camera.intrinsics, camera.camera_from_box, camera.size_px)

    @cached_property
    def centre_box(self) -> FloatArray:
        """The optical centre (3,), mm in `box`."""
        return self.camera_from_box.inverse().translation_mm

    @cached_property
    def numbers(self) -> FloatArray:
        """The model's numbers (21,) as compiled code takes them: see `camera_kernels.packed`."""
        inner, outer = self.intrinsics, self.camera_from_box
        lens = np.concatenate([inner.focal_px, inner.centre_px, inner.distortion])
        result = camera_kernels.packed(outer.rotation, outer.translation_mm, lens)
        result.setflags(write=False)
        return result

    @cached_property
    def _rotation(self) -> FloatArray:
        return self.camera_from_box.rotation

    def to_camera(self, points_box: FloatArray) -> FloatArray:
        """Return points (..., 3) of `box` in the camera's frame, mm."""
        return np.asarray(points_box @ self._rotation.T + self.camera_from_box.translation_mm, dtype=np.float64)

    def project(self, points_box: FloatArray) -> FloatArray:
        """Return raw pixels (..., 2) of points (..., 3) mm in `box`.

        Raises:
            ValueError: a point lies behind the camera.
        """
        points = self.to_camera(np.asarray(points_box, dtype=np.float64))
        if (points[..., 2] <= 0).any():
            raise ValueError("points_box: expected points in front of the camera")
        return self.pixels_from_normalised(points[..., :2] / points[..., 2:])

    def project_with_jacobian(self, points_box: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return raw pixels (N, 2) and their derivative (N, 2, 3), px per mm, for points (N, 3) in `box`.

        Raises:
            ValueError: another shape, or a point lies behind the camera.
        """
        intrinsics = self.intrinsics
        points = np.ascontiguousarray(points_box, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:  # compiled code checks no bounds
            raise ValueError(f"points_box: expected shape (N, 3), got {points.shape}")
        pixels, jacobian, nearest = camera_kernels.project_with_jacobian(
            points,
            self._rotation,
            self.camera_from_box.translation_mm,
            intrinsics.focal_px,
            intrinsics.centre_px,
            intrinsics.distortion,
        )
        if nearest <= 0:
            raise ValueError("points_box: expected points in front of the camera")
        return pixels, jacobian

    def pixels_from_normalised(self, normalised: FloatArray) -> FloatArray:
        """Return raw pixels (..., 2) of ideal normalised coordinates (x/z, y/z)."""
        distorted = distort(normalised, self.intrinsics.distortion)
        return np.asarray(distorted * self.intrinsics.focal_px + self.intrinsics.centre_px, dtype=np.float64)

    def undistort(self, pixels: FloatArray) -> FloatArray:
        """Return ideal normalised coordinates (..., 2) of raw pixels (..., 2). Inverse of `pixels_from_normalised`.

        Raises:
            ValueError: a pixel lies where the distortion cannot be undone (beyond the fold of the lens model).
        """
        distorted = (np.asarray(pixels, dtype=np.float64) - self.intrinsics.centre_px) / self.intrinsics.focal_px
        return undistort(distorted, self.intrinsics.distortion)

    def ray(self, pixels: FloatArray) -> FloatArray:
        """Return unit directions (..., 3) in `box` of the rays from `centre_box` through raw pixels (..., 2)."""
        normalised = self.undistort(pixels)
        directions = np.concatenate([normalised, np.ones((*normalised.shape[:-1], 1))], axis=-1) @ self._rotation
        return np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True), dtype=np.float64)

    def inside(self, pixels: FloatArray, *, margin_px: float = 0.0) -> FloatArray:
        """Return a mask (...,) of which raw pixels (..., 2) lie in the picture, at least `margin_px` from its edge."""
        limit = np.array(self.size_px) - 1.0
        return np.asarray(((pixels >= margin_px) & (pixels <= limit - margin_px)).all(axis=-1))


def distort(normalised: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Return distorted normalised coordinates (..., 2) of ideal ones, for coefficients (5,) = k1 k2 p1 p2 k3."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=-1,
    )


def distortion_jacobian(normalised: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Return the derivative (..., 2, 2) of `distort` by its point."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3)
    cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    result = np.empty((*normalised.shape[:-1], 2, 2))
    result[..., 0, 0] = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    result[..., 1, 1] = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    result[..., 0, 1] = result[..., 1, 0] = cross
    return result


def undistort(distorted: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Return ideal normalised coordinates (..., 2) of distorted ones, by damped Newton from the distorted point.

    Raises:
        ValueError: a point has no preimage on the near side of the lens model's fold.
    """
    flat = np.ascontiguousarray(distorted, dtype=np.float64).reshape(-1, 2)
    ideal, good = camera_kernels.undistort(flat, np.ascontiguousarray(coefficients, dtype=np.float64))
    if not good:
        raise ValueError("pixels: the lens distortion cannot be undone there (outside the model's valid field of view)")
    return ideal.reshape(distorted.shape)
