"""Where the cameras are: poses from the fiducials on the crosses, with their errors, into a new Rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cathxr.calibration.pose_doubts import Outlier, sentence, without_outliers
from cathxr.calibration.pose_fit import PoseFit, fitted
from cathxr.calibration.pose_start import first_pose
from cathxr.calibration.pose_view import PoseView, view_of
from cathxr.calibration.sighting import Sighting
from cathxr.core import CalibrationError, FloatArray, Intrinsics, Pose, Provenance, Rig, RigCamera
from cathxr.geometry.pose import angle_between

_NOT_AS_STATED = 3.0
"""Root of chi-square per degree of freedom that two degrees of freedom exceed once in ten thousand."""
_HOPELESS_PX = 5.0
"""Residuals that no blur or seat explains: another lens, other fiducials, or another box."""


@dataclass(frozen=True, eq=False)
class MarkerResidual:
    """One fiducial after the fit: residual_px (2,) measured minus projected; sigma_px as the detector states it.

    used: False where it was left out, being far from where the others say.
    """

    camera: str
    name: str
    residual_px: FloatArray
    sigma_px: float
    used: bool = True


@dataclass(frozen=True, eq=False)
class PosesResult:
    """A rig with new poses, and what is to be said about them.

    rms_px: by camera, root mean square distance of the fiducials used, px. noise_scale: by camera, the pixel noise that
    the errors count with over what the detector states. moved: by camera, how far its centre (mm) and its turn (deg)
    are from the rig's earlier pose. warnings: sentences.
    """

    rig: Rig
    residuals: tuple[MarkerResidual, ...]
    rms_px: Mapping[str, float]
    noise_scale: Mapping[str, float]
    moved: Mapping[str, tuple[float, float]]
    warnings: tuple[str, ...]


def calibrate_poses(rig: Rig, sightings: Sequence[Sighting], *, date: str) -> PosesResult:
    """Return the rig with the pose of every camera in `sightings`, one each; the others' poses stay.

    date: ISO, of the measurement.

    Raises:
        CalibrationError: a sighting does not suffice, its fiducials contradict each other, or a camera would be where
        none can be; the sentence says what to do.
    """
    cameras = [each.camera for each in sightings]
    twice = next((name for name in cameras if cameras.count(name) > 1), None)
    if not sightings or twice is not None:
        what = (
            f"the {twice} camera is seen twice: merge its sightings" if twice else "no camera was seen: give pictures"
        )
        raise CalibrationError(f"Poses need one sighting of each camera, and {what} first.")
    whole = [view_of(rig, each) for each in sightings]
    views: list[PoseView] = []
    start: dict[str, Pose] = {}
    outliers: dict[str, tuple[Outlier, ...]] = {}
    warnings: list[str] = []
    for view in whole:
        name = view.camera.name
        first, doubt = first_pose(view, rig.roi)
        kept, start[name], outliers[name] = without_outliers(view, first)
        views.append(kept)
        warnings += [] if doubt is None else [doubt]
        warnings += [f"{sentence(name, each)}; it was left out." for each in outliers[name]]
    fit = fitted(views, start)
    for view, sighting in zip(views, sightings, strict=True):
        warnings += _misfit_warning(view, fit) + _unnamed_cross(rig, sighting)
    calibrated = {
        name: _calibrated(camera, views, fit, date) if name in fit.poses else camera
        for name, camera in rig.cameras.items()
    }
    return PosesResult(
        replace(rig, cameras=calibrated),
        tuple(each for view in whole for each in _residuals(view, fit.poses[view.camera.name], outliers)),
        {name: _rms(residual) for name, residual in fit.residual_px.items()},
        fit.noise_scale,
        {name: _moved(rig.cameras[name].camera_from_box, pose) for name, pose in fit.poses.items()},
        tuple(warnings),
    )


def with_intrinsics(rig: Rig, camera: str, intrinsics: Intrinsics) -> Rig:
    """Return the rig with another lens in a camera.

    The pose stays, and what it stated about the lens before goes: calibrate the markers again.
    """
    changed = rig.cameras[camera]
    provenance = replace(changed.pose_provenance, covariance_with_intrinsics=None)
    changed = replace(changed, intrinsics=intrinsics, pose_provenance=provenance)
    return replace(rig, cameras={**rig.cameras, camera: changed})


def pose_std(camera: RigCamera) -> tuple[FloatArray, FloatArray] | None:
    """Return standard deviations of where a camera is and how it is turned, by the rig: (3,) mm in `box`, (3,) rad.

    The first is of the camera's centre, along the box's axes; the second about the camera's own axes. None where the
    rig states no covariance.
    """
    covariance = camera.pose_provenance.covariance
    if covariance is None:
        return None
    pose = camera.camera_from_box
    # centre = -R^T t; R' = exp(w) R and t' = t + s move it by R^T (w x t - s) = -R^T (t x w + s) to first order.
    x, y, z = pose.translation_mm
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    by_step = -pose.rotation.T @ np.hstack([cross, np.eye(3)])
    centre = by_step @ covariance @ by_step.T
    return np.sqrt(np.diag(centre).clip(min=0.0)), np.sqrt(np.diag(covariance)[:3])


def _calibrated(camera: RigCamera, views: Sequence[PoseView], fit: PoseFit, date: str) -> RigCamera:
    view = next(each for each in views if each.camera.name == camera.name)
    covariance, cross = fit.covariance[camera.name], fit.covariance_with_intrinsics[camera.name]
    provenance = Provenance(
        std={"translation_mm": np.sqrt(np.diag(covariance)[3:])},
        covariance=covariance,
        covariance_with_intrinsics=cross if cross.any() else None,
        rms_px=_rms(fit.residual_px[camera.name]),
        n=len(view.names),
        date=date,
        method=f"{len(view.names)} fiducials, weighted least squares of their reprojection",
    )
    return replace(camera, camera_from_box=fit.poses[camera.name], pose_provenance=provenance)


def _residuals(view: PoseView, pose: Pose, outliers: Mapping[str, tuple[Outlier, ...]]) -> tuple[MarkerResidual, ...]:
    camera = view.camera.name
    left_out = {each.name for each in outliers[camera]}
    return tuple(
        MarkerResidual(camera, name, residual, float(sigma), name not in left_out)
        for name, residual, sigma in zip(view.names, view.residual_px(pose), view.sigma_px, strict=True)
    )


def _misfit_warning(view: PoseView, fit: PoseFit) -> list[str]:
    """Return a sentence where the residuals are much larger than stated.

    Raises:
        CalibrationError: so large that there is nothing to be had.
    """
    camera = view.camera.name
    rms, misfit = _rms(fit.residual_px[camera]), fit.misfit[camera]
    expected = float(np.sqrt(2.0 * np.mean(np.square(view.sigma_px))))
    causes = "a lens calibrated at another resolution, a cross that is not seated, or wrong places in [markers]"
    if rms > _HOPELESS_PX and misfit > _NOT_AS_STATED:
        raise CalibrationError(
            f"The fiducials of the {camera} camera do not fit any pose: {rms:.1f} px are left where {expected:.2f} px "
            f"are expected. Look for {causes}."
        )
    if misfit <= _NOT_AS_STATED:
        return []
    return [
        f"The fiducials of the {camera} camera fit {misfit:.0f} times worse than expected ({rms:.2f} px where "
        f"{expected:.2f} px are): look for {causes}."
    ]


def _unnamed_cross(rig: Rig, sighting: Sighting) -> list[str]:
    """Return a sentence where a whole second cross seems to be there but not in its place.

    Where the crosses are alike, the picture of the other camera fits the nearer cross perfectly: this is what tells.
    """
    named = {each.name for each in sighting.markers}
    size = min((each.radius_px for each in sighting.markers), default=0.0)
    unnamed = {each.colour for each in sighting.blobs if not each.name and each.radius_px > 0.5 * size}
    return [
        f"The {sighting.camera} picture shows spots of all colours of the {other} cross, and none where its fiducials "
        "should be: check that the top and the front picture are not exchanged, and that both crosses are seated."
        for other, group in rig.markers.items()
        if group and named.isdisjoint(each.name for each in group) and unnamed >= {each.colour for each in group}
    ]


def _rms(residual_px: FloatArray) -> float:
    return float(np.sqrt(np.square(residual_px).sum(axis=1).mean()))


def _moved(earlier: Pose, pose: Pose) -> tuple[float, float]:
    """Return how far apart two poses of a camera are: centre, mm, and rotation, degrees."""
    shift = pose.inverse().translation_mm - earlier.inverse().translation_mm
    return float(np.linalg.norm(shift)), float(np.rad2deg(angle_between(earlier, pose)))
