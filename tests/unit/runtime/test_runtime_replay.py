"""A session played again: pace, order, loops, pictures."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from cathxr.core import Detection, DeviceError, EndOfStream, Event, Image, Observation, Status, Track
from cathxr.devices.clock import ManualClock
from cathxr.runtime.moment import Moment
from cathxr.runtime.recorder import RESET_EVENT
from cathxr.runtime.replay import ReplayOptions, ReplaySource
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionReader, SessionWriter

PERIOD_NS = 33_333_333
COUNT = 12
FIRST_SEQ = 7
Play = Callable[..., list[Moment]]


def observation(seq: int) -> Observation:
    t_ns = 10**12 + seq * PERIOD_NS
    missing = tuple(Detection(name, seq, t_ns + i, reason="test") for i, name in enumerate(("top", "front")))
    return Observation(seq, t_ns, missing, skew_ns=1)


class CountingTracker:
    """Says in its reason how many Observations it has seen since its last reset."""

    def __init__(self) -> None:
        self.seen = 0

    def update(self, observation: Observation) -> Track:
        self.seen += 1
        return Track(observation.seq, observation.t_ns, Status.LOST, reason=f"seen {self.seen}")

    def reset(self) -> None:
        self.seen = 0


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> SessionReader:
    folder = tmp_path_factory.mktemp("sessions") / "one"
    writer = SessionWriter(folder, rig=example_rig(), config={}, clock_pair=(1, "2025-05-08T10:00:00Z"), videos=True)
    writer.write_event(Event(5, RESET_EVENT, {"before_seq": FIRST_SEQ}))
    for seq in range(FIRST_SEQ, FIRST_SEQ + COUNT):
        one = observation(seq)
        writer.write_observation(one)
        writer.write_track(Track(seq, one.t_ns, Status.LOST, reason="recorded", latency_ns=5))
        for i, name in enumerate(("top", "front")):
            if (seq, name) != (FIRST_SEQ + 2, "front"):  # one picture was lost while recording
                writer.write_image(Image(name, seq, one.t_ns + i, np.full((720, 1280, 3), seq, np.uint8)))
    writer.write_event(Event(6, RESET_EVENT, {"before_seq": FIRST_SEQ + 5}))
    writer.close()
    return SessionReader(folder)


def played(session: SessionReader, clock: ManualClock, tracker: Any = None, **options: Any) -> tuple[ReplaySource, Any]:
    source = ReplaySource(session, clock=clock, tracker=tracker, options=ReplayOptions(**options))
    return source, source.__enter__()


def to_the_end(source: ReplaySource) -> list[Moment]:
    found: list[Moment] = []
    while len(found) < 100:
        try:
            moment = source.read_moment(1.0)
        except EndOfStream:
            return found
        assert moment is not None
        found.append(moment)
    raise AssertionError("it never ended")


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_tracks_come_when_they_are_due(session: SessionReader, speed: float) -> None:
    clock = ManualClock(5)
    source, _ = played(session, clock, speed=speed)
    assert source.read_moment(0.0) is not None  # the first is due at once
    assert source.read_moment(0.001) is None
    moment = source.read_moment(1.0)
    assert moment is not None
    assert moment.track.t_ns == clock.now_ns() == 5 + round(PERIOD_NS / speed)
    assert moment.track.latency_ns is None


def test_recorded_tracks_are_given_without_a_tracker(session: SessionReader) -> None:
    source, _ = played(session, ManualClock())
    found = to_the_end(source)
    assert [each.track.seq for each in found] == list(range(FIRST_SEQ, FIRST_SEQ + COUNT))
    assert {each.track.reason for each in found} == {"recorded"}


def test_with_a_tracker_the_tracks_are_made_anew_with_the_recorded_resets(session: SessionReader) -> None:
    source, _ = played(session, ManualClock(), CountingTracker())
    resets: list[int] = []
    source.resets.add("test", resets.append)
    assert [each.track.reason for each in to_the_end(source)] == [f"seen {n}" for n in (*range(1, 6), *range(1, 8))]
    assert resets == [FIRST_SEQ + 5]  # the first one was carried out on opening


def test_a_reset_asked_for_is_carried_out(session: SessionReader) -> None:
    source, _ = played(session, ManualClock(), CountingTracker())
    source.read_moment(1.0)
    source.request_reset()
    moment = source.read_moment(1.0)
    assert moment is not None
    assert moment.track.reason == "seen 1"


def test_pictures_come_with_their_own_pair(session: SessionReader) -> None:
    found = to_the_end(played(session, ManualClock())[0])
    for moment in found:
        wanted = {"top"} if moment.track.seq == FIRST_SEQ + 2 else {"top", "front"}
        assert set(moment.images) == wanted
        assert all((image.pixels == moment.track.seq).all() for image in moment.images.values())
    without = to_the_end(played(session, ManualClock(), pictures=False)[0])
    assert not any(each.images for each in without)


def test_a_loop_goes_on_in_time_and_number(session: SessionReader) -> None:
    source, _ = played(session, ManualClock(), CountingTracker(), loop=True, pictures=False)
    found = [source.read(1.0) for _ in range(3 * COUNT)]
    assert all(each is not None for each in found)
    tracks = [each for each in found if each is not None]
    assert all(one.seq < other.seq and one.t_ns < other.t_ns for one, other in pairwise(tracks))
    assert [each.reason for each in tracks[:COUNT]] == [each.reason for each in tracks[COUNT : 2 * COUNT]]


def test_what_is_late_is_left_out_and_counted(session: SessionReader) -> None:
    clock = ManualClock()
    source, _ = played(session, clock, CountingTracker())
    assert source.read(0.0) is not None
    clock.advance_ns(8 * PERIOD_NS)
    track = source.read(0.001)
    assert track is not None
    assert track.seq == FIRST_SEQ + 5  # due within the 100 ms before now; the tracker has seen all before it
    assert source.health(clock.now_ns())[0].losses == 4


def test_rules_of_a_source(session: SessionReader) -> None:
    source = ReplaySource(session, clock=ManualClock(), tracker=None)
    with pytest.raises(DeviceError, match="before it is opened"):
        source.read(0.0)
    with source, pytest.raises(DeviceError, match="open already"):
        source.__enter__()
    with pytest.raises(ValueError, match="speed"):
        ReplayOptions(speed=0.0)
