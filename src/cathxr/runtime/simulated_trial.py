"""One trial on the twin: a simulated hand steers by the real commands, and the real trial machine takes the Tracks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import Event, Track
from cathxr.runtime.simulated_eye import Eye
from cathxr.runtime.simulated_hand import REST, SteeringHand
from cathxr.training import PlacedTask, Trial
from cathxr.training.state import Phase
from cathxr.twin import TwinWorld

RATE_HZ = 30.0
_REST_S = 4.0
"""For how long the catheter goes to rest before the recording begins."""
_BEFORE_S = _AFTER_S = 0.5
_NS = 1e9


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """What came out of a trial: every Track from half a second before it until half a second after it, and its Events.

    began_ns: of the trial, on the world's clock. truths: the exact Track beside each, where they were asked for.
    """

    trial: Trial
    began_ns: int
    tracks: tuple[Track, ...]
    events: tuple[Event, ...]
    truths: tuple[Track, ...] = ()


def simulated_run(
    placed: PlacedTask,
    order: Sequence[str],
    *,
    world: TwinWorld,
    eye: Eye,
    hand: SteeringHand,
    trial: str,
    abort_s: float | None = None,
    with_truth: bool = False,
) -> SimulatedRun:
    """Return a trial done on the twin. abort_s: after how many seconds the person gives up, None for never.

    The hand sees the trial's state at each Track and sets the controls by `TwinWorld.steer`, which limits them and
    moves the catheter as it does for a person at the page.
    """
    machine = Trial(placed, order, trial=trial)
    start_ns = world.start_ns
    _steer(world, start_ns, np.array(REST))
    step = _NS / RATE_HZ
    first_ns, begin_ns = start_ns + round(_REST_S * _NS), start_ns + round((_REST_S + _BEFORE_S) * _NS)
    tracks: list[Track] = []
    events: list[Event] = []
    truths: list[Track] = []
    ended_ns: int | None = None
    while True:
        t_ns = first_ns + round(len(tracks) * step)
        if machine.state.phase is Phase.WAITING and t_ns >= begin_ns:
            events += machine.begin(begin_ns)
        if ended_ns is not None and t_ns > ended_ns + _AFTER_S * _NS:
            return SimulatedRun(machine, begin_ns, tuple(tracks), tuple(events), tuple(truths))
        track = eye.track(len(tracks), t_ns)
        tracks.append(track)
        if with_truth:
            truths.append(world.truth(t_ns, seq=track.seq))
        events += machine.take(track)
        state = machine.state
        since_s = (t_ns - begin_ns) / _NS
        if state.phase is Phase.RUNNING:
            if abort_s is not None and since_s >= abort_s:
                events += machine.abort(t_ns)
            else:
                _steer(world, t_ns, hand.setpoints(since_s, state))
        if ended_ns is None and machine.state.phase is Phase.ENDED:
            ended_ns = t_ns


def _steer(world: TwinWorld, t_ns: int, controls: np.ndarray) -> None:
    insertion, roll, anterior, left = (float(each) for each in controls)
    world.steer(t_ns, insertion_mm=insertion, roll_deg=roll, anterior_deg=anterior, left_deg=left)
