"""The trial's state machine: what counts as reached, what does not, and when it ends."""

import dataclasses

import numpy as np
import pytest

from cathxr.core import DataError, Event, Status
from cathxr.core.trials import Outcome
from cathxr.training.placing import PlacedTarget
from cathxr.training.replay import replay_trials
from cathxr.training.state import Phase
from cathxr.training.trial import Trial

from ...training_support.tracks import MS, placed, tip_target, track, tracks

HERE, THERE, FAR = (10.0, 0.0, 0.0), (40.0, 0.0, 0.0), (80.0, 0.0, 0.0)
TWO = placed(tip_target("here", HERE), tip_target("there", THERE))


def whats(events: object) -> list[str]:
    return [each.payload["what"] for each in events]


def done(trial: Trial, items: list) -> list:
    return [event for each in items for event in trial.take(each)]


def begun(task=TWO, order=("here", "there")) -> Trial:
    trial = Trial(task, order, trial="a")
    trial.begin(0)
    return trial


def test_targets_are_reached_in_their_order_after_the_dwell() -> None:
    trial = begun()
    events = done(trial, tracks([FAR] * 5 + [HERE] * 10 + [FAR] * 5 + [THERE] * 10))
    assert whats(events) == ["entered", "reached", "offered", "entered", "reached", "ended"]
    result = trial.result()
    assert result.outcome is Outcome.COMPLETED
    # Here from 0.10 s on; 0.1 s of dwell. There from 0.40 s on.
    assert [each.reached_s for each in result.targets] == pytest.approx([0.20, 0.50], abs=1e-9)
    assert [each.offered_s for each in result.targets] == pytest.approx([0.0, 0.20], abs=1e-9)
    assert result.active_s == pytest.approx(0.50)
    # 70 mm to the first; 70 mm away and 40 mm back to the second.
    assert [each.path_mm for each in result.targets] == pytest.approx([70.0, 110.0])
    assert result.unseen_share == 0.0


def test_leaving_before_the_dwell_is_over_is_a_miss() -> None:
    trial = begun()
    events = done(trial, tracks([HERE] * 3 + [FAR] * 2 + [HERE] * 3 + [FAR] * 2 + [HERE] * 6))
    assert whats(events) == ["entered", "left", "entered", "left", "entered", "reached", "offered"]
    assert trial.result().targets[0].misses == 2


@pytest.mark.parametrize("kind", ["lost", "coasting", "no Track at all"])
def test_what_is_not_tracked_reaches_nothing(kind: str) -> None:
    trial = begun()
    stream = tracks([HERE] * 40)
    if kind == "lost":
        stream = [track(each.t_ns, None) if i % 4 == 0 else each for i, each in enumerate(stream)]
    elif kind == "coasting":
        stream = [track(each.t_ns, HERE, status=Status.COASTING) for each in stream]
    else:
        stream = [dataclasses.replace(each, t_ns=i * 260 * MS) for i, each in enumerate(stream[:20])]
    events = done(trial, stream)
    result = trial.result()
    assert result.reached == 0
    assert all(each.misses == 0 for each in result.targets)
    assert "reached" not in whats(events)
    assert result.targets[0].path_mm == 0.0
    expected = {"lost": 0.5, "coasting": 1.0, "no Track at all": 1.0}[kind]
    assert result.unseen_share == pytest.approx(expected, abs=0.03)


def test_no_path_is_added_across_a_gap() -> None:
    trial = begun()
    done(trial, [*tracks([FAR] * 3), track(60 * MS, None), *tracks([HERE] * 3, start_ms=80)])
    assert trial.result().targets[0].path_mm == 0.0


def test_the_time_limit_ends_at_its_own_instant() -> None:
    trial = begun(placed(tip_target("here", HERE), limit_s=1.0), ["here"])
    events = done(trial, [*tracks([FAR] * 3), track(1_700 * MS, HERE)])
    assert whats(events) == ["ended"]
    assert events[0].t_ns == 1_000 * MS
    result = trial.result()
    assert (result.outcome, result.active_s) == (Outcome.TIMED_OUT, 1.0)
    # Seen until the third Track at 40 ms.
    assert result.unseen_share == pytest.approx(0.96)


def test_a_track_at_the_limit_still_counts() -> None:
    trial = begun(placed(tip_target("here", HERE, dwell_s=0.0), limit_s=1.0), ["here"])
    done(trial, [track(1_000 * MS, HERE)])
    assert trial.result().outcome is Outcome.COMPLETED


def test_pauses_stop_the_time_and_begin_the_dwell_anew() -> None:
    trial = begun()
    done(trial, tracks([HERE] * 4))
    trial.pause(70 * MS)
    assert trial.state.phase is Phase.PAUSED
    assert done(trial, tracks([HERE] * 50, start_ms=80)) == []
    trial.resume(5_000 * MS)
    assert trial.take(track(4_990 * MS, HERE)) == ()  # of an instant within the pause, arriving late
    events = done(trial, tracks([HERE] * 6, start_ms=5_000))
    assert events[1].payload["active_s"] == pytest.approx(0.17)
    result = trial.result()
    assert result.stretches == ((0, 70 * MS), (5_000 * MS, 5_100 * MS))
    assert result.targets[0].path_mm == 0.0


