"""Rotation, actions, idle time, and how economically the roll was used."""

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.training.metrics.measure import Measure, Run, none
from cathxr.training.metrics.motion import Motion, Segment, turns_rad

MOVING_MM_S, TURNING_DEG_S = 5.0, 15.0
"""From this speed on it is an action, until it falls below half of it."""
LEAST_ACTION_S = 0.2
IDLE_MM_S, IDLE_DEG_S = 1.0, 5.0
LEAST_IDLE_S = 0.5
_LEAST_ROLL_DEG = 5.0
_WINDOW_S = 0.1


def rotation_deg(motion: Motion) -> float:
    """Return the sum of the angles between orientations, degrees."""
    return float(sum(np.degrees(turns_rad(each.rotation)).sum() for each in motion.segments()))


def rotation_total(run: Run) -> Measure:
    """Return how far the tip has turned in all, degrees."""
    return none(run.blind) if run.blind else Measure(rotation_deg(run.motion))


def actions(rates: FloatArray, steps_s: FloatArray, threshold: float) -> int:
    """Return how many actions a rate (M,) has over steps (M,): from the threshold to below half of it, for 0.2 s."""
    count, on, length = 0, False, 0.0
    for rate, step in zip(rates.tolist(), steps_s.tolist(), strict=True):
        on = rate >= (0.5 * threshold if on else threshold)
        if not on:
            count += length >= LEAST_ACTION_S - 1e-9
            length = 0.0
        else:
            length += step
    return count + (length >= LEAST_ACTION_S - 1e-9)


def translation_actions(run: Run) -> Measure:
    """Return how many translation actions there were."""
    if run.blind:
        return none(run.blind)
    parts = run.smooth.segments()
    return Measure(float(sum(actions(each.speed_mm_s, np.diff(each.t_s), MOVING_MM_S) for each in parts)))


def rotation_actions(run: Run) -> Measure:
    """Return how many rotation actions there were."""
    if run.blind:
        return none(run.blind)
    parts = run.motion.segments()
    return Measure(float(sum(actions(turn_rates(each), np.diff(each.t_s), TURNING_DEG_S) for each in parts)))


def idle_time(run: Run) -> Measure:
    """Return how long the tip was idle, s."""
    if run.blind:
        return none(run.blind)
    return Measure(
        sum(
            idle_s(each, turn_rates(raw))
            for each, raw in zip(run.smooth.segments(), run.motion.segments(), strict=True)
        )
    )


def idle_s(segment: Segment, turning_deg_s: FloatArray) -> float:
    """Return how long a segment is idle: slower than 1 mm/s and 5 degrees/s for half a second at least, s."""
    still = (segment.speed_mm_s < IDLE_MM_S) & (turning_deg_s < IDLE_DEG_S)
    steps = np.diff(segment.t_s)
    return float(
        sum(length for start, stop in _true_runs(still) if (length := steps[start:stop].sum()) >= LEAST_IDLE_S - 1e-9)
    )


def turn_rates(segment: Segment) -> FloatArray:
    """Return the angular speed (M - 1,) degrees/s around each step: across 0.1 s, so that noise does not count.

    Between two samples, the noise of two orientations over one short step would look like turning.
    """
    half = max(0, round(_WINDOW_S / 2.0 / float(np.median(np.diff(segment.t_s)))))
    last = len(segment.t_s) - 1
    first = np.clip(np.arange(last) - half, 0, last)
    after = np.clip(np.arange(last) + 1 + half, 0, last)
    relative = np.swapaxes(segment.rotation[first], 1, 2) @ segment.rotation[after]
    chord = np.linalg.norm(relative - np.eye(3), axis=(1, 2)) / (2.0 * np.sqrt(2.0))
    turned = np.degrees(2.0 * np.arcsin(np.clip(chord, 0.0, 1.0)))
    return np.asarray(turned / (segment.t_s[after] - segment.t_s[first]))


def roll_economy(run: Run) -> Measure:
    """Return the net roll of the movements as a share of the roll made, %: 100 when it never turned back."""
    needed = made = 0.0
    origin = run.result.began_ns
    for each in run.reached:
        part = run.motion.between((each.offered_ns - origin) / 1e9, (each.until_ns - origin) / 1e9)
        rolls = list(part.rolled_runs())
        if len(rolls) == 1 and len(rolls[0]) == len(part.t_s):
            needed += abs(float(rolls[0][-1] - rolls[0][0]))
            made += float(np.abs(np.diff(rolls[0])).sum())
    if np.degrees(made) < _LEAST_ROLL_DEG:
        return none(f"hardly any known roll on the way to reached targets ({np.degrees(made):.1f} degrees)")
    return Measure(100.0 * needed / made)


def _true_runs(flags: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))
