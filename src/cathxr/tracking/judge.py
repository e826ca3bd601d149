"""Whether a fitted curve can be what both pictures show, and how sure its tip is."""

import math
from collections.abc import Sequence

from cathxr.core import Detection, FloatArray
from cathxr.tracking.fit import CurveFit
from cathxr.tracking.judge_kernels import agreement, folded_at_tip, tip_variance
from cathxr.tracking.pair_work import LEAST_OUTLINE, PairWork

RESOLVED_MM = 0.4
"""A tip less sure than this is not where both pictures show it, but where the curve's smoothness puts it."""
GUESSED_MM = 1.5
"""And a tip less sure than this is no use for the next pair either: the shape is a guess."""
UNRESOLVED = "the tip is not resolved"
_CORRELATION = 1.1
"""Neighbouring profiles share pixels and blur, so they are not quite independent: a factor on the pictures' part of
sigma. With it, and no calibration error, error / sigma is about 0.8 on the twin's smooth, noisy and faint scenes."""
_OUTLINE_SHARE = 0.7
"""The share of an end's outline that must lie on the fitted tube's: less is not that tube's end."""
_OUTLINE_PX = 0.15
_INSIDE_PX = 0.5
_MOST_ADDED_RADII = 2.5
"""Debris at the tip adds no more than this to a silhouette: more is the catheter itself."""
_CLEAR_CAP = 0.3
"""In one view at least, so much of the end's outline is the rounded end's: else it may be a crossing, and no end."""
_SEEN_CAP = 5
_UNSEEN_MM = 1.0
"""A tip that one view does not show (fewer points of the outline are the rounded end's) is no surer than this."""
_LEAST_CAP = 3
"""So many points of the outline on the rounded end show where it is."""
_CONTAINED_RADII = 1.0
"""Where its outline does not show the tip, it lies in the silhouette: as near as this to the measured midline."""


def judged(
    table: FloatArray,
    detections: Sequence[Detection],
    work: PairWork,
    fit: CurveFit | None,
    *,
    radius_mm: float,
    without: int | None = None,
) -> tuple[str | None, float]:
    """Return why a fit cannot be what the pictures show (None when it can) and its tip's sigma, mm.

    table: see `fit.camera_table`; work: holds what the detections measured; fit: None for one that ran away. without:
    the view whose end's outline had no part in the fit. sigma: root of the trace of the covariance from pictures and
    prior. Where the end's outline fits worse than its own sigma says, all that follows is as much less sure; where a
    view does not show the end, only the curve's smoothness places it.
    """
    if fit is None:
        return "the two views disagree", math.inf
    if folded_at_tip(fit.spans, fit.control, radius_mm):
        return "the fitted curve turns back at its tip", math.inf
    outlined = any(len(each.end_px) >= LEAST_OUTLINE for each in detections)
    reason = None
    clear, unseen, excess = not outlined, False, 1.0
    thinnest = math.inf
    first = begin = 0
    for view, each in enumerate(detections):
        stop, end = first + len(each.curve_px), begin + len(each.end_px)
        radius, added, away, inside, share, on_cap, own_excess = agreement(
            fit.spans, fit.control, table, view, (first, stop), (begin, end), fit.end_off_px, fit.caps, _OUTLINE_PX,
            work.arrays,
        )  # fmt: skip
        first, begin = stop, end
        if radius < 0.0:
            return "the two views disagree", math.inf
        thinnest = min(thinnest, radius)
        if view != without:
            unseen = unseen or (outlined and on_cap < _SEEN_CAP)
            excess = max(excess, own_excess)
        if added > _MOST_ADDED_RADII * radius:
            reason = f"the {each.camera} camera shows more than one catheter can be"
        if len(each.end_px) < LEAST_OUTLINE:
            continue
        clear = clear or on_cap >= _CLEAR_CAP * len(each.end_px)
        if view == without and inside < -_INSIDE_PX:
            # dirt and bubbles add to a silhouette and take nothing away: the tip must lie inside
            reason = f"the tip is not where the {each.camera} camera sees it"
        elif view != without and share < _OUTLINE_SHARE:
            reason = f"something lies at the tip ({each.camera})"
        elif without is not None and on_cap < _LEAST_CAP and away > _CONTAINED_RADII * radius:
            reason = f"the two views disagree about the tip ({each.camera})"
    if not clear:
        reason = reason or "the tip is not seen clearly"
    if fit.rms_px > max(2.0, 0.6 * thinnest) or fit.tip_gap_px > max(4.0, 1.2 * thinnest):
        reason = f"the two views disagree by {min(max(fit.rms_px, fit.tip_gap_px), 9999.0):.1f} px"
    variance = tip_variance(fit.spans, fit.control, fit.factor, radius_mm, work.arrays.gain) * excess
    sigma = math.sqrt(variance) * _CORRELATION if variance >= 0.0 else math.inf
    return reason, max(sigma, _UNSEEN_MM) if unseen else sigma
