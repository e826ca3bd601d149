"""A trial from the choice of its participant to its stored numbers, and what operators are refused."""

from pathlib import Path

import pytest

from cathxr.runtime.training_recordings import recorded_trial
from cathxr.storage.study_store import StudyStore

from .bench import FAR, HERE, THERE, Bench


@pytest.fixture
def bench(tmp_path: Path):
    made = Bench(tmp_path)
    yield made
    made.close()


def stored(bench: Bench) -> StudyStore:
    return StudyStore.open(bench.store_file, study="training")


def test_a_trial_is_done_recorded_measured_and_stored(bench: Bench) -> None:
    bench.do("training_prepare", participant="p01", task="two", view="2d")
    assert bench.outlet.state.phase == "ready"
    assert bench.outlet.locks == [{"mode": "2d"}]
    trial = bench.start()
    bench.reach_all()
    result = bench.numbers()
    assert (result.outcome, result.reached, result.of, result.stored) == (
        "completed",
        2,
        2,
        "Stored in the training store.",
    )
    assert bench.outlet.locks[-1] == {}
    assert bench.station.recording_state().recording is False
    lines = {each.key: each.value for each in result.lines}
    assert lines["nT"] == 2
    with stored(bench) as store:
        (record,) = store.trials()
        assert store.unfinished() == ()
        assert [each.code for each in store.participants()] == ["P01"]
    assert (record.id, record.condition, record.number, record.session) == (trial, "2d", 1, result.recording)
    assert record.measures["t"] == pytest.approx(lines["t"])
    assert record.active_s == pytest.approx(result.active_s, abs=1e-3)
    # the recording alone gives the very same, and its folder says what it is of
    recorded = recorded_trial(bench.recordings / record.session, trial)
    assert recorded.is_same
    live = tuple(each for each in bench.station.events if each.kind == "training")
    assert recorded.replayed.events == live
    assert record.session.startswith("P01_two_2d_1_")
    assert (bench.recordings / record.session / "trial.json").is_file()


def test_the_run_is_served_from_memory_and_from_the_recording(bench: Bench) -> None:
    bench.do("training_prepare", participant="P01", task="two", view="free")
    trial = bench.start()
    bench.reach_all()
    bench.numbers()
    data = bench.session.run(trial)
    bench.session.after._runs.clear()
    assert bench.session.run(trial) == data
    assert data is not None
    assert b'"reached":[["' in data
    assert bench.session.run("nothing") is None


def test_pause_abort_and_repeat(bench: Bench) -> None:
    bench.do("training_prepare", participant="P01", task="two", view="3d")
    first = bench.start()
    bench.do("training_pause")
    assert bench.outlet.state.phase == "paused"
    before = bench.outlet.state.now.active_s
    bench.feed([HERE] * 40)
    assert bench.tell().now.active_s == before
    bench.do("training_resume")
    bench.do("training_abort", run=first)
    assert bench.numbers().outcome == "aborted"
    bench.do("training_repeat")
    assert bench.outlet.state.run.number == 2
    assert bench.start() != first


def test_an_abort_in_the_countdown_goes_back_to_ready(bench: Bench) -> None:
    bench.do("training_prepare", participant="P01", task="two", view="3d")
    first = bench.outlet.state.run.id
    bench.do("training_begin")
    bench.do("training_abort")
    assert bench.outlet.state.phase == "ready"
    assert bench.outlet.state.run.id != first
    assert bench.station.recording_state().recording is False
    bench.start()


def test_ten_seconds_without_a_track_pause_the_trial_and_replay_the_same(bench: Bench) -> None:
    bench.do("training_prepare", participant="P01", task="two", view="free")
    trial = bench.start()
    bench.feed([FAR] * 10)
    bench.clock.ns += 3_600 * 10**9  # a closed lid
    bench.feed([HERE] * 20)
    assert bench.tell().phase == "paused"
    assert "Paused by itself" in bench.outlet.state.sentence
    assert bench.outlet.state.now.active_s < 13.0
    bench.do("training_resume")
    assert bench.outlet.state.sentence == ""
    bench.reach_all()
    result = bench.numbers()
    assert result.outcome == "completed"
    assert recorded_trial(bench.recordings / result.recording, trial).is_same


def test_two_operators_and_wrong_moments_are_refused_with_a_sentence(bench: Bench) -> None:
    assert "No trial is prepared" in bench.refusal("training_begin")
    assert "looks like a name" in bench.refusal("training_prepare", participant="Anna", task="two")
    assert "expected a task" in bench.refusal("training_prepare", participant="P01", task="other")
    assert "view must be" in bench.refusal("training_prepare", participant="P01", task="two", view="4d")
    assert "does not know 'speed'" in bench.refusal("training_prepare", participant="P01", task="two", speed=1)
    bench.do("training_prepare", participant="P01", task="two", view="free")
    trial = bench.start()
    assert "is on" in bench.refusal("training_prepare", participant="P02", task="two")
    assert "is on" in bench.refusal("training_close")
    assert "another trial is at hand" in bench.refusal("training_abort", run="other")
    assert "cannot go on now: it runs" in bench.refusal("training_resume")
    assert "Only a trial that has ended" in bench.refusal("training_repeat")
    bench.do("training_mark", trial=trial, reason="the catheter slipped out")
    bench.reach_all()
    assert bench.numbers().invalid == "the catheter slipped out"
    with stored(bench) as store:
        assert store.trials()[0].invalid == "the catheter slipped out"
    bench.do("training_mark", trial=trial, reason="")
    with stored(bench) as store:
        assert store.trials()[0].invalid == ""


def test_practice_goes_on_until_its_criterion(bench: Bench) -> None:
    bench.do("training_prepare", participant="P01", task="habit", view="free")
    assert bench.outlet.state.run.practice
    bench.start()
    bench.feed([HERE if bench.tell().now.target == "here" else THERE] * 12)
    result = bench.numbers()
    assert "criterion met" in result.sentence
    with stored(bench) as store:
        assert (store.trials()[0].practice, store.trials()[0].period) == (True, 0)
