"""From a traced path to measured midline points with errors, and the centre of the rounded end."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cathxr.core import FloatArray
from cathxr.geometry import arc_length, resampled, tangents
from cathxr.vision.profiles import crosses, edge
from cathxr.vision.segmentation import MatteArray

SPACING_PX = 2.5
MOST_POINTS = 160
_LEAST_SIGMA_PX = 0.02
"""Sampling and interpolation alone leave about this much, however clean the picture."""
_QUANTUM_PX = 1e-4
"""Measurements are rounded to this, far below their noise, so that recordings stay small and exact."""


@dataclass(frozen=True, eq=False)
class Midline:
    """Measured midline, tip first: as in Detection. The first point is the centre of the rounded end."""

    curve_px: FloatArray
    normal_px: FloatArray
    sigma_px: FloatArray
    half_width_px: FloatArray
    tip_px: FloatArray
    tip_sigma_px: float


def smoothed(values: FloatArray, half_window: int) -> FloatArray:
    """Return (N, D) values after a sliding quadratic fit (Savitzky-Golay), the ends by the outermost fit."""
    count = len(values)
    half = min(half_window, (count - 1) // 2)
    if half < 2:
        return values.copy()
    fit = _quadratic_fit(half)
    padded = np.lib.stride_tricks.sliding_window_view(values, 2 * half + 1, axis=0)
    inner = padded @ fit[0]
    result = np.empty_like(values)
    result[half : count - half] = inner
    for end, window in ((range(half), padded[0]), (range(count - half, count), padded[-1])):
        terms = window @ fit.T
        centre = half if end.start == 0 else count - 1 - half
        for i in end:
            t = float(i - centre)
            result[i] = terms[:, 0] + t * terms[:, 1] + t * t * terms[:, 2]
    return result


@lru_cache(maxsize=64)
def _quadratic_fit(half: int) -> FloatArray:
    """Return the (3, 2 half + 1) matrix that gives a window's least-squares quadratic: value, slope, half the bend."""
    at = np.arange(-half, half + 1, dtype=np.float64)
    return np.asarray(np.linalg.pinv(np.stack([np.ones_like(at), at, at * at], axis=1)), dtype=np.float64)


def measured(matte: MatteArray, path: FloatArray, width: float, plateau: float) -> Midline | None:
    """Return the midline along `path` (N, 2) px, entry first, in the matte's pixels; None where too little is seen."""
    if len(path) < 4 or arc_length(path)[-1] < 1.5 * width:
        return None
    points = path
    sections = np.empty((0, 4))
    normals = np.empty((0, 2))
    for spacing in (2.0 * SPACING_PX, SPACING_PX, SPACING_PX):
        length = float(arc_length(points)[-1])
        count = int(np.clip(length / spacing, 6, MOST_POINTS))
        points = smoothed(resampled(points, count), max(2, round(1.2 * width / (length / count))))
        along = tangents(points)
        normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
        sections = crosses(matte, points, normals, width, plateau)
        good = _good_sections(sections, width)
        if good.sum() < 5:
            return None
        moved = points + np.where(good, sections[:, 0], 0.0)[:, None] * normals
        points = moved[_first_to_last(good)]
        sections, normals, good = (each[_first_to_last(good)] for each in (sections, normals, good))
    points, normals, sections = points[good], normals[good], sections[good]
    return _with_end(matte, points, normals, sections)


def _good_sections(sections: FloatArray, width: float) -> FloatArray:
    """Return which sections are those of the tube: about as wide as most."""
    good = (sections[:, 1] > 0.3 * width) & (sections[:, 1] < 1.45 * width)
    if good.any():
        typical = np.median(sections[good, 1])
        good &= np.abs(sections[:, 1] - typical) < 0.3 * typical
    return np.asarray(good)


def _first_to_last(good: FloatArray) -> slice:
    where = np.flatnonzero(good)
    return slice(int(where[0]), int(where[-1]) + 1)


