"""A first pose of one camera: every solution that the fiducials allow, and the plausible one that explains most.

One plane seen once has two poses (Collins and Bartoli, "Infinitesimal plane-based pose estimation", IJCV 2014); eight
fiducials of two planes have one, found by SQPnP (Terzakis and Lourakis, ECCV 2020).
"""

import cv2
import numpy as np

from cathxr.calibration.pose_view import FEWEST, Linear, PoseView
from cathxr.core import CalibrationError, FloatArray, Pose, Roi
from cathxr.geometry.pose import angle_between, perturbed

_FLAT_MM = 0.5
"""Fiducials this near to one plane count as lying in it: crosses are printed and measured to a tenth."""
_ROBUST_SIGMAS = 3.0
_TOLERATED_SIGMAS = (1000.0, 100.0, 20.0, _ROBUST_SIGMAS)
_FEW_STEPS, _STEPS = 6, 30
_MOST_STARTS = 5
_SAME_RAD = np.deg2rad(0.5)
_AS_GOOD = 9.0
"""Two solutions whose robust costs differ by less explain the picture equally well: three standard deviations."""
_LEAST_COSINE = 0.3
"""A camera more than 72° off its side of the box is another one: the two look along axes at right angles."""
_SIDES = {"top": (np.array([0.0, 0.0, 1.0]), "above"), "front": (np.array([0.0, -1.0, 0.0]), "on the −y side of")}


def first_pose(view: PoseView, roi: Roi) -> tuple[Pose, str | None]:
    """Return a pose near the best one, robust against some wrong fiducials, and a warning where another is as good.

    Raises:
        CalibrationError: the fiducials have no pose, or only one where no camera can be.
    """
    starts = sorted(_candidates(view), key=lambda pose: _cost(view, pose, _TOLERATED_SIGMAS[1]))
    refined: list[Pose] = []
    for start in starts[:_MOST_STARTS]:
        if all(angle_between(start, each) > _SAME_RAD for each in refined):
            pose = _refined(view, start)
            refined += [] if pose is None else [pose]
    if not refined:
        raise CalibrationError(
            f"The fiducials of the {view.camera.name} picture fit no camera pose: check their names and the lens."
        )
    ranked = sorted(refined, key=lambda pose: _cost(view, pose))
    plausible = [pose for pose in ranked if _wrong_place(view, pose, roi) is None]
    if not plausible or _cost(view, ranked[0]) + _AS_GOOD < 0.1 * _cost(view, plausible[0]):
        raise CalibrationError(_implausible(view, ranked[0], roi))
    best = plausible[0]
    others = [
        pose
        for pose in plausible[1:]
        if angle_between(pose, best) > _SAME_RAD and _cost(view, pose) < _cost(view, best) + _AS_GOOD
    ]
    if not others:
        return best, None
    earlier = view.camera.camera_from_box
    chosen = min([best, *others], key=lambda pose: angle_between(pose, earlier))
    apart = np.rad2deg(max(angle_between(pose, best) for pose in others))
    return chosen, (
        f"The fiducials of the {view.camera.name} camera fit two poses {apart:.1f}° apart nearly equally well; the one "
        "nearer to the rig's earlier pose was taken: let the camera see both crosses to be sure."
    )


def _candidates(view: PoseView) -> list[Pose]:
    """Return starting poses: both of each plane of four, the general one of all, and the rig's earlier pose."""
    try:
        normalised = view.model(view.camera.camera_from_box).undistort(view.pixels)
    except ValueError as error:
        raise CalibrationError(
            f"A fiducial of the {view.camera.name} picture lies where the rig's lens cannot see ({error}): "
            "calibrate the intrinsics first, with this camera's resolution."
        ) from error
    found = [view.camera.camera_from_box]
    for plane in _planes(view.points_box):
        found += _solved(view.points_box[plane], normalised[plane], cv2.SOLVEPNP_IPPE)
    if len(view.names) > FEWEST or not found[1:]:
        found += _solved(view.points_box, normalised, cv2.SOLVEPNP_SQPNP)
    return found


