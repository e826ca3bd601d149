"""First guesses of a catheter that lies over itself in one view: from the other's midline, by a search over depths."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cathxr.core import Detection, FloatArray, Roi
from cathxr.geometry import CameraModel, resampled
from cathxr.tracking.depth_search import STEP_MM, best_depths, entry_costs, point_costs

_MOST_POINTS, _POINT_MM = 120, 1.5
_ROOM_PX = 24
_LEANS = (0.0, 0.0, 0.05, -0.05)
"""Where the catheter lies beside itself the end may be on this side or that: the tries lean to both, cost a step."""
_BONUS = 2.0
_LEFT_SHARE = 0.02
"""Less of the silhouette than this without a part of the curve over it is no reason for another try."""
_CORE = 0.6
_BEYOND_MM = 5.0


@dataclass(frozen=True, eq=False)
class _Map:
    """A silhouette in pixels: clearance (h, w) px, how far inside each is; corner (2,): the first pixel's (x, y)."""

    clearance: FloatArray
    corner: FloatArray


def depth_starts(
    cameras: Sequence[CameraModel], detections: Sequence[Detection], base: int, *, radius_mm: float, roi: Roi
) -> Iterator[FloatArray]:
    """Yield curves (N, 3) mm, cap's centre first, that project onto one view's midline and into the other's silhouette.

    Each next one is drawn to what the ones before have left of the silhouette, or leans to one side.

    base: the view whose midline is followed; radius_mm: of the catheter.
    """
    camera, other = cameras[base], cameras[1 - base]
    origin = camera.centre_box
    away = np.linalg.norm(roi.corners_mm - origin, axis=1)
    nearest_mm = float(away.min()) - _BEYOND_MM
    count = int((away.max() + _BEYOND_MM - nearest_mm) / STEP_MM)
    line = detections[base].curve_px
    length_mm = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) / _scale(camera, roi)
    wanted = min(max(int(length_mm / _POINT_MM), 12), _MOST_POINTS)
    try:
        rays = np.ascontiguousarray(camera.ray(resampled(line, wanted)))
    except ValueError:
        return
    silhouette = _map(detections[1 - base].rim_px)
    radius_px = radius_mm * _scale(other, roi)
    bonus = np.zeros_like(silhouette.clearance)
    covered = np.zeros(bonus.shape, dtype=np.uint8)
    entry = entry_costs(origin, rays[-1], nearest_mm, count)
    tipwards = np.linspace(1.0, 0.0, len(rays))[:, None] * np.arange(count)
    for lean in _LEANS:
        costs = point_costs(
            origin, rays, nearest_mm, count, other.numbers, silhouette.clearance, bonus, silhouette.corner, radius_mm
        )
        costs += lean * tipwards
        depths = nearest_mm + STEP_MM * best_depths(costs, entry)
        points = origin + depths[:, None] * rays
        yield points
        covered[:] = 0
        trail = np.round((other.project(points) - silhouette.corner) * 16.0).astype(np.int32)
        cv2.polylines(covered, [trail], False, 1, thickness=max(1, round(2.6 * radius_px)), shift=4)
        left = (silhouette.clearance > _CORE * radius_px) & (covered == 0)
        inside = silhouette.clearance > _CORE * radius_px
        if np.count_nonzero(left) < _LEFT_SHARE * np.count_nonzero(inside):
            bonus[:] = 0.0
            continue
        bonus += _BONUS * left


def _scale(camera: CameraModel, roi: Roi) -> float:
    """Return px per mm in the middle of the region of interest."""
    _, jacobian = camera.project_with_jacobian(roi.corners_mm.mean(axis=0)[None])
    return float(np.linalg.norm(jacobian[0]) / np.sqrt(2.0))


def _map(rim: FloatArray) -> _Map:
    """Return the silhouette whose closed rings (R, 2) px are given, see `Detection`."""
    corner = np.floor(rim.min(axis=0)) - _ROOM_PX
    width, height = (np.ceil(rim.max(axis=0)) + _ROOM_PX - corner).astype(int)
    mask = np.zeros((height, width), dtype=np.uint8)
    rings, begun = [], 0
    for i in range(1, len(rim)):
        if i > begun and bool((rim[i] == rim[begun]).all()):
            rings.append(np.round((rim[begun : i + 1] - corner) * 16.0).astype(np.int32))
            begun = i + 1
    cv2.fillPoly(mask, rings, 1, shift=4)
    clearance = cv2.distanceTransform(mask, cv2.DIST_L2, 3) - cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3)
    return _Map(np.asarray(clearance, dtype=np.float64), corner)
