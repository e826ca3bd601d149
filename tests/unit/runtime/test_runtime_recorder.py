"""The recorder: it never delays anyone, and what is in the file replays exactly, whatever was lost."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cathxr.core import (
    ConfigError,
    DataError,
    Detection,
    Event,
    Health,
    Image,
    Observation,
    Reading,
    Status,
    Track,
)
from cathxr.devices.clock import ManualClock
from cathxr.runtime.moment import Moment
from cathxr.runtime.recorder import RESET_EVENT, Recorder
from cathxr.runtime.recording import Recordings

LONG_S = 20.0
Eventually = Callable[[Callable[[], bool]], None]


@dataclass
class FakeWriter:
    """Keeps what is written. `gate`: closed, it is a disk that hangs. `error`: raised by every write from now on."""

    gate: threading.Event = field(default_factory=threading.Event)
    written: list[Any] = field(default_factory=list)
    error: Exception | None = None
    closed: int = 0

    def _write(self, item: Any) -> None:
        assert self.gate.wait(LONG_S)
        if self.error is not None:
            raise self.error
        self.written.append(item)

    write_reading = write_observation = write_track = write_truth = write_event = write_health = write_image = _write

    def flush_if_due(self) -> None:
        pass

    def close(self) -> None:
        self.closed += 1

    def seqs(self, kind: type) -> list[int]:
        return [each.seq for each in self.written if isinstance(each, kind)]


class Bench:
    """A recorder with its writer; counts the resets asked for."""

    def __init__(self, bound: int = 64, *, videos: bool = False) -> None:
        self.writer = FakeWriter()
        self.writer.gate.set()
        self.resets_asked = 0
        self.failures: list[str] = []
        self.recorder = Recorder(
            lambda: self.writer,
            clock=ManualClock(1),
            request_reset=self._ask,
            failed=self.failures.append,
            videos=videos,
            bound=bound,
        )

    def _ask(self) -> None:
        self.resets_asked += 1


def moment(seq: int, *, pictures: bool = False) -> Moment:
    missing = tuple(Detection(name, -1, seq, reason=f"no picture from {name}") for name in ("top", "front"))
    pixels = np.zeros((4, 4), np.uint8)
    images = {name: Image(name, seq, seq, pixels) for name in ("top", "front")} if pictures else {}
    return Moment(Track(seq, seq, Status.LOST, reason="test"), Observation(seq, seq, missing), images)


def test_a_recording_begins_with_the_first_pair_after_a_reset() -> None:
    bench = Bench()
    bench.recorder.start()
    bench.recorder.moment(moment(4))  # before the reset: its Track depends on what is not in the file
    bench.recorder.note_reset(5)
    bench.recorder.moment(moment(5))
    bench.recorder.moment(moment(6))
    report = bench.recorder.stop(LONG_S)
    assert (report.pairs, report.lost_pairs, report.error) == (2, 0, None)
    event = bench.writer.written[0]
    assert isinstance(event, Event)
    assert (event.kind, event.payload) == (RESET_EVENT, {"before_seq": 5})
    assert bench.writer.seqs(Observation) == bench.writer.seqs(Track) == [5, 6]
    assert bench.writer.closed == 1


def test_the_truth_of_a_pair_that_was_not_let_in_is_left_out() -> None:
    bench = Bench()
    bench.recorder.start()
    bench.recorder.moment(moment(4))
    bench.recorder.note_reset(5)  # by another thread, between a pair and its truth
    bench.recorder.truth(Track(4, 4, Status.LOST, reason="truth"))
    bench.recorder.moment(moment(5))
    bench.recorder.truth(Track(5, 5, Status.LOST, reason="truth"))
    bench.recorder.stop(LONG_S)
    assert bench.writer.seqs(Track) == [5, 5]


def test_everything_else_is_recorded_in_order() -> None:
    bench = Bench(videos=True)
    bench.recorder.start()
    bench.recorder.note_reset(0)
    bench.recorder.reading(Reading(1, 1, 1))
    bench.recorder.moment(moment(0, pictures=True))
    bench.recorder.truth(Track(0, 0, Status.LOST, reason="truth"))
    bench.recorder.event(Event(2, "mark"))
    bench.recorder.health(Health(3, "top", True, 0.0, 30.0, 0))
    bench.recorder.stop(LONG_S)
    kinds = [type(each).__name__ for each in bench.writer.written]
    assert kinds == ["Event", "Reading", "Observation", "Track", "Image", "Image", "Track", "Event", "Health"]


def test_without_videos_no_picture_is_written() -> None:
    bench = Bench()
    bench.recorder.start()
    bench.recorder.note_reset(0)
    bench.recorder.moment(moment(0, pictures=True))
    bench.recorder.stop(LONG_S)
    assert bench.writer.seqs(Image) == []


def test_a_disk_that_hangs_loses_whole_pairs_and_begins_anew_with_a_reset(eventually: Eventually) -> None:
    bench = Bench(bound=8)
    bench.recorder.start()
    bench.writer.gate.clear()
    bench.recorder.note_reset(0)
    for seq in range(20):
        bench.recorder.moment(moment(seq))
    assert bench.resets_asked == 0  # no use before there is room
    bench.writer.gate.set()
    eventually(lambda: len(bench.writer.seqs(Track)) >= 7)
    eventually(lambda: bench.recorder.report().pairs == len(bench.writer.seqs(Track)))
    first_part = bench.writer.seqs(Track)
    bench.recorder.moment(moment(20))  # there is room, but the tracker's state is not what the file tells
    assert bench.resets_asked == 1
    bench.recorder.moment(moment(21))
    assert bench.resets_asked == 1
    bench.recorder.note_reset(22)
    bench.recorder.moment(moment(22))
    report = bench.recorder.stop(LONG_S)
    assert first_part == list(range(len(first_part)))
    assert bench.writer.seqs(Observation) == [*first_part, 22]
    assert report.pairs + report.lost_pairs == 23


def test_pictures_are_lost_before_anything_else() -> None:
    bench = Bench(bound=1000, videos=True)
    bench.recorder.start()
    bench.writer.gate.clear()
    bench.recorder.note_reset(0)
    for seq in range(100):
        bench.recorder.moment(moment(seq, pictures=True))
    bench.writer.gate.set()
    report = bench.recorder.stop(LONG_S)
    assert (report.pairs, report.lost_pairs) == (100, 0)
    assert bench.writer.seqs(Image) == [seq for seq in range(12) for _ in range(2)]  # the bound of 24, in pairs
    assert report.lost_pictures == 200 - 24


def test_a_broken_disk_ends_the_recording_and_says_so(eventually: Eventually) -> None:
    bench = Bench()
    bench.recorder.start()
    bench.recorder.note_reset(0)
    bench.writer.error = DataError("The disk is full.")
    bench.recorder.moment(moment(0))
    eventually(lambda: bench.failures == ["The disk is full."])
    bench.recorder.moment(moment(1))
    bench.recorder.reading(Reading(1, 1, 1))
    assert bench.recorder.stop(LONG_S).error == "The disk is full."
    assert bench.writer.closed == 1
    assert bench.failures == ["The disk is full."]


class Studio:
    """Recordings over writers that are kept, with the events they announce."""

    def __init__(self, error: Exception | None = None) -> None:
        self.writers: dict[str, FakeWriter] = {}
        self.events: list[Event] = []
        self.error = error
        self.clock = ManualClock(1_000_000_000)
        self.recordings = Recordings(
            self._open, clock=self.clock, request_reset=self._reset, announce=self.events.append
        )

    def _open(self, name: str) -> FakeWriter:
        if self.error is not None:
            raise self.error
        self.writers[name] = FakeWriter()
        self.writers[name].gate.set()
        return self.writers[name]

    def _reset(self) -> None:
        recorder = self.recordings.recorder
        assert recorder is not None  # whoever is told of a reset finds the recorder
        recorder.note_reset(0)


def test_a_recording_starts_and_stops_by_command() -> None:
    studio = Studio()
    assert not studio.recordings.state().recording
    assert studio.recordings.start({"name": "first try"}) == {"name": "first try"}
    studio.clock.advance_ns(2_500_000_000)
    assert studio.recordings.state().seconds == 2.5
    recorder = studio.recordings.recorder
    assert recorder is not None
    recorder.moment(moment(0))
    summary = studio.recordings.stop({})
    assert (summary["name"], summary["seconds"], summary["pairs"]) == ("first try", 2.5, 1)
    assert [each.kind for each in studio.events] == ["recording_started", "recording_stopped"]
    assert studio.writers["first try"].closed == 1
    assert not studio.recordings.state().recording


def test_without_a_name_it_is_called_by_date_and_time() -> None:
    studio = Studio()
    name = studio.recordings.start({})["name"]
    assert len(name) == len("2025-05-08_10-11-12")
    studio.recordings.close()
    studio.recordings.close()


@pytest.mark.parametrize(
    "name", ["", "a/b", "..", ".hidden", "a\\b", "con", "NUL.txt", "x" * 81, "dot.", "space ", "é", 7, True, ["a"]]
)
def test_names_that_no_folder_should_have_are_refused(name: Any) -> None:
    with pytest.raises(ConfigError, match="cannot name a recording"):
        Studio().recordings.start({"name": name})


def test_what_cannot_be_done_is_refused_with_a_sentence(tmp_path: Path) -> None:
    studio = Studio()
    with pytest.raises(ConfigError, match="nothing to stop"):
        studio.recordings.stop({})
    with pytest.raises(ConfigError, match="does not know 'folder'"):
        studio.recordings.start({"folder": str(tmp_path)})
    studio.recordings.start({"name": "one"})
    with pytest.raises(ConfigError, match="one runs already"):
        studio.recordings.start({"name": "two"})
    studio.recordings.close()
    with pytest.raises(DataError, match="no space"):
        Studio(DataError("There is no space.")).recordings.start({})


def test_a_recording_that_breaks_is_announced_and_another_can_start(eventually: Eventually) -> None:
    studio = Studio()
    studio.recordings.start({"name": "one"})
    studio.writers["one"].error = OSError(28, "No space left on device")
    recorder = studio.recordings.recorder
    assert recorder is not None
    recorder.moment(moment(0))
    eventually(lambda: [each.kind for each in studio.events] == ["recording_started", "recording_failed"])
    assert "No space left" in studio.events[-1].payload["sentence"]
    assert not studio.recordings.state().recording
    studio.recordings.start({"name": "two"})
    studio.recordings.close()
