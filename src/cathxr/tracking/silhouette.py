"""A catheter that lies over itself in one view: the other view's midline and the whole silhouette, fitted together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import Detection, FloatArray, Roi
from cathxr.geometry import CameraModel, resampled
from cathxr.tracking.fit import CurveFit, fit_curve, guess_of
from cathxr.tracking.guess_kernels import place
from cathxr.tracking.judge import RESOLVED_MM
from cathxr.tracking.judge_kernels import agreement, folded_at_tip, tip_variance
from cathxr.tracking.pair_work import DISCS, LINE_POINTS, RIM_CUT_PX, PairWork, rim_only
from cathxr.tracking.rim_kernels import KEPT, KEPT_FEWER, distances, held, invented, set_discs, unexplained
from cathxr.tracking.solve import Solution
from cathxr.tracking.starts import depth_starts

_ROUNDS = 3
_OFF_RADII, _OFF_PX = 0.15, 0.5
"""A rim's point that is off by more is not the fitted tube's."""
_MOST_UNEXPLAINED = 0.08
_LONGEST_RADII, _LONGEST_CORNER_RADII, _LONGEST_CARRIED_RADII = 1.0, 1.3, 2.5
"""No longer part of a silhouette's rim may be left unexplained, in radii of the catheter: anywhere, in corners, and in
corners by the curve that the last ones say and both rims agree with."""
_RMS_RADII, _RMS_PX = 0.01, 0.12
"""A rim that is off by more, its corners apart, is explained by a tube that runs otherwise."""
_BESIDE_RADII, _FAR_SHARE, _FEW_SHARE = 0.7, 0.3, 0.1
"""Debris and bubbles beside a catheter add this much to its rim at most, of which the second share only a little: the
rest lies on the right curve's."""
_LEAST_RIM = 20
_ROUGH_PX = 0.15
"""A rim that is rougher than this, RMS, as of a matte by colours or with dirt all along, says nothing of the curve."""
_WELL_PX = 0.08
"""What noise and blur leave of a rim, RMS: sigma grows with what is more."""
_CLEARLY_BETTER = 1.7
_SLACK = 0.35
_MOST_INVENTED = 3
"""So many of the curve's samples may stick out of a silhouette, by that share of the radius: beside the inlet."""
_MOST_HIDDEN = 0.3
"""No more of a catheter can lie outside its silhouette, where glare takes away from that."""
_CLEAR_CAP = 5
_MOST_ADDED_RADII = 2.5
_OUTLINE_SHARE = 0.7
_OUTLINE_PX = 0.15
_CORRELATION = 1.3
"""Neighbouring points of a rim share pixels and blur: a factor on sigma."""
_SAME_MM = 0.3
"""Solutions whose tips are nearer together than this are one."""

_NONE_HELD = np.zeros((0, 6))


@dataclass(frozen=True, eq=False)
class _Candidate:
    fit: CurveFit
    sigma_mm: float
    missed: float
    explains: int
    """2: every rim of both views; 1: those that it was fitted to; 0: those but for their corners."""


