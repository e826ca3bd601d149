"""The live system: outputs, commands, health, recording while live, and the replay that gives the same Tracks."""

import dataclasses
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cathxr.core import ConfigError, DeviceLost, Event, Health, Image, RollStatus, Status, Track
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.live import LiveOptions, LiveSystem
from cathxr.runtime.recording import session_opener
from cathxr.runtime.replay import replay_tracks
from cathxr.runtime.supervisor import RetryPolicy
from cathxr.storage.session import SessionReader

Eventually = Callable[[Callable[[], bool]], None]


@dataclass
class FakeOutlet:
    """Keeps what is published, in order."""

    tracks: list[Track] = field(default_factory=list)
    pictures: list[tuple[int, str]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    health: list[tuple[Health, ...]] = field(default_factory=list)
    sessions: list[bool] = field(default_factory=list)
    rolls: list[RollStatus] = field(default_factory=list)

    def publish_track(self, track: Track) -> None:
        self.tracks.append(track)

    def publish_picture(self, image: Image, *, seq: int) -> None:
        assert self.tracks[-1].seq == seq  # the Track is there before its pictures
        self.pictures.append((seq, image.camera))

    def publish_event(self, event: Event) -> None:
        self.events.append(event)

    def publish_health(self, sources: tuple[Health, ...], *, t_ns: int, skew_ns: int | None = None) -> None:
        self.health.append(sources)

    def publish_roll(self, status: RollStatus, *, predicted: bool) -> None:
        self.rolls.append(status)

    def publish_session(self, *, recording: bool, name: str | None = None, seconds: float = 0.0) -> None:
        self.sessions.append(recording)


@dataclass
class FakeWorld:
    """Keeps what it was told."""

    manoeuvres: tuple[str, ...] = ("rest", "sweep")
    control_ranges: Mapping[str, tuple[float, float]] = field(default_factory=lambda: {"insertion_mm": (5.0, 130.0)})
    told: list[Any] = field(default_factory=list)

    def steer(self, t_ns: int, **values: float | None) -> None:
        self.told.append(values)

    def manoeuvre(self, t_ns: int, name: str) -> None:
        self.told.append(name)


def live_system(bench: Any, folder: Path | None = None, **options: Any) -> LiveSystem:
    clock = MonotonicClock()
    if folder is not None:
        opener = session_opener(folder, rig=bench.rig, config={"source": "test"}, clock=clock, videos=False)
        options["open_session"] = opener
    live = LiveSystem(bench.source, clock=clock, options=LiveOptions(**options))
    bench.source.readings.add("live", live.take_reading)
    return live


def test_everything_is_published(bench: Any, eventually: Eventually) -> None:
    live, outlet = live_system(bench), FakeOutlet()
    live.connect("outlet", outlet)
    with live:
        eventually(lambda: len(outlet.tracks) > 10 and len(outlet.health) > 0)
    assert {name for _, name in outlet.pictures} == {"top", "front"}
    assert {each.source for each in outlet.health[-1]} == {"top", "front", "encoder", "tracker"}
    rate_hz = next(each.rate_hz for each in outlet.health[-1] if each.source == "top")
    assert 0.0 < rate_hz <= 101.0  # the fake camera makes 100 a second, a busy machine reads fewer


def test_an_output_that_raises_is_named_in_health_and_harms_nobody(bench: Any, eventually: Eventually) -> None:
    live, outlet = live_system(bench), FakeOutlet()

    def fails(_: object) -> None:
        raise RuntimeError("the output broke")

    live.moments.add("broken", fails)
    live.connect("outlet", outlet)
    with live:
        eventually(lambda: len(outlet.tracks) > 5 and len(outlet.health) > 0)
        broken = next(each for each in live.health_report().sources if each.source == "broken")
    assert broken.last_error == "RuntimeError: the output broke"
    assert broken.losses > 5


def test_it_stops_with_a_camera_that_is_never_there(bench: Any) -> None:
    bench.top.missing = DeviceLost("The top camera is not there.")
    live = live_system(bench)
    with live:
        time.sleep(0.05)
    assert live.stop()  # every thread has ended, and a second stop does no harm


def test_a_source_that_fails_is_opened_again(eventually: Eventually) -> None:
    class Failing:
        openings = 0

        def __enter__(self) -> "Failing":
            self.openings += 1
            return self

        def __exit__(self, *_: object) -> None:
            return None

        def read(self, timeout_s: float) -> Track | None:
            if self.openings == 1:
                raise DeviceLost("The tracker has gone.")
            time.sleep(0.01)
            return Track(self.openings, time.monotonic_ns(), Status.LOST, reason="test")

    source, got = Failing(), []
    options = LiveOptions(policy=RetryPolicy(0.5, 0.5), open_session=lambda name: pytest.fail("nothing to record"))
    live = LiveSystem(source, clock=MonotonicClock(), options=options)
    live.moments.add("test", got.append)
    with live:
        eventually(lambda: live.health_report().sources[0].last_error == "The tracker has gone.")
        eventually(lambda: len(got) > 2)
        assert live.health_report().sources[0].last_error is None
        with pytest.raises(ConfigError, match="only Tracks"):
            live.handle("record_start", {})
    assert source.openings == 2


def test_the_end_of_a_source_is_an_event(bench: Any) -> None:
    bench.top.ends_after = bench.front.ends_after = 5
    live, outlet = live_system(bench), FakeOutlet()
    live.connect("outlet", outlet)
    with live:
        assert live.wait(20.0)
    assert [each.kind for each in outlet.events] == ["end_of_stream"]


def test_commands(bench: Any) -> None:
    world = FakeWorld()
    live = live_system(bench, world=world)
    assert live.handle("steer", {"insertion_mm": 40}) == {"insertion_mm": 40.0}
    assert live.handle("manoeuvre", {"name": "sweep"}) == {"name": "sweep"}
    assert world.told == [{"insertion_mm": 40.0}, "sweep"]


@pytest.mark.parametrize(
    ("name", "args", "sentence"),
    [
        ("fly", {}, "no command 'fly': there are manoeuvre, record_start"),
        ("steer", {}, "at least one of insertion_mm"),
        ("steer", {"insertion_mm": "40"}, "must be a number, '40' was given"),
        ("steer", {"insertion_mm": True}, "must be a number"),
        ("steer", {"insertion_mm": float("nan")}, "must be a number"),
        ("steer", {"insertion_mm": 131}, "goes from 5 to 130, 131 was asked for"),
        ("steer", {"yaw": 1}, "does not know 'yaw': it takes insertion_mm"),
        ("manoeuvre", {"name": "loop"}, "no manoeuvre 'loop': there are rest, sweep"),
        ("manoeuvre", {"name": ["rest"]}, "no manoeuvre"),
        ("manoeuvre", {}, "no manoeuvre None"),
        ("reset_tracker", {"now": 1}, "takes no arguments"),
        ("record_start", {}, "without a folder"),
        ("record_stop", {}, "nothing to stop"),
    ],
)
def test_refusals(bench: Any, name: str, args: dict[str, Any], sentence: str) -> None:
    live = live_system(bench, world=FakeWorld())
    with pytest.raises(ConfigError, match=sentence):
        live.handle(name, args)


@pytest.mark.parametrize("name", ["steer", "manoeuvre"])
def test_only_a_twin_can_be_steered(bench: Any, name: str) -> None:
    with pytest.raises(ConfigError, match="Only the digital twin"):
        live_system(bench).handle(name, {})


def assert_same(one: Track, other: Track) -> None:
    """Bit for bit, latency aside."""
    for each in dataclasses.fields(Track):
        left, right = getattr(one, each.name), getattr(other, each.name)
        if each.name == "box_from_tip" and left is not None:
            assert np.array_equal(left.matrix, right.matrix)
        elif isinstance(left, np.ndarray):
            assert np.array_equal(left, right)
        elif each.name != "latency_ns":
            assert left == right, each.name


def test_a_recording_replays_to_the_same_tracks_through_resets_and_failures(
    bench: Any, eventually: Eventually, tmp_path: Path
) -> None:
    truth = Track(0, 0, Status.LOST, reason="truth")
    live, outlet = (
        live_system(bench, tmp_path, truth=lambda t_ns, seq: dataclasses.replace(truth, seq=seq)),
        FakeOutlet(),
    )
    live.connect("outlet", outlet)
    with live:
        eventually(lambda: len(outlet.tracks) > 20)  # the tracker has a past that the file will not know
        live.handle("record_start", {"name": "one"})
        eventually(lambda: len(outlet.tracks) > 60)
        live.handle("reset_tracker", {})
        eventually(lambda: len(outlet.tracks) > 80)
        bench.detectors["front"].error = ZeroDivisionError("of ours")
        eventually(lambda: any(each.reason.startswith("internal") for each in outlet.tracks))
        bench.front.error = DeviceLost("The front camera has gone.")
        eventually(lambda: bench.front.openings > 1 and outlet.tracks[-1].status is Status.TRACKED)
        summary = live.handle("record_stop", {})
    session = SessionReader(tmp_path / "one")
    recorded = list(session.tracks())
    assert len(recorded) == summary["pairs"] > 40
    assert summary["lost_pairs"] == summary["lost_items"] == 0
    again = list(replay_tracks(session, type(bench.tracker)()))
    assert len(again) == len(recorded)
    for one, other in zip(again, recorded, strict=True):
        assert_same(one, other)
    assert sum(each.kind == "tracker_reset" for each in session.events()) >= 3
    assert len(list(session.readings())) > 20
    assert [each.seq for each in session.truths()][-1] == recorded[-1].seq
    published = {each.seq: each for each in outlet.tracks}
    for one in recorded:
        assert_same(one, published[one.seq])
    assert outlet.sessions[0] is True
    assert outlet.sessions[-1] is False
