"""The rim of a round coloured thing, to hundredths of a pixel, and where the middle of the thing itself projects.

A ball's outline is a cone of rays: rays u on it satisfy u . n = 1 with n = axis / cos(half angle), which is linear. The
axis is the ray to the ball's centre: the outline's own centre in the picture is not quite that. A disc's rim is a
circle in its plane, linear too; its centre is found there and projected.
"""

from dataclasses import dataclass

import numpy as np

from cathxr.calibration import marker_kernels
from cathxr.core import FloatArray, PixelArray
from cathxr.geometry import CameraModel

_STEP_PX = 0.5
_LEAST_RAYS, _MOST_RAYS = 36, 160
_CORRELATION = 1.6
"""Variance of a mean over rays 1 px apart at the rim, relative to independent ones: lens blur and bilinear sampling."""
_FLOOR_PX = 0.015
_SIZE_TOLERANCE = 0.06
"""Of an expected size; the length of a cone's solution grows with its square."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A round rim. centre_px (2,): where the thing's centre projects; sigma_px along each axis; radius_px: apparent.

    share: how much of the rim agrees, 0 to 1. rms_px: of the rim's points about it. rim_px (N, 2): points on it.
    weight (N,): of each, 0 where it disagrees. half_angle_rad: of the cone of rays.
    """

    centre_px: FloatArray
    sigma_px: float
    radius_px: float
    share: float
    rms_px: float
    rim_px: FloatArray
    weight: FloatArray
    half_angle_rad: float


def outline_of(
    model: CameraModel, pixels: PixelArray, centre_px: FloatArray, *, radius_px: float, direction: FloatArray
) -> Outline | None:
    """Return the rim of the round thing near centre_px (2,), or None where there is none.

    direction (3,): what to look along in BGR so that the thing stands out from everything grey.
    """
    count = int(np.clip(2.0 * np.pi * radius_px, _LEAST_RAYS, _MOST_RAYS))
    found, centre, radius = None, np.asarray(centre_px), radius_px
    for reach in (0.5 * radius_px + 2.5, 0.12 * radius_px + 2.5):
        points = np.empty((count, 4))
        marker_kernels.rim(pixels, direction, centre[0], centre[1], np.full(count, radius), reach, _STEP_PX, points)
        found = ball_through(model, points)
        if found is None:
            return None
        centre, radius = found.centre_px, found.radius_px
        if not 0.4 * radius_px < radius < 2.5 * radius_px or np.hypot(*(centre - centre_px)) > radius_px + 2.0:
            return None
    return found


def disc_centre(
    model: CameraModel, outline: Outline, point_box: FloatArray, normal_box: FloatArray
) -> tuple[FloatArray, float] | None:
    """Return (centre_px (2,), rms_px) of an outline taken for the rim of a disc in a plane of `box`, None: no circle.

    The plane goes through point_box (3,) mm with the unit normal normal_box (3,).
    """
    try:
        rays = model.ray(outline.rim_px)
    except ValueError:
        return None
    facing = rays @ normal_box
    if (np.abs(facing) < 0.05).any():
        return None
    depth = ((point_box - model.centre_box) @ normal_box) / facing
    places = model.centre_box + rays * depth[:, None] - point_box
    across = np.linalg.svd(normal_box[None])[2][1:]
    flat = places @ across.T
    rows = np.column_stack([2.0 * flat, np.ones(len(flat))])
    scale = outline.radius_px / max(float(np.sqrt(np.mean(np.sum(flat**2, axis=1)))), 1e-9)
    gate = _gate_px(outline.radius_px)
    answer = marker_kernels.robust_circle(
        rows, np.sum(flat**2, axis=1), outline.weight, False, scale, gate, np.zeros(2)
    )
    solution, residual, use, _ = answer
    if use.sum() <= 0.0:
        return None
    centre = model.project(point_box + solution[:2] @ across)
    return centre, float(np.sqrt(use @ residual**2 / use.sum()))


def ball_through(
    model: CameraModel, points: FloatArray, *, gate_px: float | None = None, half_angle_rad: float | None = None
) -> Outline | None:
    """Return the outline of a ball through rim points (N, 4) as `marker_kernels.rim` gives them, None: there is none.

    half_angle_rad: of the cone of rays, where it is known.
    """
    drop = points[:, 3]
    seen = drop > 0.0
    if seen.sum() < 8:
        return None
    typical = float(np.median(drop[seen]))
    seen &= drop > 0.3 * typical
    rim = points[seen, :2]
    try:
        normalised = model.undistort(rim)
    except ValueError:
        return None
    rays = np.concatenate([normalised, np.ones((len(rim), 1))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    radius = float(np.median(np.hypot(*(rim - rim.mean(axis=0)).T)))
    middle = rays.mean(axis=0)
    spread = float(np.median(np.linalg.norm(rays - middle, axis=1)))
    scale = radius / max(spread, 1e-9)
    weight = np.minimum(drop[seen] / typical, 1.0)
    expected = np.zeros(2)
    if half_angle_rad is not None:
        expected[:] = 1.0 / np.cos(half_angle_rad), np.tan(half_angle_rad) ** 2 * _SIZE_TOLERANCE
    solution, residual, use, normal = marker_kernels.robust_circle(
        rays, np.ones(len(rays)), weight, True, scale, _gate_px(radius) if gate_px is None else gate_px, expected
    )
    length = float(np.linalg.norm(solution))
    if use.sum() <= 0.0 or length <= 1.0 or solution[2] <= 0.0:
        return None
    agree = use > 0.25 * weight
    rms = float(np.sqrt(use @ residual**2 / use.sum()))
    covariance = np.linalg.inv(normal) * (rms**2 * _CORRELATION * len(use) / max(len(use) - 3, 1))
    axis = solution / length
    across = covariance - np.outer(axis, axis @ covariance)
    spread_px = scale * np.sqrt(max(0.5 * float(np.trace(across)), 0.0)) / length
    centre = model.pixels_from_normalised(axis[:2] / axis[2])
    apparent = float(np.average(np.hypot(*(rim - centre).T), weights=use))
    share = float(agree.sum()) / len(points)
    return Outline(
        centre, float(np.hypot(spread_px, _FLOOR_PX)), apparent, share, rms, rim, use, float(np.arccos(1.0 / length))
    )


def _gate_px(radius_px: float) -> float:
    return max(1.0, 0.10 * radius_px)
