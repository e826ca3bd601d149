"""The rectified mm plane of one view, from four coplanar fiducials: the one geometric idea of the paper method.

arXiv 2411.02611: undistort, then warp the picture so that four markers on the cross pillar fall on their known places.
The top view's plane has coordinates (x, y), the front view's (x, z), mm in `box`. A homography is exact on the markers'
plane only: whatever lies nearer to the camera looks larger. Full projective triangulation does not have that error.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from cathxr.core import ConfigError, FloatArray, Rig
from cathxr.geometry.camera import CameraModel

_AXES = {"top": (0, 1), "front": (0, 2)}
_MOST_OFF_PLANE_MM = 2.0


@dataclass(frozen=True, eq=False)
class FiducialPlane:
    """Maps raw pixels to mm on a view's rectified plane and back.

    axes: which two coordinates of `box` the plane has. plane_from_normalised (3, 3): the homography from undistorted
    normalised coordinates.
    """

    camera: CameraModel
    axes: tuple[int, int]
    plane_from_normalised: FloatArray

    @classmethod
    def of(cls, rig: Rig, camera: str) -> Self:
        """Return the plane of a rig's camera, "top" or "front".

        The pictures in use show no markers (the pillar has been taken out), so the markers' places in the picture are
        those that the calibrated camera gives them. A rig without markers for this camera uses the four corners of its
        ROI in the mid plane instead: the same plane, known only as well as the camera's pose.

        Raises:
            ConfigError: fewer than four markers, markers not in one plane or not spread over it, or not in view.
        """
        axes = _AXES.get(camera)
        if axes is None:
            raise ConfigError(f"The paper method knows the views top and front, not {camera!r}.")
        points_box = _fiducials(rig, camera, axes)
        model = CameraModel.of(rig.cameras[camera])
        try:
            normalised = model.undistort(model.project(points_box))
        except ValueError as error:
            raise ConfigError(
                f"The {camera} camera cannot see its markers ({error}); check its camera_from_box."
            ) from error
        return cls(model, axes, _homography(normalised, points_box[:, axes], camera))

    def to_plane(self, pixels: FloatArray) -> FloatArray:
        """Return mm on the plane (..., 2) of raw pixels (..., 2).

        Raises:
            ValueError: a pixel lies beyond the lens model or on the plane's horizon.
        """
        return _mapped(self.plane_from_normalised, self.camera.undistort(np.asarray(pixels, dtype=np.float64)))

    def apparent(self, points_box: FloatArray) -> FloatArray:
        """Return where on the plane, mm (..., 2), the camera sees points (..., 3) mm in `box`, on the plane or off it.

        Raises:
            ValueError: a point lies behind the camera.
        """
        points = self.camera.to_camera(np.asarray(points_box, dtype=np.float64))
        if (points[..., 2] <= 0).any():
            raise ValueError("points_box: expected points in front of the camera")
        normalised = np.asarray(points[..., :2] / points[..., 2:], dtype=np.float64)
        return _mapped(self.plane_from_normalised, normalised)

    def to_pixels(self, points_mm: FloatArray) -> FloatArray:
        """Return raw pixels (..., 2) of mm on the plane (..., 2). Inverse of `to_plane`."""
        inverse = np.asarray(np.linalg.inv(self.plane_from_normalised), dtype=np.float64)
        normalised = _mapped(inverse, np.asarray(points_mm, dtype=np.float64))
        return self.camera.pixels_from_normalised(normalised)


def _fiducials(rig: Rig, camera: str, axes: tuple[int, int]) -> FloatArray:
    """Return the view's fiducials (N, 3), mm in `box`: its markers, or the ROI's corners in the mid plane."""
    markers = rig.markers.get(camera, ())
    if not markers:
        low, high = rig.roi.min_mm, rig.roi.max_mm
        corners = np.zeros((4, 3))
        first, second = axes
        corners[:, first] = [low[first], high[first], high[first], low[first]]
        corners[:, second] = [low[second], low[second], high[second], high[second]]
        return corners
    positions = np.stack([each.position_mm for each in markers])
    if len(positions) < 4:
        raise ConfigError(f"The paper method needs four markers in [markers.{camera}], the rig has {len(positions)}.")
    across = 3 - sum(axes)
    off_plane = float(np.abs(positions[:, across]).max())
    if off_plane > _MOST_OFF_PLANE_MM:
        raise ConfigError(
            f"[markers.{camera}] must lie in the plane {'xyz'[across]} = 0 for the paper method; "
            f"one lies {off_plane:.1f} mm off it. Use --method model with this rig."
        )
    return positions


def _homography(normalised: FloatArray, plane_mm: FloatArray, camera: str) -> FloatArray:
    """Return plane_from_normalised (3, 3) for N >= 4 points, by the normalised direct linear transform.

    Hartley and Zisserman, "Multiple View Geometry", 2nd ed., algorithm 4.2.

    Raises:
        ConfigError: three of four points on one line.
    """
    source, from_normalised = _conditioned(normalised)
    target, from_plane = _conditioned(plane_mm)
    ones, zeros = np.ones(len(source)), np.zeros((len(source), 3))
    homogeneous = np.column_stack([source, ones])
    rows_u = np.hstack([homogeneous, zeros, -target[:, :1] * homogeneous])
    rows_v = np.hstack([zeros, homogeneous, -target[:, 1:] * homogeneous])
    _, singular, right = np.linalg.svd(np.vstack([rows_u, rows_v]))
    if singular[7] < 1e-6 * singular[0]:
        raise ConfigError(
            f"[markers.{camera}]: three of the markers lie on one line; the paper method needs four corners."
        )
    result = np.linalg.inv(from_plane) @ right[8].reshape(3, 3) @ from_normalised
    # The sign that makes the third coordinate positive where the markers are.
    side = np.column_stack([normalised, ones]) @ result[2]
    return np.asarray(result / side.mean(), dtype=np.float64)


def _conditioned(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 2) shifted and scaled to order one, and the (3, 3) that did it."""
    centre = points.mean(axis=0)
    scale = 1.0 / max(float(np.abs(points - centre).mean()), 1e-12)
    matrix = np.array([[scale, 0.0, -scale * centre[0]], [0.0, scale, -scale * centre[1]], [0.0, 0.0, 1.0]])
    return (points - centre) * scale, matrix


def _mapped(homography: FloatArray, points: FloatArray) -> FloatArray:
    """Return points (..., 2) through a (3, 3) homography."""
    mapped = points @ homography[:, :2].T + homography[:, 2]
    if (mapped[..., 2] <= 0).any():
        raise ValueError("points: expected points on the visible side of the plane's horizon")
    return np.asarray(mapped[..., :2] / mapped[..., 2:], dtype=np.float64)
