"""A hand that steers the twin's catheter: moves smoothly to the controls that meet each target."""

from collections.abc import Callable, Sequence

import numpy as np

from cathxr.core import FloatArray, Status, Track
from cathxr.runtime.simulated_aim import controls_for
from cathxr.training.placing import PlacedTask
from cathxr.twin import Controls
from cathxr.twin.kinematics import CatheterBody, centreline

_POINTS = 20


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
