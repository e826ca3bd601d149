"""What an imperfect calibration does to a point's position: the part of sigma_mm that no good picture can lower.

Each camera's 15 calibrated numbers, pose (6) then intrinsics (9) in the order of `Provenance`, have one covariance. It
is carried to the pixel where the camera should see a point, and from both cameras' pixels to the triangulated point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, Intrinsics, Rig, RigCamera
from cathxr.geometry.camera import CameraModel

ASSUMED_MARKER_PX = 0.1
"""Marker noise assumed where a rig states no pose error (the architecture's rule); intrinsics count as exact then."""


@dataclass(frozen=True, eq=False)
class CameraError:
    """One camera with the covariance (15, 15) of its pose (rotation rad, translation mm) and its intrinsics."""

    model: CameraModel
    covariance: FloatArray

    def pixel_covariance(self, points_box: FloatArray) -> FloatArray:
        """Return the covariance (N, 2, 2), px^2, of where this camera should see points (N, 3) mm."""
        jacobian = np.concatenate(
            [pose_jacobian(self.model, points_box), intrinsics_jacobian(self.model, points_box)], axis=2
        )
        return np.asarray(jacobian @ self.covariance @ jacobian.transpose(0, 2, 1), dtype=np.float64)


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


def intrinsics_jacobian(model: CameraModel, points_box: FloatArray) -> FloatArray:
    """Return the derivative (N, 2, 9) of the pixels of points (N, 3) by focal x y, centre x y, k1 k2 p1 p2 k3."""
    seen = model.to_camera(np.asarray(points_box, dtype=np.float64))
    x, y = (seen[:, :2] / seen[:, 2:]).T
    r2 = x * x + y * y
    k1, k2, p1, p2, k3 = model.intrinsics.distortion
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    fx, fy = model.intrinsics.focal_px
    result = np.zeros((len(seen), 2, 9))
    result[:, 0, 0] = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    result[:, 1, 1] = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    result[:, 0, 2] = result[:, 1, 3] = 1.0
    result[:, 0, 4:] = fx * np.stack([x * r2, x * r2**2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2**3], axis=1)
    result[:, 1, 4:] = fy * np.stack([y * r2, y * r2**2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2**3], axis=1)
    return result


def intrinsics_covariance(intrinsics: Intrinsics) -> FloatArray:
    """Return the covariance (9, 9) that a rig states for a lens: in full, else by its std, else zero."""
    stated = intrinsics.provenance
    if stated.covariance is not None and stated.covariance.shape == (9, 9):
        return stated.covariance
    parts = (("focal_px", 2), ("centre_px", 2), ("distortion", 5))
    std = np.concatenate([np.broadcast_to(stated.std.get(name, 0.0), size) for name, size in parts])
    return np.diag(np.square(std))


def camera_errors(rig: Rig) -> dict[str, CameraError]:
    """Return each camera's error: as the rig states it, else that of a pose from four markers with 0.1 px of noise."""
    return {name: _camera_error(rig, camera) for name, camera in rig.cameras.items()}


def point_covariance(errors: Sequence[CameraError], point_box: FloatArray) -> FloatArray:
    """Return the covariance (3, 3), mm^2, that the calibration's errors give a triangulated point (3,)."""
    return np.asarray(point_covariances(errors, np.asarray(point_box, dtype=np.float64)[None])[0], dtype=np.float64)


def point_covariances(errors: Sequence[CameraError], points_box: FloatArray) -> FloatArray:
    """Return the covariances (N, 3, 3), mm^2, that the calibration's errors give triangulated points (N, 3).

    Raises:
        ValueError: a point lies behind a camera.
    """
    jacobians = [each.model.project_with_jacobian(points_box)[1] for each in errors]
    transposed = [each.transpose(0, 2, 1) for each in jacobians]
    information = sum(
        (back @ jacobian for back, jacobian in zip(transposed, jacobians, strict=True)),
        np.zeros((len(points_box), 3, 3)),
    )
    inverse = np.linalg.inv(information)
    total = np.zeros_like(information)
    for error, back in zip(errors, transposed, strict=True):
        gain = inverse @ back
        total += gain @ error.pixel_covariance(points_box) @ gain.transpose(0, 2, 1)
    return total


def _camera_error(rig: Rig, camera: RigCamera) -> CameraError:
    model = CameraModel.of(camera)
    stated = camera.pose_provenance
    joint = np.zeros((15, 15))
    joint[6:, 6:] = intrinsics_covariance(camera.intrinsics)
    if stated.covariance is None:
        joint[:6, :6] = _assumed(rig, camera, model)
        return CameraError(model, joint)
    joint[:6, :6] = stated.covariance
    if stated.covariance_with_intrinsics is not None:
        joint[:6, 6:] = stated.covariance_with_intrinsics
        joint[6:, :6] = stated.covariance_with_intrinsics.T
    return CameraError(model, joint)


def _assumed(rig: Rig, camera: RigCamera, model: CameraModel) -> FloatArray:
    """Return the covariance (6, 6) of a pose from the camera's own markers with the assumed noise."""
    markers = rig.markers.get(camera.name, ())
    points = np.stack([each.position_mm for each in markers]) if len(markers) >= 4 else _stand_in_markers(rig, camera)
    jacobian = pose_jacobian(model, points).reshape(-1, 6)
    return np.asarray(ASSUMED_MARKER_PX**2 * np.linalg.inv(jacobian.T @ jacobian), dtype=np.float64)


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
