"""The walk through the set-up: what pictures and devices say, what is kept, and what is asked of a person."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from cathxr.app.hardware_twin import static_view
from cathxr.core import ConfigError, Health, Image, Reading, Status, Track
from cathxr.devices.clock import ManualClock
from cathxr.hardware.layout import Layout
from cathxr.hardware.parameters import Parameters
from cathxr.runtime.moment import HealthReport, Moment
from cathxr.runtime.setup_devices import TurnWatch
from cathxr.runtime.setup_network import headset_check, network_checks
from cathxr.runtime.setup_pictures import which_check
from cathxr.runtime.setup_session import AVERAGED, SetupSession, Surroundings
from cathxr.storage.rig_file import example_rig
from cathxr.twin.scenes import scene
from cathxr.wire.setup_messages import SetupState

RIG = example_rig()


@pytest.fixture(scope="module")
def pictures() -> dict[str, dict[str, np.ndarray]]:
    """What the twin's cameras see of the empty box and of both crosses."""
    return {
        name: {
            camera: np.clip(static_view(Layout(Parameters()), camera, scene(name), frame=False), 0, 255).astype(
                np.uint8
            )
            for camera in ("top", "front")
        }
        for name in ("empty", "pillars")
    }


class _Station:
    """A live system of which only the Health is asked."""

    sources: tuple[Health, ...] = tuple(Health(0, name, True, 0.01, 60.0, 0) for name in ("top", "front"))

    def health_report(self) -> HealthReport:
        return HealthReport(0, self.sources)


class _Walk:
    """A session, what it has published, and pictures that come when it looks."""

    def __init__(self) -> None:
        self.states: list[SetupState] = []
        self.station = _Station()
        self._ready = threading.Event()
        around = Surroundings(headsets=lambda: 1, addresses=lambda: ("192.0.2.7",), lan=True)
        self.session = SetupSession(
            RIG, station=self.station, clock=ManualClock(), publish=self._published, around=around
        )

    def _published(self, state: SetupState) -> None:
        self.states.append(state)
        self._ready.set()

    def look(self, pixels: dict[str, np.ndarray]) -> dict[str, str]:
        """Return the verdicts by title after pictures were looked at."""
        self.states.clear()
        self.session.commands()["setup_check"]({})
        track = Track(seq=0, t_ns=0, status=Status.LOST, reason="nothing in the box")
        while not self.states or self.states[-1].busy:
            for _ in range(AVERAGED):
                images = {name: Image(name, 0, 0, each) for name, each in pixels.items()}
                self.session.take(Moment(track, images=images))
            self._ready.wait(0.2)
            self._ready.clear()
        return {each.title: each.verdict for each in self.states[-1].checks}


def test_a_walk_keeps_what_it_saw_of_the_empty_box_when_the_crosses_come_in(
    pictures: dict[str, dict[str, np.ndarray]],
) -> None:
    walk = _Walk()
    with walk.session:
        empty = walk.look(pictures["empty"])
        light = [f"{what}, {name}" for what in ("exposure", "back light", "focus") for name in ("top", "front")]
        assert {empty[each] for each in light} == {"good"}
        assert {empty[f"fiducials, {name}"] for name in ("top", "front")} == {"unknown"}
        assert empty["which camera is which"] == "unknown"
        assert empty["headset"] == "good"
        crosses = walk.look(pictures["pillars"])
        assert {crosses[each] for each in light} == {"good"}
        assert {crosses[f"fiducials, {name}"] for name in ("top", "front")} == {"good"}
        assert crosses["which camera is which"] == "good"
        dark = walk.look({name: each // 4 for name, each in pictures["empty"].items()})
        assert dark["exposure, top"] == "wrong"
        assert dark["fiducials, top"] == "good"


def test_exchanged_cameras_are_told_by_the_crosses(pictures: dict[str, dict[str, np.ndarray]]) -> None:
    seen = pictures["pillars"]
    found = which_check(RIG, {"top": seen["front"], "front": seen["top"]})
    assert found.verdict == "wrong"
    assert "exchange the two devices" in found.then


def test_a_person_may_say_which_camera_is_which() -> None:
    walk = _Walk()
    ask = walk.session.commands()["setup_check"]
    ask({"pictures": False, "said": "swapped"})
    assert next(each.verdict for each in walk.states[-1].checks if each.subject == "which") == "wrong"
    ask({"pictures": False, "said": "right"})
    assert next(each.verdict for each in walk.states[-1].checks if each.subject == "which") == "good"
    for wrong in ({"said": "maybe"}, {"pictures": 1}, {"more": True}):
        with pytest.raises(ConfigError):
            ask(wrong)


def test_before_anybody_looked_nothing_is_said_of_the_box() -> None:
    found = {each.title: each.found for each in _Walk().session.checks()}
    assert found["exposure, top"] == found["fiducials, front"] == "not looked at yet"


def test_a_camera_without_pictures_and_a_slow_one_are_told() -> None:
    walk = _Walk()
    walk.station.sources = (
        Health(0, "top", False, None, 0.0, 0, "device 3 cannot be opened"), Health(0, "front", True, 0.1, 20.0, 0),
    )  # fmt: skip
    found = {each.title: each for each in walk.session.checks()}
    assert (found["camera, top"].verdict, found["camera, top"].found) == ("wrong", "device 3 cannot be opened")
    assert found["camera, front"].verdict == "warn"


def _turned(*readings: Reading, health: Health | None = None) -> str:
    watch = TurnWatch()
    for each in readings:
        watch.take(each)
    return watch.check(RIG, () if health is None else (health,)).verdict


def test_an_encoder_turns_stands_still_counts_wrongly_or_is_silent() -> None:
    good = Health(0, "encoder", True, 0.0, 200.0, 0)
    first, quarter = Reading(1, 0, 0), Reading(2, 5, 1200)
    assert _turned(first, quarter, health=good) == "good"
    assert _turned(first, replace(quarter, count=10), health=good) == "unknown"
    assert _turned(first, replace(quarter, illegal=2), health=good) == "wrong"
    assert _turned(first, replace(quarter, seq=40), health=good) == "wrong"
    some = [Reading(each, each, 30 * each) for each in range(60) if each not in (20, 21)]
    assert _turned(*some, health=good) == "warn"
    assert _turned(first, quarter) == "unknown"
    assert _turned(health=good) == "wrong"


def test_what_a_headset_needs_is_told() -> None:
    assert network_checks(())[0].verdict == "warn"
    assert "--lan" in network_checks(("192.0.2.7",), lan=False)[0].then
    assert headset_check(None).verdict == "unknown"
    assert headset_check(2).found == "2 connected"