def test_abort_ends_it_and_keeps_what_was_reached() -> None:
    trial = begun()
    done(trial, tracks([HERE] * 6))
    assert whats(trial.abort(300 * MS)) == ["aborted", "ended"]
    result = trial.result()
    assert (result.outcome, result.reached, result.active_s) == (Outcome.ABORTED, 1, 0.3)
    with pytest.raises(ValueError, match="ended"):
        trial.abort(301 * MS)


def test_a_late_abort_does_not_undo_the_time_limit() -> None:
    trial = begun(placed(tip_target("here", HERE), limit_s=1.0), ["here"])
    assert whats(trial.abort(3_000 * MS)) == ["ended", "aborted"]
    assert trial.result().outcome is Outcome.TIMED_OUT


def test_a_cut_off_trial_is_interrupted() -> None:
    trial = begun()
    done(trial, tracks([FAR] * 6))
    result = trial.result()
    assert (result.outcome, result.active_s) == (Outcome.INTERRUPTED, 0.1)


def test_a_targets_own_limit_skips_it() -> None:
    trial = begun(dataclasses.replace(TWO, target_limit_s=0.5))
    events = done(trial, tracks([FAR] * 30 + [THERE] * 10))
    assert whats(events) == ["missed", "offered", "entered", "reached", "ended"]
    assert events[0].t_ns == 500 * MS
    assert trial.result().outcome is Outcome.TIMED_OUT


def test_practice_goes_on_until_the_row_is_complete() -> None:
    task = dataclasses.replace(TWO, in_a_row=3, target_limit_s=0.5, limit_s=60.0)
    trial = begun(task)
    # Reached, reached, missed, then three in a row.
    tips = [HERE] * 6 + [THERE] * 6 + [FAR] * 26 + [THERE] * 6 + [HERE] * 6 + [THERE] * 6
    done(trial, tracks(tips))
    result = trial.result()
    assert [each.reached for each in result.offers] == [True, True, False, True, True, True]
    assert result.outcome is Outcome.COMPLETED


def test_beams_and_planes_need_the_roll() -> None:
    beam = PlacedTarget("beam", "beam", "beam", np.array([50.0, -30.0, 0.0]), 3.0, range_mm=60.0)
    plane = PlacedTarget(
        "plane", "plane", "plane", np.array([20.0, -25.0, 0.0]), 3.0, angle_deg=10.0, up_deg=20.0,
        direction_box=np.array([0.0, 0.0, -1.0]), up_box=np.array([0.0, -1.0, 0.0]),
    )  # fmt: skip
    for target in (beam, plane):
        trial = begun(placed(target), [target.key])
        without = [track(i * 20 * MS, (50.0, 0.0, 0.0), roll_rad=None) for i in range(5)]
        assert done(trial, without) == []
        assert "roll" in trial.state.hindrance
        assert trial.result().unseen_share == 0.0
        assert "reached" in whats(trial.take(track(100 * MS, (50.0, 0.0, 0.0))))


def test_the_state_says_how_near_it_is() -> None:
    trial = begun()
    done(trial, tracks([(13.0, 4.0, 0.0)] * 4))
    state = trial.state
    assert (state.target, state.number, state.of, state.distance_mm) == ("here", 1, 2, 5.0)
    assert state.progress == pytest.approx(0.6)
    assert state.remaining_s == pytest.approx(9.94)


def test_acts_out_of_turn_are_refused() -> None:
    trial = Trial(TWO, ["here"])
    for act in (trial.pause, trial.resume, trial.abort):
        with pytest.raises(ValueError, match="waiting"):
            act(0)
    with pytest.raises(ValueError, match="begun"):
        trial.result()
    with pytest.raises(ValueError, match="expected one of"):
        Trial(TWO, ["nowhere"])


def test_tracks_that_are_not_later_are_left_out() -> None:
    trial = begun()
    done(trial, tracks([FAR] * 3))
    assert trial.take(track(40 * MS, HERE)) == ()
    assert trial.result().targets[0].path_mm == 0.0


def test_a_recording_may_hold_several_trials() -> None:
    stream = tracks([HERE] * 50)
    first, second = Trial(TWO, ["here"], trial="a"), Trial(TWO, ["here", "there"], trial="b")
    recorded = list(first.begin(0))
    recorded += [event for each in stream[:10] for event in first.take(each)]
    recorded += second.begin(500 * MS)
    recorded += [event for each in stream[10:] for event in second.take(each)]
    recorded += second.abort(990 * MS)
    again = replay_trials(stream, recorded)
    assert [each.trial.result() for each in again] == [first.result(), second.result()]
    assert [each for part in again for each in part.events] == recorded


def test_damaged_acts_are_told_in_a_sentence() -> None:
    with pytest.raises(DataError, match="cannot be done again"):
        replay_trials([], [Event(0, "training", {"what": "paused", "trial": "a", "after_ns": None})])
    assert replay_trials([], [Event(0, "training", {"what": "reached", "trial": "a"})]) == ()
