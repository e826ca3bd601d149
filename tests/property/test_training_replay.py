"""Live is replay, bit for bit: whatever the Tracks and whatever the person does."""

import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cathxr.core import Event, Status
from cathxr.storage.session_json import decoded, encoded, event_json, track_json
from cathxr.training.metrics import Run, measured, motion_of
from cathxr.training.placing import PlacedTarget, placed_from_mapping, placed_mapping
from cathxr.training.replay import replay_trials
from cathxr.training.state import Phase
from cathxr.training.trial import Trial

from ..training_support.tracks import MS, placed, tip_target, track

_STEPS = st.lists(
    st.tuples(
        st.integers(1, 700),  # ms since the last
        st.sampled_from(["tracked", "tracked", "tracked", "lost", "coasting", "no roll"]),
        st.integers(0, 12),  # where along x, in steps of 5.3 mm
        st.sampled_from(["", "", "", "", "pause", "resume", "abort"]),
        st.integers(0, 300),  # how much later than the Track's instant the act comes, ms
    ),
    min_size=3,
    max_size=60,
)


def _task(own_limit: bool, row: int | None) -> object:
    beam = PlacedTarget("beam", "beam", "beam", np.array([30.0, -20.0, 0.3]), 6.0, dwell_s=0.05, range_mm=40.0)
    return placed(
        tip_target("a", (10.6, 0.0, 0.0)), beam, tip_target("c", (50.1, 0.0, 0.0), dwell_s=0.0),
        limit_s=5.3, target_limit_s=1.7 if own_limit or row else None, in_a_row=row,
    )  # fmt: skip


@given(_STEPS, st.booleans(), st.sampled_from([None, 2]))
def test_live_is_replay_bit_for_bit(steps: list, own_limit: bool, row: int | None) -> None:
    task = _task(own_limit, row)
    trial = Trial(task, ["c", "a", "beam"], trial="one")
    out: list[Event] = list(trial.begin(100 * MS))
    tracks, t_ms = [], 0
    for i, (step, kind, place, act, late) in enumerate(steps):
        t_ms += step
        tip = None if kind == "lost" else (5.3 * place, 0.1 * i, 0.0)
        status = Status.COASTING if kind == "coasting" else Status.TRACKED
        tracks.append(track(t_ms * MS, tip, status=status, roll_rad=None if kind == "no roll" else 0.1, seq=i))
        out += trial.take(tracks[-1])
        allowed = {"pause": Phase.RUNNING, "resume": Phase.PAUSED, "abort": Phase.RUNNING}.get(act)
        if allowed is trial.state.phase:
            out += getattr(trial, act)((t_ms + late) * MS)
    # What a recording gives back: through JSON, and sorted by instant, not as it happened.
    read_tracks = [decoded("/track", encoded(track_json(each))) for each in tracks]
    read_events = [decoded("/event", encoded(event_json(each))) for each in out]
    read_events.sort(key=lambda each: each.t_ns)
    (again,) = replay_trials(read_tracks, read_events)
    assert [encoded(event_json(each)) for each in again.events] == [encoded(event_json(each)) for each in out]
    assert again.trial.result() == trial.result()
    assert again.trial.state == trial.state
    live, replayed = (
        measured(Run(each.result(), each.placed, motion_of(given, each.result().stretches)))
        for each, given in ((trial, tracks), (again.trial, read_tracks))
    )
    assert live == replayed


@given(st.lists(st.floats(-100.0, 100.0), min_size=3, max_size=3), st.floats(0.1, 50.0))
def test_a_placed_task_survives_json(point: list[float], radius: float) -> None:
    task = placed(tip_target("a", point, radius=radius))
    again = placed_from_mapping(json.loads(json.dumps(placed_mapping(task))))
    assert placed_mapping(again) == placed_mapping(task)
