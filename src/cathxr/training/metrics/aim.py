"""How well beams and planes were aimed at the moments when their targets were reached."""

from collections.abc import Callable

import numpy as np

from cathxr.training.closeness import Closeness, closeness
from cathxr.training.metrics.measure import Measure, Run, none


def _at_reached(run: Run, kinds: tuple[str, ...], pick: Callable[[Closeness], float | None], what: str) -> Measure:
    """Return the mean of a figure over the reached targets of some kinds, taken from the Track that reached them."""
    values = []
    for each in run.reached:
        target = run.placed.target(each.result.key)
        at = int(np.searchsorted(run.motion.t_s, (each.until_ns - run.result.began_ns) / 1e9 - 1e-9))
        if target.kind not in kinds or at >= len(run.motion.t_s) or not run.motion.seen[at]:
            continue
        if target.kind != "tip" and not run.motion.rolled[at]:
            continue
        value = pick(closeness(target, run.motion.tip_box[at], run.motion.rotation[at]))
        values += [] if value is None else [value]
    return Measure(float(np.mean(values))) if values else none(f"no {what} was reached")


def tip_distance(run: Run) -> Measure:
    """Return the mean distance of the tip from its target when reached, mm."""
    return _at_reached(run, ("tip",), lambda each: each.distance_mm, "target for the tip")


def beam_distance(run: Run) -> Measure:
    """Return the mean distance of the beam from its target when reached, mm."""
    return _at_reached(run, ("beam",), lambda each: each.distance_mm, "target for the beam")


def aim_angle(run: Run) -> Measure:
    """Return the mean angle between the beam, or the tip's axis, and what it should point to when reached, degrees."""
    return _at_reached(run, ("tip", "beam"), lambda each: each.angle_deg, "target with a direction")


def plane_angle(run: Run) -> Measure:
    """Return the mean angle between the image plane and the wanted one when reached, degrees."""
    return _at_reached(run, ("plane",), lambda each: each.angle_deg, "view")


def plane_direction(run: Run) -> Measure:
    """Return the mean angle between the beam and the wanted view's beam when reached, degrees."""
    return _at_reached(run, ("plane",), lambda each: each.up_deg, "view")


def plane_offset(run: Run) -> Measure:
    """Return the mean distance of the image plane from the wanted place when reached, mm."""
    return _at_reached(run, ("plane",), lambda each: each.distance_mm, "view")
