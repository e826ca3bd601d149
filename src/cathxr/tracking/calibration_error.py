"""What an imperfect calibration does to a point's position: the part of sigma_mm that no good picture can lower."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, Rig, RigCamera
from cathxr.geometry import CameraModel

ASSUMED_MARKER_PX = 0.1
"""Marker noise assumed where a rig states no pose error (the architecture's rule); intrinsics count as exact then."""


@dataclass(frozen=True, eq=False)
class CameraError:
    """One camera with the covariance (6, 6) of its pose and the variances of its intrinsics."""

    model: CameraModel
    pose_covariance: FloatArray
    focal_variance: FloatArray
    centre_variance: FloatArray
    distortion_variance: FloatArray

    def pixel_covariance(self, point_box: FloatArray) -> FloatArray:
        """Return the covariance (2, 2), px^2, of where this camera should see a point (3,) mm."""
        by_pose = pose_jacobian(self.model, point_box[None])[0]
        normalised = (
            self.model.project(point_box[None])[0] - self.model.intrinsics.centre_px
        ) / self.model.intrinsics.focal_px
        by_lens = distortion_derivative(self.model, point_box)
        lens = np.diag(self.centre_variance + np.square(normalised) * self.focal_variance)
        lens = lens + by_lens @ np.diag(self.distortion_variance) @ by_lens.T
        return np.asarray(by_pose @ self.pose_covariance @ by_pose.T + lens, dtype=np.float64)


def pose_jacobian(model: CameraModel, points_box: FloatArray) -> FloatArray:
    """Return the derivative (N, 2, 6) of the pixels of points (N, 3) by the perturbation of camera_from_box.

    The perturbation is `geometry.pose.perturbed`'s: rotation (rad), then translation (mm), both in the camera's frame.
    """
    _, by_box = model.project_with_jacobian(points_box)
    by_camera = by_box @ model.camera_from_box.rotation.T
    arms = model.camera_from_box.turn(points_box)
    zero = np.zeros(len(arms))
    x, y, z = arms.T
    lever = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(-1, 3, 3)
    return np.concatenate([by_camera @ lever, by_camera], axis=2)


def distortion_derivative(model: CameraModel, point_box: FloatArray) -> FloatArray:
    """Return the derivative (2, 5) of a point's pixel by the distortion k1 k2 p1 p2 k3; the point (3,) mm in `box`."""
    seen = model.to_camera(point_box)
    x, y = seen[:2] / seen[2]
    r2 = x * x + y * y
    by_coefficient = np.array(
        [
            [x * r2, x * r2**2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2**3],
            [y * r2, y * r2**2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2**3],
        ]
    )
    return np.asarray(model.intrinsics.focal_px[:, None] * by_coefficient, dtype=np.float64)


def camera_errors(rig: Rig) -> dict[str, CameraError]:
    """Return each camera's error: as the rig states it, else that of a pose from four markers with 0.1 px of noise."""
    return {name: _camera_error(rig, camera) for name, camera in rig.cameras.items()}


def _camera_error(rig: Rig, camera: RigCamera) -> CameraError:
    model = CameraModel.of(camera)
    covariance = camera.pose_provenance.covariance
    if covariance is None:
        markers = rig.markers.get(camera.name, ())
        points = (
            np.stack([each.position_mm for each in markers]) if len(markers) >= 4 else _stand_in_markers(rig, camera)
        )
        jacobian = pose_jacobian(model, points).reshape(-1, 6)
        covariance = np.asarray(ASSUMED_MARKER_PX**2 * np.linalg.inv(jacobian.T @ jacobian), dtype=np.float64)
    std = camera.intrinsics.provenance.std
    focal, centre, distortion = (
        np.square(std.get(name, np.zeros(size)))
        for name, size in (("focal_px", 2), ("centre_px", 2), ("distortion", 5))
    )
    return CameraError(model, covariance, focal, centre, distortion)


def _stand_in_markers(rig: Rig, camera: RigCamera) -> FloatArray:
    """Return where a camera's four fiducials (4, 3) would be: the corners of the middle plane that it looks at."""
    low, high = rig.roi.min_mm, rig.roi.max_mm
    axis = camera.camera_from_box.rotation[2]
    flat = int(np.argmax(np.abs(axis)))
    others = [each for each in range(3) if each != flat]
    corners = np.tile((low + high) / 2.0, (4, 1))
    for i, (first, second) in enumerate(((low, low), (high, low), (high, high), (low, high))):
        corners[i, others[0]], corners[i, others[1]] = first[others[0]], second[others[1]]
    return corners


def point_covariance(errors: list[CameraError], point_box: FloatArray) -> FloatArray:
    """Return the covariance (3, 3), mm^2, that the calibration's errors give a triangulated point (3,)."""
    jacobians = [each.model.project_with_jacobian(point_box[None])[1][0] for each in errors]
    information = sum((jacobian.T @ jacobian for jacobian in jacobians), np.zeros((3, 3)))
    inverse = np.linalg.inv(information)
    total = np.zeros((3, 3))
    for error, jacobian in zip(errors, jacobians, strict=True):
        gain = inverse @ jacobian.T
        total += gain @ error.pixel_covariance(point_box) @ gain.T
    return total
