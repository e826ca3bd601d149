"""What one camera saw of the fiducials, ready for a pose: positions in the box, pixels, and the errors of both."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cathxr.calibration.sighting import Sighting
from cathxr.core import CalibrationError, FloatArray, Marker, Pose, Rig, RigCamera
from cathxr.geometry import CameraModel
from cathxr.geometry.calibration_error import intrinsics_covariance, intrinsics_jacobian, pose_jacobian

FEWEST = 4


@dataclass(frozen=True, eq=False)
class PoseView:
    """The fiducials of one camera's picture.

    names (N): which. points_box (N, 3) mm; pixels (N, 2) raw px; sigma_px (N,); marker_covariance (N, 3, 3) mm^2 of
    each fiducial's place on its cross, zero where the rig states no std.
    """

    camera: RigCamera
    names: tuple[str, ...]
    points_box: FloatArray
    pixels: FloatArray
    sigma_px: FloatArray
    marker_covariance: FloatArray

    def of(self, names: set[str]) -> "PoseView":
        """Return the view with the fiducials in `names` only."""
        keep = [i for i, name in enumerate(self.names) if name in names]
        return replace(
            self,
            names=tuple(self.names[i] for i in keep),
            points_box=self.points_box[keep],
            pixels=self.pixels[keep],
            sigma_px=self.sigma_px[keep],
            marker_covariance=self.marker_covariance[keep],
        )

    def model(self, pose: Pose) -> CameraModel:
        """Return the camera at `pose`."""
        return CameraModel(self.camera.intrinsics, pose, self.camera.size_px)

    def residual_px(self, pose: Pose) -> FloatArray:
        """Return measured minus projected (N, 2).

        Raises:
            ValueError: a fiducial lies behind the camera.
        """
        return self.pixels - self.model(pose).project(self.points_box)


@dataclass(frozen=True, eq=False)
class Linear:
    """One view linearised at a pose: R = 2 N rows, pixel x then y of each fiducial.

    residual (R,); by_pose (R, 6); by_intrinsics (R, 9); by_marker (R, 3 N); pixel_variance (R,), px^2, as the view
    states it.
    """

    residual: FloatArray
    by_pose: FloatArray
    by_intrinsics: FloatArray
    by_marker: FloatArray
    pixel_variance: FloatArray

    @classmethod
    def of(cls, view: PoseView, pose: Pose) -> "Linear":
        """Return the view at a pose.

        Raises:
            ValueError: a fiducial lies behind the camera.
        """
        model = view.model(pose)
        count = len(view.names)
        pixels, by_box = model.project_with_jacobian(view.points_box)
        by_marker = np.zeros((2 * count, 3 * count))
        for i in range(count):
            by_marker[2 * i : 2 * i + 2, 3 * i : 3 * i + 3] = by_box[i]
        return cls(
            (view.pixels - pixels).reshape(-1),
            pose_jacobian(model, view.points_box).reshape(-1, 6),
            intrinsics_jacobian(model, view.points_box).reshape(-1, 9),
            by_marker,
            np.repeat(np.square(view.sigma_px), 2),
        )


def lens_covariance(view: PoseView) -> FloatArray:
    """Return the covariance (9, 9) that the rig states for the view's lens."""
    return intrinsics_covariance(view.camera.intrinsics)


def view_of(rig: Rig, sighting: Sighting) -> PoseView:
    """Return a sighting's fiducials with their places in the box.

    Raises:
        CalibrationError: it cannot give a pose: the sighting's own problem, another size, unknown or too few fiducials.
    """
    camera = rig.cameras.get(sighting.camera)
    if camera is None:
        raise CalibrationError(
            f"The rig has no camera {sighting.camera!r}; it has {', '.join(rig.cameras)}: use one of those names."
        )
    if sighting.size_px != camera.size_px:
        (wide, high), (width, height) = camera.size_px, sighting.size_px
        raise CalibrationError(
            f"The {camera.name} picture has {width}x{height} pixels and the rig's {camera.name} camera {wide}x{high}: "
            "take the picture with the settings that the lens was calibrated with."
        )
    if sighting.problem is not None:
        raise CalibrationError(sighting.problem)
    known = known_markers(rig)
    found = {each.name: each for each in sighting.markers}
    unknown = sorted(set(found) - set(known))
    if unknown or len(found) != len(sighting.markers):
        what = f"{unknown[0]}, which the rig does not know" if unknown else "one fiducial twice"
        raise CalibrationError(f"The {camera.name} picture names {what}: mark each of {', '.join(known)} at most once.")
    if len(found) < FEWEST:
        seen = ", ".join(sorted(found)) or "none"
        raise CalibrationError(
            f"The {camera.name} camera sees {len(found)} fiducials ({seen}) and its pose needs {FEWEST}: "
            "take a picture in which a whole cross is in view."
        )
    names = tuple(name for name in known if name in found)
    points = np.stack([known[name].position_mm for name in names])
    if _on_a_line(points):
        raise CalibrationError(
            f"The fiducials that the {camera.name} camera sees ({', '.join(names)}) lie on one line, or all but one of "
            "them do: a pose needs four that span a plane."
        )
    return PoseView(
        camera,
        names,
        points,
        np.stack([found[name].centre_px for name in names]),
        np.array([found[name].sigma_px for name in names]),
        np.stack([_marker_covariance(known[name]) for name in names]),
    )


def known_markers(rig: Rig) -> Mapping[str, Marker]:
    """Return the rig's fiducials of both crosses by name.

    Raises:
        CalibrationError: there are none, or two have one name.
    """
    every = [each for group in rig.markers.values() for each in group]
    known = {each.name: each for each in every}
    if not every:
        raise CalibrationError(
            "The rig has no fiducials: add [markers.top] and [markers.front], with the places on your crosses, to it."
        )
    if len(known) != len(every):
        twice = next(name for name in known if sum(each.name == name for each in every) > 1)
        raise CalibrationError(f"The rig has two fiducials named {twice}: give each its own name.")
    return known


def _marker_covariance(marker: Marker) -> FloatArray:
    std = np.broadcast_to(marker.provenance.std.get("position_mm", 0.0), 3)
    return np.diag(np.square(std))


def _on_a_line(points: FloatArray) -> bool:
    """Return whether all points, or all but one, lie on one line."""
    for out in range(len(points)):
        rest = np.delete(points, out, axis=0)
        spread = np.linalg.svd(rest - rest.mean(axis=0), compute_uv=False)
        if spread[1] < 1e-2 * max(spread[0], 1e-12):
            return True
    return False
