"""From two measured midlines to one fitted curve: first guesses, fits, and whether both pictures agree with the tip."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel, nearest_to_rays
from cathxr.tracking.fit import LEAST_OUTLINE, CurveFit, Guess, fit_curve, guess_of
from cathxr.tracking.matching import Matching, match, ray_distances

_MATCH_SIGMA_MM = 0.25
_CORRELATION = 1.1
"""Neighbouring profiles share pixels and blur, so they are not quite independent: a factor on the pictures' part of
sigma. With it, and no calibration error, error / sigma is about 0.8 on the twin's smooth, noisy and faint scenes."""
RESOLVED_MM = 0.3
"""A tip less sure than this is not where both pictures show it, but where the curve's smoothness puts it."""
_MOST_EXCESS = 16.0
_DENSE = 120
_HIDDEN_POINTS = 3
"""So many first points of one view without a partner in the other are no accident of the matching."""
_OUTLINE_SHARE = 0.7
"""The share of an end's outline that must lie on the fitted tube's: less is not that tube's end."""
_OUTLINE_PX = 0.15
_INSIDE_SHARE = 0.1
_INSIDE_PX = 0.5
_MOST_ADDED_RADII = 2.5
"""Debris at the tip adds no more than this to a silhouette: more is the catheter itself."""
_CLEAR_CAP = 0.3
"""In one view at least, so much of the end's outline is the rounded end's: else it may be a crossing, and no end."""
_SEEN_CAP = 5
_UNSEEN_MM = 0.6
"""A tip that one view does not show, because fewer points of the outline are the rounded end's, is no surer than this."""
_LEAST_CAP = 3
"""So many points of the outline on the rounded end show where it is."""
_CONTAINED_RADII = 1.0
"""Where its outline does not show the tip, it lies in the silhouette: as near as this to the measured midline."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A fitted curve. sigma_mm: of its tip, from pictures and prior. doubtful: a camera that shows more at the tip."""

    fit: CurveFit
    sigma_mm: float
    doubtful: str | None = None


def solved(
    cameras: Sequence[CameraModel],
    table: FloatArray,
    detections: Sequence[Detection],
    *,
    radius_mm: float,
    predicted: Guess | None = None,
) -> Solution | str:
    """Return the curve that both views show, or why there is none.

    cameras and table: of the two views, see `fit.camera_table`; radius_mm: the catheter's; predicted: where the curve
    should be, tried first.
    """
    if predicted is not None:
        fit = fit_curve(table, detections, predicted, radius_mm=radius_mm)
        sigma = tip_sigma_mm(fit, detections, None, radius_mm)
        if sigma <= RESOLVED_MM and _objection(cameras, detections, fit, None) is None:
            return Solution(fit, sigma)
    try:
        rays = [camera.ray(each.curve_px) for camera, each in zip(cameras, detections, strict=True)]
    except ValueError:
        return "the catheter lies where the lens model does not hold"
    origins = [camera.centre_box for camera in cameras]
    matching = match(ray_distances(origins[0], rays[0], origins[1], rays[1]), _MATCH_SIGMA_MM)
    if len(matching.pairs) < 4:
        return "too little of the catheter is seen"
    guesses = _guesses(cameras, detections, rays, matching)
    if predicted is not None:
        guesses.append(predicted)
    if not guesses:
        return "the two views disagree"
    reasons = []
    unresolved = []
    for guess in guesses:
        fit = fit_curve(table, detections, guess, radius_mm=radius_mm)
        reason = _objection(cameras, detections, fit, None)
        sigma = tip_sigma_mm(fit, detections, None, radius_mm)
        if reason is not None:
            reasons.append(reason)
        elif sigma <= RESOLVED_MM:
            return Solution(fit, sigma)
        else:
            unresolved.append(Solution(fit, sigma))
    # something may lie at the tip in one view: the other view and the rest of this one say where the tip is
    for guess in guesses:
        found = []
        for without, each in enumerate(detections):
            fit = fit_curve(table, detections, guess, radius_mm=radius_mm, without_end=without)
            sigma = tip_sigma_mm(fit, detections, without, radius_mm)
            if sigma <= RESOLVED_MM and _objection(cameras, detections, fit, without) is None:
                found.append(Solution(fit, sigma, each.camera))
        if len(found) == 1:
            return found[0]
    if unresolved:
        return min(unresolved, key=lambda each: each.sigma_mm)
    return reasons[0]