def _with_end(matte: MatteArray, points: FloatArray, normals: FloatArray, sections: FloatArray) -> Midline | None:
    """Return the midline with the rounded end located: the end's circle is fitted to edges met along the axis."""
    radius = 0.5 * float(np.median(sections[-12:, 1]))
    plateau = float(np.median(sections[-12:, 2]))
    slope = float(np.median(sections[:, 3]))
    blur = float(np.clip(plateau / max(slope, 1e-6) / np.sqrt(2.0 * np.pi), 0.3, 0.5 * radius))
    position, direction = _end_line(points, 6.0 * radius)
    reached, spread = _cap_centre(matte, position, direction, radius, plateau, blur)
    if spread is None:
        return None
    centre = position + reached * direction
    # sections inside the rounded end are narrower and carry no news of the axis
    before = (points - centre) @ direction < -0.25 * radius
    before |= np.arange(len(points)) < len(points) - 2 * int(np.ceil(2 * radius / SPACING_PX)) - 2
    points, normals, sections = points[before], normals[before], sections[before]
    if len(points) < 4:
        return None
    half_width = 0.5 * sections[:, 1]
    residual = ((points - smoothed(points, 4)) * normals).sum(axis=1)
    sigma = max(_LEAST_SIGMA_PX, 1.4826 * float(np.median(np.abs(residual))) * 1.25)
    sigmas = sigma * np.sqrt(1.0 + np.square(residual / (3.0 * sigma)))
    normal_at_end = np.array([-direction[1], direction[0]])
    return Midline(
        curve_px=_rounded(np.vstack([centre, points[::-1]])),
        normal_px=np.vstack([normal_at_end, normals[::-1]]),
        sigma_px=np.concatenate([[1.5 * sigma], sigmas[::-1]]),
        half_width_px=np.concatenate([[radius], half_width[::-1]]),
        tip_px=_rounded(centre + radius * direction),
        tip_sigma_px=float(np.hypot(spread, _LEAST_SIGMA_PX)),
    )


def _end_line(points: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Return (position, unit direction) of the midline at its last point: quadratic fit over the last `length` px."""
    along = arc_length(points) - arc_length(points)[-1]
    near = along > -length
    if near.sum() < 4:
        near[-4:] = True
    order = 2 if near.sum() >= 6 else 1
    fits = [np.polynomial.polynomial.polyfit(along[near], points[near, axis], order) for axis in (0, 1)]
    position = np.array([fit[0] for fit in fits])
    direction = np.array([fit[1] for fit in fits])
    return position, direction / np.linalg.norm(direction)


def _cap_centre(
    matte: MatteArray, position: FloatArray, direction: FloatArray, radius: float, plateau: float, blur: float
) -> tuple[float, float | None]:
    """Return (distance, error) of the rounded end's centre from `position` along `direction`; None: no end seen.

    Blur pulls the half level of a convex edge of radius R inwards by blur^2 / (2 R): undone here.
    """
    normal = np.array([-direction[1], direction[0]])
    apparent = radius - blur * blur / (2.0 * radius)
    level = 0.5 * plateau
    centres = []
    for offset in np.linspace(-0.6, 0.6, 9) * radius:
        for back in (2.0, 1.0):
            origin = position + offset * normal - back * radius * direction
            distance, _ = edge(matte, origin[0], origin[1], direction[0], direction[1], 5.0 * radius, level)
            if distance >= 0.0:
                centres.append(distance - back * radius - np.sqrt(apparent * apparent - offset * offset))
                break
    if len(centres) < 5:
        return 0.0, None
    # rays that disagree mean that the end is not a clean circle: turned towards the camera, or something lies at it
    return float(np.median(centres)), max(float(np.std(centres)), 0.02)


def _rounded(values: FloatArray) -> FloatArray:
    return np.round(values / _QUANTUM_PX) * _QUANTUM_PX
