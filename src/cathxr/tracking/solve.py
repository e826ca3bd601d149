"""From two measured midlines to one fitted curve: first guesses, fits, and whether both pictures agree with the tip."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel, nearest_to_rays
from cathxr.tracking.fit import CurveFit, Guess, fit_curve, guess_of
from cathxr.tracking.judge import RESOLVED_MM, judged
from cathxr.tracking.matching import Matching, match, ray_distances
from cathxr.tracking.pair_work import PairWork

_MATCH_SIGMA_MM = 0.25
_MATCH_SPACINGS = 0.3
"""Nor can a point lie nearer to its partner than their spacing lets it: a uniform error has that standard deviation."""
_HIDDEN_POINTS = 3
"""So many first points of one view without a partner in the other are no accident of the matching."""


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
    work: PairWork,
    *,
    radius_mm: float,
    predicted: Guess | None = None,
) -> Solution | str:
    """Return the curve that both views show, or why there is none.

    cameras and table: of the two views, see `fit.camera_table`; work: holds what the detections measured; radius_mm:
    the catheter's; predicted: where the curve should be, tried first.
    """

    def tried(guess: Guess, without: int | None = None) -> tuple[CurveFit | None, str | None, float]:
        """Return a guess's fit, what speaks against it, and its tip's sigma."""
        fit = fit_curve(table, work, guess, radius_mm=radius_mm, without_end=without)
        return fit, *judged(table, detections, work, fit, radius_mm=radius_mm, without=without)

    if predicted is not None:
        fit, reason, sigma = tried(predicted)
        if fit is not None and reason is None and sigma <= RESOLVED_MM:
            return Solution(fit, sigma)
    try:
        rays = [camera.ray(each.curve_px) for camera, each in zip(cameras, detections, strict=True)]
    except ValueError:
        return "the catheter lies where the lens model does not hold"
    origins = [camera.centre_box for camera in cameras]
    spacing_mm = max(_spacing_mm(origin, each) for origin, each in zip(origins, rays, strict=True))
    sigma_mm = max(_MATCH_SIGMA_MM, _MATCH_SPACINGS * spacing_mm)
    matching = match(ray_distances(origins[0], rays[0], origins[1], rays[1]), sigma_mm)
    if len(matching.pairs) < 4:
        return "too little of the catheter is seen"
    guesses = _guesses(cameras, detections, rays, matching, work)
    if predicted is not None:
        guesses.append(predicted)
    if not guesses:
        return "the two views disagree"
    reasons: list[str] = []
    unresolved = []
    for guess in guesses:
        fit, reason, sigma = tried(guess)
        if fit is None or reason is not None:
            reasons.append(reason or "the two views disagree")
        elif sigma <= RESOLVED_MM:
            return Solution(fit, sigma)
        else:
            unresolved.append(Solution(fit, sigma))
    # something may lie at the tip in one view: the other view and the rest of this one say where the tip is
    for guess in guesses:
        found = []
        for without, each in enumerate(detections):
            fit, reason, sigma = tried(guess, without)
            if fit is not None and reason is None and sigma <= RESOLVED_MM:
                found.append(Solution(fit, sigma, each.camera))
        # nor is anything there where both views' ends fit one curve, however unsure
        if len(found) == 1 and all(_apart_mm(found[0], one) < RESOLVED_MM for one in unresolved):
            return found[0]
    if unresolved:
        return min(unresolved, key=lambda each: each.sigma_mm)
    return reasons[0]


def _apart_mm(one: Solution, other: Solution) -> float:
    return float(np.linalg.norm(one.fit.control[0] - other.fit.control[0]))


def _spacing_mm(origin: FloatArray, rays: FloatArray) -> float:
    """Return how far apart a view's points (N, 3), unit rays from `origin`, are at the inlet's distance as a rule."""
    if len(rays) < 2:
        return 0.0
    return float(np.median(np.linalg.norm(np.diff(rays, axis=0), axis=1)) * np.linalg.norm(origin))


def _guesses(
    cameras: Sequence[CameraModel],
    detections: Sequence[Detection],
    rays: Sequence[FloatArray],
    matching: Matching,
    work: PairWork,
) -> list[Guess]:
    """Return first guesses, most likely first: where both views begin together, and with what only one of them sees."""
    pairs = matching.pairs
    origins = np.stack([camera.centre_box for camera in cameras])
    points = nearest_to_rays(origins, np.stack([rays[0][pairs[:, 0]], rays[1][pairs[:, 1]]]))
    if not all(bool((camera.to_camera(points)[:, 2] > 1.0).all()) for camera in cameras):
        return []
    result = [_guess(points, pairs, detections, work)]
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
        result.append(_guess(np.vstack([ahead, points]), np.vstack([own, pairs]), detections, work))
    return [each for each in result if each is not None]


def _guess(
    points: FloatArray, pairs: NDArray[np.int64], detections: Sequence[Detection], work: PairWork
) -> Guess | None:
    start, fraction = thinned(points)
    starts_at = [_parameters(pairs[:, view], fraction, len(each.curve_px)) for view, each in enumerate(detections)]
    return guess_of(start, np.concatenate(starts_at), work)


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
