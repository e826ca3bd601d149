"""What a crash, a store that fails and a full disk leave behind, and how it goes on."""

import json
from contextlib import suppress
from pathlib import Path

import pytest

from cathxr.core import DataError
from cathxr.core.trials import Outcome
from cathxr.runtime.training_recordings import recorded_trial
from cathxr.storage.study_store import StudyStore

from .bench import FAR, HERE, THERE, Bench


def cut_off(tmp_path: Path) -> tuple[str, str]:
    """Return the id of a trial that the program died under, after its first target, and the second target's key."""
    bench = Bench(tmp_path)
    bench.do("training_prepare", participant="P01", task="two", view="free")
    trial = bench.start()
    bench.feed([HERE if bench.tell().now.target == "here" else THERE] * 12)
    bench.feed([FAR] * 30)
    assert bench.tell().now.reached == 1
    second = bench.outlet.state.now.target
    bench.die()
    return trial, second


def records(bench: Bench) -> tuple[object, ...]:
    with StudyStore.open(bench.store_file, study="training") as store:
        return store.trials()


def test_a_trial_goes_on_where_its_recording_ends(tmp_path: Path) -> None:
    trial, second = cut_off(tmp_path)
    bench = Bench(tmp_path, start_ns=10**9)  # the machine was started anew, and its clock with it
    (offered,) = bench.until(lambda: bench.outlet.offer.unfinished)
    assert (offered.id, offered.participant, offered.can_continue) == (trial, "P01", True)
    assert "1 reached" in offered.sentence
    assert "has no end" in bench.refusal("training_prepare", participant="P01", task="two")
    bench.do("training_continue", trial=trial)
    states = {each.key: each.state for each in bench.outlet.state.run.targets}
    assert sorted(states.values()) == ["later", "reached"]
    assert bench.start() == trial
    assert (bench.outlet.state.now.target, bench.outlet.state.now.reached) == (second, 1)
    bench.feed([HERE if second == "here" else THERE] * 12)
    result = bench.numbers()
    assert (result.outcome, result.reached) == ("completed", 2)
    (record,) = records(bench)
    assert (record.id, record.outcome) == (trial, Outcome.COMPLETED)
    whole = recorded_trial(bench.recordings / record.session, trial)
    assert whole.is_same
    assert len(whole.parts) == 2
    # before: 0.24 s on the first target and 0.6 s; after: a dwell; nothing of the pause between
    assert record.active_s == pytest.approx(whole.result.active_s)
    assert len(whole.result.stretches) == 2
    assert whole.result.stretches[0][0] == 0
    assert (record.measures["nT"], record.measures["t"]) == (2, pytest.approx(record.active_s))
    bench.until(lambda: not bench.outlet.offer.unfinished)
    bench.close()


def test_a_trial_that_was_cut_off_can_be_marked_instead(tmp_path: Path) -> None:
    trial, _ = cut_off(tmp_path)
    bench = Bench(tmp_path)
    bench.until(lambda: bench.outlet.offer.unfinished)
    bench.do("training_mark", trial=trial, reason="the lid was closed")
    bench.until(lambda: records(bench))
    (record,) = records(bench)
    assert (record.outcome, record.invalid, record.reached) == (Outcome.INTERRUPTED, "the lid was closed", 1)
    assert record.active_s > 0.5
    bench.until(lambda: not bench.outlet.offer.unfinished)
    bench.close()


class Failing:
    """A store that can be made to fail."""

    def __init__(self) -> None:
        self.fails = True
        self.bench: Bench | None = None

    def __call__(self) -> StudyStore:
        if self.fails:
            raise DataError("The disk is full.")
        assert self.bench is not None
        return self.bench.opened()


def test_a_store_that_fails_stops_no_trial_and_gets_it_later(tmp_path: Path) -> None:
    failing = Failing()
    bench = Bench(tmp_path, open_store=failing)
    failing.bench = bench
    bench.do("training_prepare", participant="P01", task="two", view="free")
    assert "The store fails: The disk is full." in bench.outlet.state.sentence
    trial = bench.start()
    bench.reach_all()
    result = bench.numbers()
    assert result.outcome == "completed"
    assert "Not stored yet: The disk is full." in result.stored
    assert "training_store" in bench.outlet.state.can
    assert "Still not stored" in bench.refusal("training_store")
    failing.fails = False
    with suppress(DataError):  # on a machine that is very busy the answer comes later
        bench.do("training_store")
    bench.until(lambda: "Stored" in bench.outlet.state.result.stored)
    assert [each.id for each in records(bench)] == [trial]
    bench.close()


def test_a_trial_that_no_store_heard_of_is_stored_at_the_next_start(tmp_path: Path) -> None:
    failing = Failing()
    failing.fails = False
    bench = Bench(tmp_path, open_store=failing)
    failing.bench = bench
    bench.do("training_prepare", participant="P01", task="two", view="free")
    bench.start()
    bench.reach_all()
    bench.numbers()
    failing.fails = True
    bench.session.books._worker.asked(bench.session.books._let_go, 30.0)  # as when the link to it is lost
    bench.do("training_repeat")
    second = bench.start()
    bench.reach_all()
    assert "Not stored yet" in bench.numbers().stored
    bench.die()
    again = Bench(tmp_path, start_ns=2 * 10**12)
    again.until(lambda: len(records(again)) == 2)
    record = next(each for each in records(again) if each.id == second)
    assert (record.outcome, record.number) == (Outcome.COMPLETED, 2)
    assert record.measures["nT"] == 2
    again.close()


def test_what_is_recorded_of_other_studies_and_of_deleted_people_is_left_alone(tmp_path: Path) -> None:
    cut_off(tmp_path)
    label = next((tmp_path / "recordings").glob("*/trial.json"))
    values = json.loads(label.read_text())
    label.write_text(json.dumps(values | {"study": "another"}))
    (tmp_path / "store.sqlite").unlink()
    bench = Bench(tmp_path)
    bench.until(lambda: bench.session.cuts._looked_for_labels)
    assert records(bench) == ()
    assert bench.outlet.offer.unfinished == []
    bench.close()


def test_a_recording_that_cannot_begin_refuses_the_trial(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.do("training_prepare", participant="P01", task="two", view="free")
    bench.recordings.mkdir(exist_ok=True)
    (bench.recordings / bench.outlet.state.run.id).write_text("")
    name = bench.session.hand.session  # type: ignore[union-attr]
    (bench.recordings / name).mkdir()
    (bench.recordings / name / "session.toml").write_text("")
    assert bench.refusal("training_begin")
    assert bench.tell().phase == "ready"
    bench.close()
