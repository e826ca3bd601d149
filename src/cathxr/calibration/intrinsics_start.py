"""Where the fit of a lens begins: OpenCV's closed form and calibration, or what the rig says."""

from collections.abc import Sequence

import cv2
import numpy as np

from cathxr.calibration.intrinsics_fit import BoardCorners
from cathxr.core import FloatArray, Intrinsics

_FLAGS = cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST


def first_lens(
    views: Sequence[BoardCorners], size_px: tuple[int, int], start: Intrinsics | None
) -> tuple[FloatArray, FloatArray] | None:
    """Return a lens (9,) and each view's pose (V, 6) to begin with, None where none can be found."""
    tries = [_by_opencv(views, size_px)]
    if start is not None:
        tries.append(_by_poses(views, np.concatenate([start.focal_px, start.centre_px, start.distortion])))
    width, height = size_px
    guess = np.array([1.2 * width, 1.2 * width, 0.5 * width, 0.5 * height, 0.0, 0.0, 0.0, 0.0, 0.0])
    tries.append(_by_poses(views, guess))
    good = [each for each in tries if each is not None and _sane(each[0], size_px)]
    return min(good, key=lambda each: _scatter_px(views, *each), default=None)


def _by_opencv(views: Sequence[BoardCorners], size_px: tuple[int, int]) -> tuple[FloatArray, FloatArray] | None:
    points = [view.points_mm.astype(np.float32) for view in views]
    corners = [view.corners_px.astype(np.float32) for view in views]
    try:
        _, matrix, distortion, turns, shifts = cv2.calibrateCamera(
            points, corners, size_px, np.eye(3), np.zeros(5), flags=_FLAGS
        )
    except cv2.error:
        return None
    lens = np.concatenate([matrix[[0, 1, 0, 1], [0, 1, 2, 2]], np.asarray(distortion).ravel()[:5]])
    poses = np.array([np.concatenate([turn.ravel(), shift.ravel()]) for turn, shift in zip(turns, shifts, strict=True)])
    if not (np.isfinite(lens).all() and np.isfinite(poses).all()):
        return None
    return lens.astype(np.float64), poses.astype(np.float64)


def _by_poses(views: Sequence[BoardCorners], lens: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    matrix = np.array([[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]])
    poses = []
    for view in views:
        try:
            found, turn, shift = cv2.solvePnP(
                view.points_mm, view.corners_px, matrix, lens[4:], flags=cv2.SOLVEPNP_ITERATIVE
            )
        except cv2.error:
            return None
        if not found:
            return None
        poses.append(np.concatenate([turn.ravel(), shift.ravel()]))
    return lens.astype(np.float64), np.array(poses, dtype=np.float64)


def _sane(lens: FloatArray, size_px: tuple[int, int]) -> bool:
    longest = max(size_px)
    return bool(
        (lens[:2] > 0.1 * longest).all() and (lens[:2] < 50.0 * longest).all() and (np.abs(lens[4:]) < 1e3).all()
    )


def _scatter_px(views: Sequence[BoardCorners], lens: FloatArray, poses: FloatArray) -> float:
    matrix = np.array([[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]])
    each = [
        np.sqrt(
            np.mean(
                (view.corners_px - cv2.projectPoints(view.points_mm, pose[:3], pose[3:], matrix, lens[4:])[0][:, 0])
                ** 2
            )
        )
        for view, pose in zip(views, poses, strict=True)
    ]
    return float(np.median(each))