class SilhouetteFit:
    """Fits pairs of which a view is given by its rim."""

    def __init__(self, cameras: Sequence[CameraModel], table: FloatArray, *, radius_mm: float, roi: Roi) -> None:
        self._cameras, self._table = cameras, table
        self._radius_mm, self._roi = radius_mm, roi
        self._discs = np.zeros((DISCS, 3))
        self._rows = np.zeros((DISCS, 6))

    def explained(self, fit: CurveFit, detections: Sequence[Detection], balls: FloatArray) -> tuple[bool, bool]:
        """Return whether a fitted curve explains every rim that the views give, and whether it can still be right.

        balls (V,) mm: the tube's radii.
        """
        well = possible = True
        for view, each in enumerate(detections):
            if not len(each.rim_px):
                continue
            # also sets the view's discs, which are needed below even where another view is not explained
            missed = self._missed(fit, view, each, float(balls[view]))
            well = well and missed is not None and missed[1]
            seen = each.rim_sigma_px < RIM_CUT_PX
            # glare takes away from a silhouette, and a catheter that runs otherwise adds to it
            if np.count_nonzero(seen) < _LEAST_RIM:
                continue
            radius = float(self._discs[0, 2])
            out = invented(self._discs, each.rim_px, each.rim_sigma_px, RIM_CUT_PX, _SLACK)
            possible = possible and out <= _MOST_HIDDEN * DISCS
            off = distances(self._discs, np.ascontiguousarray(each.rim_px[seen]))
            uneven = np.minimum(np.abs(off[1:-1] - 0.5 * (off[:-2] + off[2:])), radius)
            if float(np.sqrt(np.mean(np.square(uneven)))) > _ROUGH_PX:
                continue
            off = np.maximum(off, 0.0)
            beside = np.sort(off[off < _BESIDE_RADII * radius])
            least = beside[: int((1.0 - _FEW_SHARE) * len(beside))]
            limit = 2.0 * (_RMS_RADII * radius + _RMS_PX)
            few = len(beside) < (1.0 - _FAR_SHARE) * len(off)
            possible = possible and not few and float(np.sqrt(np.mean(np.square(least)))) < limit
        return well, possible

    def found(
        self, detections: Sequence[Detection], work: PairWork, expected: FloatArray | None, *, search: bool
    ) -> Solution | None:
        """Return the curve that both views show; None where there is none, or more than one.

        expected: where the curve should be, (K, 3) mm, cap's centre first: enough where it explains all that is seen.
        search: whether it is looked for elsewhere too.
        """
        results: list[_Candidate] = []
        if expected is not None:
            near = self._fitted(detections, [len(each.rim_px) > 0 for each in detections], work, expected)
            if near is not None and near.missed < _WELL_PX:
                return Solution(near.fit, near.sigma_mm)
            results += [] if near is None else [near]
        for base, each in enumerate(detections):
            other = 1 - base
            if not search or each.reason is not None or not len(detections[other].rim_px):
                continue
            rims = [view == other for view in range(2)]
            for start in depth_starts(self._cameras, detections, base, radius_mm=self._radius_mm, roi=self._roi):
                fitted = self._fitted(detections, rims, work, start)
                if fitted is not None:
                    results.append(fitted)
        if not results:
            return None
        # what explains less counts where nothing explains more
        most = max(one.explains for one in results)
        results = [one for one in results if one.explains == most]
        best = min(results, key=lambda one: one.missed)
        tip = best.fit.control[0]
        for one in results:
            apart = float(np.linalg.norm(one.fit.control[0] - tip))
            if apart > max(_SAME_MM, 3.0 * best.sigma_mm) and one.missed < _CLEARLY_BETTER * best.missed:
                return None
        return Solution(best.fit, best.sigma_mm)

    def _fitted(
        self, detections: Sequence[Detection], rims: Sequence[bool], work: PairWork, start: FloatArray
    ) -> _Candidate | None:
        """Return the fit from a curve (K, 3) mm, cap's centre first, where it can be what the views show."""
        shown = [rim_only(each, _NONE_HELD, 1.0) if rim else each for each, rim in zip(detections, rims, strict=True)]
        fit: CurveFit | None = None
        for _ in range(_ROUNDS):
            if fit is not None:
                shown = self._held(fit, detections, rims, work.arrays.balls)
            work.take(shown)
            points = resampled(start, LINE_POINTS)
            first = 0
            for view, each in enumerate(shown):
                stop = first + len(each.curve_px)
                if stop > first and place(self._table[view], points, (first, stop), work.arrays) < 0.0:
                    return None
                first = stop
            guess = guess_of(points, work.arrays.at[: work.points].copy(), work)
            if guess is None:
                return None
            fit = fit_curve(self._table, work, guess, radius_mm=self._radius_mm, rims=True)
            if fit is None:
                return None
            start = fit.points(np.linspace(0.0, 1.0, LINE_POINTS))
            inside = np.flatnonzero(start[:, 0] < 0.0)
            if len(inside) and inside[0] > 4:
                start = start[: inside[0] + 1]
        return None if fit is None else self._judged(fit, shown, detections, rims, work)

    def _held(
        self, fit: CurveFit, detections: Sequence[Detection], rims: Sequence[bool], balls: FloatArray
    ) -> list[Detection]:
        """Return the views as the next round of fitting takes them: with what each silhouette holds of the last fit."""
        result = []
        for view, each in enumerate(detections):
            if not rims[view]:
                result.append(each)
                continue
            set_discs(fit.spans, fit.control, self._table, view, float(balls[view]), self._discs)
            count = held(self._discs, each.rim_px, each.rim_sigma_px, RIM_CUT_PX, self._rows)
            result.append(rim_only(each, self._rows[:count], float(np.median(self._discs[:, 2]))))
        return result

    def _judged(
        self,
        fit: CurveFit,
        shown: Sequence[Detection],
        detections: Sequence[Detection],
        rims: Sequence[bool],
        work: PairWork,
    ) -> _Candidate | None:
        """Return a fit with how sure it is, None where it cannot be what the views show."""
        if folded_at_tip(fit.spans, fit.control, self._radius_mm):
            return None
        arrays = work.arrays
        balls = arrays.balls.copy()
        first = begin = caps = 0
        missed, excess, clean, whole = 0.0, 1.0, True, True
        for view, each in enumerate(detections):
            stop, end = first + len(shown[view].curve_px), begin + len(shown[view].end_px)
            off = fit.end_off_px[begin:end]
            if rims[view]:
                part = self._missed(fit, view, each, float(balls[view]), off, carried=all(rims))
                if part is None:
                    return None
                missed, clean = max(missed, part[0]), clean and part[1]
                caps = max(caps, int(np.count_nonzero(fit.caps[begin:end] & (np.abs(off) < _OFF_PX))))
            else:
                radius, added, _, _, share, on_cap, own = agreement(
                    fit.spans, fit.control, self._table, view, (first, stop), (begin, end), fit.end_off_px, fit.caps,
                    _OUTLINE_PX, arrays,
                )  # fmt: skip
                if radius < 0.0 or added > _MOST_ADDED_RADII * radius or share < _OUTLINE_SHARE:
                    return None
                if fit.rms_px > max(1.0, 0.3 * radius):
                    return None
                excess, caps = max(excess, own), max(caps, on_cap)
                if len(each.rim_px):
                    part = self._missed(fit, view, each, float(balls[view]))
                    whole = whole and part is not None and part[1]
            first, begin = stop, end
        if caps < _CLEAR_CAP:
            return None
        variance = tip_variance(fit.spans, fit.control, fit.factor, self._radius_mm, arrays.gain) * excess
        rough = max(1.0, missed / _WELL_PX)
        sigma = float(np.sqrt(variance)) * _CORRELATION * rough if variance >= 0.0 else np.inf
        explains = 0 if not clean else 2 if whole else 1
        return _Candidate(fit, sigma, missed, explains) if sigma <= RESOLVED_MM else None

    def _missed(
        self,
        fit: CurveFit,
        view: int,
        detection: Detection,
        ball_mm: float,
        off: FloatArray | None = None,
        *,
        carried: bool = False,
    ) -> tuple[float, bool] | None:
        """Return how far a rim lies off a fit, px RMS, and whether that is little, its corners included.

        None where too much is unexplained or the fit sticks out. carried: it is the curve that the last ones say.
        """
        set_discs(fit.spans, fit.control, self._table, view, ball_mm, self._discs)
        radius = float(self._discs[0, 2])
        seen = detection.rim_sigma_px < RIM_CUT_PX
        sigma = np.ascontiguousarray(detection.rim_sigma_px[seen])
        if off is None:
            off = distances(self._discs, np.ascontiguousarray(detection.rim_px[seen]))
        kept, longest = (KEPT_FEWER, _LONGEST_CARRIED_RADII) if carried else (KEPT, _LONGEST_CORNER_RADII)
        share, run, rms, clean = unexplained(off, sigma, (0, len(off)), _OFF_RADII * radius + _OFF_PX, kept)
        spacing = float(np.median(np.linalg.norm(np.diff(detection.rim_px, axis=0), axis=1)))
        run_px, most = run * spacing, _RMS_RADII * radius + _RMS_PX
        if len(off) == 0 or share > _MOST_UNEXPLAINED or run_px > longest * radius or clean > most:
            return None
        out = invented(self._discs, detection.rim_px, detection.rim_sigma_px, RIM_CUT_PX, _SLACK)
        return None if out > _MOST_INVENTED else (float(rms), bool(rms <= most and run_px <= _LONGEST_RADII * radius))