def _planes(points: FloatArray) -> list[np.ndarray]:
    """Return the indices of each coplanar set of at least four: all of them, or those across each axis of the box."""
    sets = [np.arange(len(points))]
    for axis in range(3):
        for level in np.unique(np.round(points[:, axis], 1)):
            sets.append(np.flatnonzero(np.abs(points[:, axis] - level) < _FLAT_MM))
    found: dict[tuple[int, ...], np.ndarray] = {}
    for each in sets:
        if len(each) >= FEWEST:
            spread = np.linalg.svd(points[each] - points[each].mean(axis=0), compute_uv=False)
            if spread[2] < _FLAT_MM and spread[1] > 10.0 * _FLAT_MM:
                found.setdefault(tuple(int(i) for i in each), each)
    return list(found.values())


def _solved(points: FloatArray, normalised: FloatArray, method: int) -> list[Pose]:
    """Return what OpenCV's solver finds; nothing where it fails."""
    try:
        count, turns, shifts, _ = cv2.solvePnPGeneric(
            np.ascontiguousarray(points), np.ascontiguousarray(normalised), np.eye(3), np.zeros(5), flags=method
        )
    except cv2.error:
        return []
    solutions = [np.concatenate([np.ravel(turns[i]), np.ravel(shifts[i])]) for i in range(count)]
    return [perturbed(Pose.identity(), each) for each in solutions if np.isfinite(each).all()]


def _refined(view: PoseView, start: Pose) -> Pose | None:
    """Return the pose with the least robust reprojection error near `start`; None where fiducials stay behind it.

    Reweighted least squares with a Cauchy loss that tightens: wide it finds the far, tight it ignores the wrong.
    """
    pose, tight = start, len(_TOLERATED_SIGMAS) - 1
    for stage, tolerated in enumerate(_TOLERATED_SIGMAS):
        cost = _cost(view, pose, tolerated)
        if not np.isfinite(cost):
            return None
        for _ in range(_STEPS if stage == tight else _FEW_STEPS):
            step = _robust_step(view, pose, tolerated)
            for fraction in (1.0, 0.5, 0.25, 0.06, 0.01):
                moved = perturbed(pose, fraction * step)
                less = _cost(view, moved, tolerated)
                if less <= cost:
                    break
            else:
                break
            settled = cost - less < 1e-9 * (1.0 + cost)
            pose, cost = moved, less
            if settled:
                break
    return pose


def _robust_step(view: PoseView, pose: Pose, tolerated: float) -> FloatArray:
    linear = Linear.of(view, pose)
    square = np.square(linear.residual).reshape(-1, 2).sum(axis=1) / np.square(view.sigma_px)
    weight = np.repeat(np.sqrt(1.0 / (1.0 + square / tolerated**2)) / view.sigma_px, 2)
    by_pose = linear.by_pose * weight[:, None]
    size = np.linalg.norm(by_pose, axis=0)
    return np.asarray(np.linalg.lstsq(by_pose / size, linear.residual * weight, rcond=None)[0] / size, dtype=np.float64)


def _cost(view: PoseView, pose: Pose, tolerated: float = _ROBUST_SIGMAS) -> float:
    """Return the robust (Cauchy) cost of a pose, in squared standard deviations where small; infinite from behind."""
    try:
        square = np.square(view.residual_px(pose)).sum(axis=1) / np.square(view.sigma_px)
    except ValueError:
        return np.inf
    return float(tolerated**2 * np.log1p(square / tolerated**2).sum())


def _wrong_place(view: PoseView, pose: Pose, roi: Roi) -> str | None:
    """Return where a pose puts the camera when no camera can be there."""
    centre = pose.inverse().translation_mm
    if ((centre > roi.min_mm) & (centre < roi.max_mm)).all():
        return "inside the box's region of interest"
    side = _SIDES.get(view.camera.name)
    away = centre - 0.5 * (roi.min_mm + roi.max_mm)
    if side is not None and float(away @ side[0]) < _LEAST_COSINE * float(np.linalg.norm(away)):
        return f"not {side[1]} the region of interest"
    return None


def _implausible(view: PoseView, pose: Pose, roi: Roi) -> str:
    place = _wrong_place(view, pose, roi) or "where it cannot be"
    centre = ", ".join(f"{each:.0f}" for each in pose.inverse().translation_mm)
    return (
        f"By its fiducials the {view.camera.name} camera would be {place}, at ({centre}) mm: check that the top and "
        "the front picture are not exchanged or mirrored, and that each colour sits where the rig says."
    )
