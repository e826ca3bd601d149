"""Path and speed of the tip."""

import numpy as np

from cathxr.training.metrics.measure import Measure, Run, none
from cathxr.training.metrics.motion import Motion

_LEAST_STRAIGHT_MM = 10.0


def path_mm(motion: Motion) -> float:
    """Return the length of the tip's path over all segments, mm."""
    return float(sum(np.linalg.norm(np.diff(each.tip_box, axis=0), axis=1).sum() for each in motion.segments()))


def seen_s(motion: Motion) -> float:
    """Return the length of all segments in time, s."""
    return float(sum(each.duration_s for each in motion.segments()))


def path_length(run: Run) -> Measure:
    """Return the tip's path, mm."""
    return none(run.blind) if run.blind else Measure(path_mm(run.smooth))


def path_inefficiency(run: Run) -> Measure:
    """Return 100 (L / D - 1) %, L and D summed over the movements."""
    straight = sum(float(np.linalg.norm(each.tip_box[-1] - each.tip_box[0])) for each in run.movements)
    if not run.movements:
        return none("no target was reached in full sight")
    if straight < _LEAST_STRAIGHT_MM:
        return none(f"the straight ways are {straight:.1f} mm in all, too short to compare with")
    return Measure(100.0 * (sum(path_mm(each) for each in run.movements) / straight - 1.0))


def mean_speed(run: Run) -> Measure:
    """Return path over seen time, mm/s."""
    if run.blind:
        return none(run.blind)
    seconds = seen_s(run.smooth)
    return Measure(path_mm(run.smooth) / seconds) if seconds > 0 else none("no two samples follow each other")


def peak_speed(run: Run) -> Measure:
    """Return the greatest speed between two samples, mm/s."""
    if run.blind:
        return none(run.blind)
    peaks = [float(each.speed_mm_s.max()) for each in run.smooth.segments()]
    return Measure(max(peaks)) if peaks else none("no two samples follow each other")


def axial_motion(run: Run) -> Measure:
    """Return how much of the path runs along the tip's axis, to or fro, mm."""
    return none(run.blind) if run.blind else Measure(axial_mm(run.smooth))


def axial_mm(motion: Motion) -> float:
    """Return the sum of |step · axis|, mm, the axis being the mean of both ends' tangents."""
    total = 0.0
    for each in motion.segments():
        tangent = each.rotation[:-1, :, 2] + each.rotation[1:, :, 2]
        length = np.linalg.norm(tangent, axis=1)
        unit = tangent / np.where(length > 1e-9, length, 1.0)[:, None]
        total += float(np.abs((np.diff(each.tip_box, axis=0) * unit).sum(axis=1)).sum())
    return total