def tip_sigma_mm(fit: CurveFit, detections: Sequence[Detection], without: int | None, radius_mm: float) -> float:
    """Return the root of the trace of the tip's covariance from pictures and prior, mm.

    The tip lies one radius beyond the curve's beginning. Where the end's outline fits worse than its sigma says, all
    that follows from it is as much less sure.
    """
    zero = np.zeros(1)
    value, slope = fit.basis.values(zero)[0], fit.basis.slopes(zero)[0]
    velocity = slope @ fit.control
    speed = float(np.linalg.norm(velocity))
    if not 1e-6 < speed < np.inf:
        return np.inf
    tangent = velocity / speed
    turn = -(radius_mm / speed) * (np.eye(3) - np.outer(tangent, tangent))
    gain = np.kron(value, np.eye(3)) + np.kron(slope, turn)
    excess = 1.0
    for view, (off, each) in enumerate(zip(fit.ends_off_px, detections, strict=True)):
        if view != without and len(off):
            excess = max(excess, float(np.mean(np.minimum(np.square(off / each.end_sigma_px), _MOST_EXCESS))))
    sigma = float(np.sqrt(np.trace(fit.covariance_of(gain)) * excess)) * _CORRELATION
    return max(sigma, _UNSEEN_MM) if _unseen(fit, detections, without) else sigma


def _unseen(fit: CurveFit, detections: Sequence[Detection], without: int | None) -> bool:
    """Return whether a view that should show the rounded end does not: then only the curve's smoothness places it."""
    if not any(len(each.end_px) for each in detections):
        return False
    return any(
        view != without and _on_cap(fit, view, each.end_sigma_px) < _SEEN_CAP for view, each in enumerate(detections)
    )


def _on_cap(fit: CurveFit, view: int, sigma: FloatArray) -> int:
    """Return how many points of a view's outline lie on the fitted rounded end."""
    near = np.abs(fit.ends_off_px[view]) < 3.0 * sigma + _OUTLINE_PX
    return int(np.count_nonzero(fit.caps[view] & near))


def _guesses(
    cameras: Sequence[CameraModel], detections: Sequence[Detection], rays: Sequence[FloatArray], matching: Matching
) -> list[Guess]:
    """Return first guesses, most likely first: where both views begin together, and with what only one of them sees."""
    pairs = matching.pairs
    origins = np.stack([camera.centre_box for camera in cameras])
    points = nearest_to_rays(origins, np.stack([rays[0][pairs[:, 0]], rays[1][pairs[:, 1]]]))
    if not all(bool((camera.to_camera(points)[:, 2] > 1.0).all()) for camera in cameras):
        return []
    result = [_guess(points, pairs, detections)]
    alone = int(np.argmax(pairs[0]))
    count = int(pairs[0, alone])
    if count >= _HIDDEN_POINTS:
        # the tip hides behind the catheter in the other view: go on at the same depth, until the fit knows better
        camera, seen = cameras[alone], rays[alone][:count]
        depth = camera.to_camera(points[:1])[0, 2]
        along = seen @ camera.camera_from_box.rotation[2]
        ahead = origins[alone] + seen * (depth / along)[:, None]
        own = np.full((count, 2), -1, dtype=np.int64)
        own[:, alone] = np.arange(count)
        result.append(_guess(np.vstack([ahead, points]), np.vstack([own, pairs]), detections))
    return result


def _guess(points: FloatArray, pairs: NDArray[np.int64], detections: Sequence[Detection]) -> Guess:
    start, fraction = thinned(points)
    starts_at = tuple(_parameters(pairs[:, view], fraction, len(each.curve_px)) for view, each in enumerate(detections))
    return guess_of(start, starts_at)


