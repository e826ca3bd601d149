"""A hand that steers the twin's catheter: finds the controls for a target and moves there smoothly."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import least_squares

from cathxr.core import FloatArray, Status, Track
from cathxr.training.placing import PlacedTarget, PlacedTask
from cathxr.twin import Controls
from cathxr.twin.kinematics import CatheterBody, centreline

_POINTS = 20


def controls_for(body: CatheterBody, target: PlacedTarget, start: FloatArray) -> FloatArray:
    """Return the controls (4,) that meet a target, found from the ones the hand has now and from a few others."""

    def miss(values: FloatArray) -> FloatArray:
        shape, pose = centreline(body, Controls(*values), points=_POINTS)
        offset, rotation = target.point_box - shape[0], pose.rotation
        if target.kind == "tip":
            return np.append(offset, 0.004 * (values - start))
        if target.kind == "beam":
            return np.append(
                offset - max(float(offset @ rotation[:, 0]), 0.0) * rotation[:, 0], 0.02 * (values - start)
            )
        assert target.direction_box is not None
        assert target.up_box is not None
        turned = 30.0 * np.concatenate([rotation[:, 1] - target.direction_box, rotation[:, 0] - target.up_box])
        return np.concatenate([turned, [offset @ rotation[:, 1]], 0.02 * (values - start)])

    low, high = np.array([12.0, -400.0, -200.0, -200.0]), np.array([125.0, 400.0, 200.0, 200.0])
    first = np.array([max(30.0, float(np.linalg.norm(target.point_box))), 0.0, 30.0, 30.0])
    guesses = [start] + [first * [1.0, 1.0, one, other] for one in (1.0, -1.0) for other in (1.0, -1.0)]
    found = [least_squares(miss, np.clip(each, low + 1e-6, high - 1e-6), bounds=(low, high)) for each in guesses]
    return np.asarray(min(found, key=lambda each: each.cost).x)


def steered(
    body: CatheterBody,
    placed: PlacedTask,
    order: Sequence[str],
    *,
    start: FloatArray,
    rate_hz: float = 60.0,
    move_s: float = 2.0,
    hold_s: float = 1.5,
    start_ns: int = 0,
    noise: Callable[[int], FloatArray] | None = None,
) -> list[Track]:
    """Return the Tracks of a hand that goes from one target to the next by minimum-jerk moves of its controls."""
    now, out = start, []
    moves = [controls_for(body, placed.target(order[0]), start)]
    for key in order[1:]:
        moves.append(controls_for(body, placed.target(key), moves[-1]))
    for goal in moves:
        moving, holding = round(move_s * rate_hz), round(hold_s * rate_hz)
        s = np.concatenate([np.arange(moving) / moving, np.ones(holding)])
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        for values in now + share[:, None] * (goal - now):
            shape, pose = centreline(body, Controls(*values), points=_POINTS)
            i = len(out)
            moved = shape if noise is None else shape + noise(i)
            t_ns = start_ns + round(i * 1e9 / rate_hz)
            roll = float(np.deg2rad(values[1]))
            out.append(Track(i, t_ns, Status.TRACKED, "", moved, pose, roll, 0.02))
        now = goal
    return out
