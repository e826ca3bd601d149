"""What a crash, a store that fails and a full disk leave behind, and how it goes on."""

import json
import os
import socket
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


def test_a_trial_that_another_program_runs_is_not_offered_until_that_ends(tmp_path: Path) -> None:
    one = Bench(tmp_path)
    one.do("training_prepare", participant="P01", task="two", view="free")
    trial = one.start()
    one.until(lambda: one.session.books.known.unfinished and not one.session.books._starts)
    other = Bench(tmp_path, start_ns=2 * 10**12)
    (offered,) = other.until(lambda: other.outlet.offer.unfinished)
    assert (offered.id, offered.can_continue) == (trial, False)
    assert f"running now, in another program on this computer (process {os.getpid()})" in offered.sentence
    assert "running now" in other.refusal("training_continue", trial=trial)
    assert "Mark it there" in other.refusal("training_mark", trial=trial, reason="looks cut off")
    assert not records(other)
    one.reach_all()
    assert one.numbers().stored == "Stored in the training store."
    other.clock.ns += 3 * 10**9
    other.until(lambda: not other.outlet.offer.unfinished)  # by itself: nobody asked the store anew
    (record,) = records(other)
    assert (record.id, record.outcome, record.invalid) == (trial, Outcome.COMPLETED, "")
    assert list((tmp_path / "recordings" / ".running").iterdir()) == []
    one.close()
    other.close()


def test_a_trial_whose_program_died_is_offered_to_the_other_that_runs(tmp_path: Path) -> None:
    one = Bench(tmp_path)
    one.do("training_prepare", participant="P01", task="two", view="free")
    trial = one.start()
    one.until(lambda: one.session.books.known.unfinished and not one.session.books._starts)
    other = Bench(tmp_path, start_ns=2 * 10**12)
    other.until(lambda: other.outlet.offer.unfinished)
    one.feed([FAR] * 30)
    one.die()
    other.clock.ns += 3 * 10**9
    other.until(lambda: other.outlet.offer.unfinished[0].can_continue)
    third = Bench(tmp_path, start_ns=3 * 10**12)
    third.until(lambda: third.outlet.offer.unfinished)
    other.do("training_continue", trial=trial)
    third.do("training_continue", trial=trial)
    assert other.start() == trial
    assert "running now" in third.refusal("training_begin")  # both had it ready: the second is refused
    other.reach_all()
    other.numbers()
    (record,) = records(other)
    assert record.outcome is Outcome.COMPLETED
    assert third.refusal("training_begin")
    for each in (other, third):
        each.close()


def test_a_trial_of_another_computer_can_be_marked_and_not_gone_on_with(tmp_path: Path) -> None:
    trial, _ = cut_off(tmp_path)
    held = tmp_path / "recordings" / ".running" / trial
    held.write_text(held.read_text().replace(socket.gethostname(), "the-other-box"))
    bench = Bench(tmp_path)
    (offered,) = bench.until(lambda: bench.outlet.offer.unfinished)
    assert not offered.can_continue
    assert "begun on the computer the-other-box" in bench.refusal("training_continue", trial=trial)
    bench.do("training_mark", trial=trial, reason="that box was switched off")
    assert [each.outcome for each in bench.until(lambda: records(bench))] == [Outcome.INTERRUPTED]
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