def _objection(
    cameras: Sequence[CameraModel],
    detections: Sequence[Detection],
    fit: CurveFit,
    without: int | None,
) -> str | None:
    """Return why a fit cannot be what the pictures show, None when it can."""
    width = 2.0 * min(float(np.median(each.half_width_px)) for each in detections)
    if (
        not np.isfinite(fit.control).all()
        or fit.rms_px > max(2.0, 0.3 * width)
        or fit.tip_gap_px > max(4.0, 0.6 * width)
    ):
        return f"the two views disagree by {min(max(fit.rms_px, fit.tip_gap_px), 9999.0):.1f} px"
    curve = fit.points(np.linspace(0.0, 1.0, _DENSE))
    clear = all(len(each.end_px) < LEAST_OUTLINE for each in detections)
    for view, (camera, each) in enumerate(zip(cameras, detections, strict=True)):
        off, sigma = fit.ends_off_px[view], each.end_sigma_px
        radius = float(np.median(each.half_width_px))
        line = camera.project(curve)
        apart = np.linalg.norm(each.curve_px[:, None] - line, axis=2).min(axis=1)
        step = np.linalg.norm(np.diff(each.curve_px, axis=0), axis=1)
        shown = np.flatnonzero(apart < radius)  # behind the last, at the inlet, one view may see more than the other
        if not shown.size or float(step[: shown[-1]][apart[: shown[-1]] > radius].sum()) > _MOST_ADDED_RADII * radius:
            return f"the {each.camera} camera shows more than one catheter can be"
        if len(off) < LEAST_OUTLINE:
            continue
        if view == without:
            # dirt and bubbles add to a silhouette and take nothing away: the tip must lie inside
            if float(np.quantile(off + 3.0 * sigma, _INSIDE_SHARE)) < -_INSIDE_PX:
                return f"the tip is not where the {each.camera} camera sees it"
        elif float(np.mean(np.abs(off) < 3.0 * sigma + _OUTLINE_PX)) < _OUTLINE_SHARE:
            return f"something lies at the tip ({each.camera})"
        on_cap = _on_cap(fit, view, sigma)
        clear = clear or on_cap >= _CLEAR_CAP * len(off)
        hidden = on_cap < _LEAST_CAP
        if without is not None and hidden and _away_px(line[0], each.curve_px) > _CONTAINED_RADII * radius:
            return f"the two views disagree about the tip ({each.camera})"
    return None if clear else "the tip is not seen clearly"


def _away_px(point: FloatArray, line: FloatArray) -> float:
    """Return the distance of a point (2,) from a polyline (N, 2)."""
    step = np.diff(line, axis=0)
    share = np.clip(((point - line[:-1]) * step).sum(axis=1) / np.maximum((step * step).sum(axis=1), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(line[:-1] + share[:, None] * step - point, axis=1).min())


def thinned(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (points without coincident neighbours, arc fraction of every given point), smoothed over neighbours.

    A matching on a pixel grid zigzags by a sample; a mean over five removes that before lengths are measured.
    """
    kernel = np.ones(5) / 5.0
    padded = np.vstack([2 * points[0] - points[2:0:-1], points, 2 * points[-1] - points[-2:-4:-1]])
    smooth = np.stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(3)], axis=1)
    steps = np.maximum(np.linalg.norm(np.diff(smooth, axis=0), axis=1), 1e-6)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    keep = np.concatenate([[True], steps > 1e-3])
    return smooth[keep], along / along[-1]


def _parameters(indices: NDArray[np.int64], fraction: FloatArray, count: int) -> FloatArray:
    """Return the mean arc fraction (count,) of each measured point of a view, -1 where the matching leaves it out."""
    part = indices >= 0
    total = np.bincount(indices[part], weights=fraction[part], minlength=count)
    times = np.bincount(indices[part], minlength=count)
    return np.where(times > 0, total / np.maximum(times, 1), -1.0)
