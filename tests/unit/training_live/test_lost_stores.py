"""Real stores and disks that are lost in the middle of a trial: a full disk, a PostgreSQL server that was stopped."""

import uuid
from contextlib import suppress
from pathlib import Path

import numpy as np

from cathxr.core import DataError
from cathxr.core.trials import Outcome
from cathxr.storage.study_store import StudyStore

from ...training_support.disks import small_disk
from ...training_support.postgres import PostgresServer
from .bench import AT, FAR, HERE, THERE, Bench


def fill(disk: Path) -> Path:
    """Fill a disk to the last byte, and return what lies in the way."""
    ballast = disk / "ballast"
    with suppress(OSError), ballast.open("wb", buffering=0) as file:
        for size in (1 << 16, 1 << 10, 1):
            with suppress(OSError):
                while file.write(b"x" * size):
                    pass
    return ballast


def started_and_filled(disk: Path) -> tuple[Bench, str, Path]:
    """Return a bench whose trial has reached its first target, after which the disk was filled, and the ballast."""
    bench = Bench(disk)
    bench.do("training_prepare", participant="P01", task="two", view="free")
    trial = bench.start()
    bench.until(lambda: bench.session.books.known.unfinished and not bench.session.books._starts)
    bench.feed([HERE if bench.tell().now.target == "here" else THERE] * 12)
    recorder = bench.station.recordings.recorder
    bench.until_recorded(recorder)
    ballast = fill(disk)
    chance = np.random.default_rng(1)  # what repeats itself takes hardly any room
    for _ in range(20):
        bench.feed((np.array(FAR) + chance.normal(0.0, 1.0, (25, 3))).tolist())
        bench.until_recorded(recorder)
        if not bench.station.recording_state().recording:
            break
    else:
        raise AssertionError("the recording goes on upon a full disk")
    assert "recording of this trial broke" in bench.tell().sentence
    assert "No space left" in bench.outlet.state.sentence
    return bench, trial, ballast


def test_a_full_disk_loses_nothing_and_is_said(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", megabytes=2) as disk:
        bench, trial, ballast = started_and_filled(disk)
        bench.feed([HERE if bench.tell().now.target == "here" else THERE] * 12)
        result = bench.numbers()
        assert (result.outcome, result.reached) == ("completed", 2)
        assert "Not stored yet" in result.stored
        assert "the disk is full" in result.stored
        assert "The recording holds everything" not in result.stored  # for it broke
        assert "Do not end this program" in result.stored
        assert "the numbers are from what was seen live" in result.stored
        assert "the disk" in bench.refusal("training_store")
        ballast.unlink()
        with suppress(DataError):  # on a machine that is very busy the answer comes later
            bench.do("training_store")
        bench.until(lambda: bench.outlet.state.result.stored.startswith("Stored"))
        with StudyStore.open(bench.store_file, study="training") as store:
            (record,) = store.trials()
            assert (record.id, record.outcome, record.measures["nT"]) == (trial, Outcome.COMPLETED, 2)
            assert not store.unfinished()
        bench.close()


def test_a_program_that_dies_on_a_full_disk_goes_on_once_there_is_room(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", megabytes=2) as disk:
        bench, trial, ballast = started_and_filled(disk)
        bench.die()
        ballast.unlink()
        again = Bench(disk, start_ns=2 * 10**12)
        (offered,) = again.until(lambda: again.outlet.offer.unfinished)
        assert (offered.id, offered.can_continue) == (trial, True)
        assert "1 reached" in offered.sentence  # what was there before the disk was full
        again.do("training_continue", trial=trial)
        again.start()
        again.feed([HERE if again.tell().now.target == "here" else THERE] * 12)
        assert again.numbers().stored.startswith("Stored")
        again.close()


def test_a_trial_does_not_begin_on_a_full_disk(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", megabytes=1) as disk:
        bench = Bench(disk)
        bench.do("training_prepare", participant="P01", task="two", view="free")
        fill(disk)
        assert "No space left" in bench.refusal("training_begin")
        assert bench.tell().phase == "ready"
        bench.close()


def test_a_database_that_is_lost_in_the_middle_gets_the_trial_later(
    tmp_path: Path, postgres_server: PostgresServer
) -> None:
    key = uuid.uuid4().hex  # the server is shared with other tests

    def opened() -> StudyStore:
        return StudyStore.create(postgres_server.address, study=key, seed=1, software="1.0", at=AT)

    opened().close()
    bench = Bench(tmp_path, open_store=opened)
    bench.do("training_prepare", participant="P01", task="two", view="free")
    trial = bench.start()
    bench.until(lambda: bench.session.books.known.unfinished and not bench.session.books._starts)
    postgres_server.stop()
    try:
        bench.reach_all()
        result = bench.numbers()
        assert result.outcome == "completed"
        assert "Not stored yet" in result.stored
        assert "The recording holds everything" in result.stored
    finally:
        postgres_server.start()
    bench.clock.ns += 11 * 10**9  # tried again by itself
    bench.until(lambda: bench.outlet.state.result.stored.startswith("Stored"))
    with opened() as store:
        assert [each.id for each in store.trials()] == [trial]
        assert not store.unfinished()
    bench.close()
