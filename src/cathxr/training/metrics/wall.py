"""Virtual wall breach: the real catheter moves where the virtual heart has a wall, which it cannot feel."""

from dataclasses import dataclass

import numpy as np

from cathxr.training.metrics.measure import Depth, Measure, Run, none
from cathxr.training.metrics.motion import Motion

BEGINS_MM, ENDS_MM = 1.0, 0.0
"""A breach begins this deep, so that voxels and noise at the surface are none, and ends where the blood begins."""


@dataclass(frozen=True)
class Breaches:
    """How often, how long, along which path, and how deep at most."""

    count: int
    time_s: float
    path_mm: float
    depth_mm: float


def breaches(motion: Motion, depth: Depth) -> Breaches:
    """Return the breaches of the tip. A step counts by half for each of its ends that is in a breach.

    A breach that is cut by a gap or a pause counts again after it; what lies in the gap does not count.
    """
    count, time_s, path_mm, deepest = 0, 0.0, 0.0, 0.0
    for segment in motion.segments():
        depths = np.asarray(depth(segment.tip_box), dtype=np.float64)
        inside = np.zeros(len(depths), bool)
        now = False
        for i, value in enumerate(depths.tolist()):
            before, now = now, value > ENDS_MM if now else value >= BEGINS_MM
            inside[i] = now
            count += now and not before
        share = 0.5 * (inside[:-1].astype(float) + inside[1:])
        time_s += float((share * np.diff(segment.t_s)).sum())
        path_mm += float((share * np.linalg.norm(np.diff(segment.tip_box, axis=0), axis=1)).sum())
        deepest = max(deepest, float(depths[inside].max()) if inside.any() else 0.0)
    return Breaches(count, time_s, path_mm, deepest)


def _of(run: Run, name: str) -> Measure:
    if run.depth is None:
        return none("no wall is known: switched off, no labels, or the extra cathxr[heart] is missing")
    return none(run.blind) if run.blind else Measure(float(getattr(breaches(run.smooth, run.depth), name)))


def breach_count(run: Run) -> Measure:
    """Return how many breaches there were."""
    return _of(run, "count")


def breach_time(run: Run) -> Measure:
    """Return how long they were, s."""
    return _of(run, "time_s")


def breach_path(run: Run) -> Measure:
    """Return the tip's path within them, mm."""
    return _of(run, "path_mm")


def breach_depth(run: Run) -> Measure:
    """Return the greatest depth, mm."""
    return _of(run, "depth_mm")
