"""Running a calibration: pictures, commands, long work and the end, with a task that only notes what happens."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from cathxr.core import CalibrationError, ConfigError, DeviceError, Event, Health, Image
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.calibration_live import LiveCalibration
from cathxr.runtime.calibration_task import CommandTable, Ending, Job
from cathxr.wire.calibration_messages import CalibrationState, CamerasState

LONG_S = 20.0
PIXELS = np.zeros((16, 16), np.uint8)


class Page:
    """Notes what is published."""

    def __init__(self) -> None:
        self.states: list[CalibrationState] = []
        self.pictures: list[tuple[str, int]] = []
        self.order: list[str] = []
        self.events: list[Event] = []
        self.reports: list[tuple[Health, ...]] = []

    def publish_calibration(self, state: CalibrationState) -> None:
        self.states.append(state)
        self.order.append(state.advice)

    def publish_picture(self, image: Image, *, seq: int) -> None:
        self.pictures.append((image.camera, seq))
        self.order.append(f"picture {seq}")

    def publish_event(self, event: Event) -> None:
        self.events.append(event)

    def publish_health(self, sources: tuple[Health, ...], *, t_ns: int, skew_ns: int | None = None) -> None:
        self.reports.append(sources)


class Note:
    """A task that says in its advice what it has seen."""

    def __init__(self) -> None:
        self.ending: Ending | None = None
        self.seen: list[int] = []
        self.advice = "begun"
        self.job: Job[Any] | None = None
        self.examining = threading.Event()
        self.go_on = threading.Event()
        self.go_on.set()
        self.health: Mapping[str, Health] = {}

    def examine(self, image: Image) -> int:
        self.examining.set()
        assert self.go_on.wait(LONG_S)
        if image.seq == 3:
            raise ValueError("a picture that nobody can look at")
        return image.seq * 2

    def look(self, image: Image, found: int) -> None:
        self.seen.append(image.seq)
        self.advice = f"saw {found}"

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        if name == "end":
            self.ending = Ending("That was it.", True)
            return self.ending.result
        if name == "work":
            self.job = Job(args["work"], self._done, self._failed)
            return {}
        raise ConfigError("no")

    def _done(self, value: str) -> None:
        self.advice = value

    def _failed(self, why: str) -> None:
        self.advice = f"failed: {why}"

    def take_job(self) -> Job[Any] | None:
        job, self.job = self.job, None
        return job

    def note_health(self, sources: Mapping[str, Health]) -> None:
        self.health = sources

    def state(self) -> CamerasState:
        return CamerasState(stage="collecting", advice=self.advice, devices=[], can_save=False, figures=[])


class Pictures:
    """A source that gives the pictures it is handed, and fails when told to."""

    def __init__(self) -> None:
        self.given: list[int] = []
        self.taken = 0
        self.fails = False

    def __enter__(self) -> "Pictures":
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def read(self, timeout_s: float) -> Image | None:
        if self.fails:
            raise DeviceError("The camera is unplugged.")
        if self.taken == len(self.given):
            time.sleep(0.002)
            return None
        self.taken += 1
        return Image("top", self.given[self.taken - 1], 0, PIXELS)


def until(what: Callable[[], object]) -> None:
    deadline_s = time.monotonic() + LONG_S
    while not what():
        assert time.monotonic() < deadline_s, "it did not come"
        time.sleep(0.005)


@pytest.fixture
def task() -> Note:
    return Note()


@pytest.fixture
def page() -> Page:
    return Page()


@pytest.fixture
def pictures() -> Pictures:
    return Pictures()


@pytest.fixture
def live(task: Note, page: Page, pictures: Pictures) -> LiveCalibration:
    still = Image("front", 7, 0, PIXELS)
    return LiveCalibration(task, {"top": pictures}, outlet=page, clock=MonotonicClock(), stills=(still,))


def test_each_picture_is_published_before_the_state_that_belongs_to_it(
    live: LiveCalibration, page: Page, pictures: Pictures
) -> None:
    with live:
        for seq in (1, 2):
            pictures.given.append(seq)
            until(lambda: f"saw {2 * pictures.given[-1]}" in page.order)
    assert page.order == ["picture 7", "begun", "picture 1", "saw 2", "picture 2", "saw 4"]


def test_pictures_that_come_while_one_is_looked_at_are_passed_over_but_for_the_newest(
    live: LiveCalibration, task: Note, pictures: Pictures
) -> None:
    with live:
        task.go_on.clear()
        pictures.given.append(1)
        assert task.examining.wait(LONG_S)
        pictures.given += [4, 5, 6]
        until(lambda: pictures.taken == 4)
        time.sleep(0.02)  # the last was taken from the source a moment before it is handed on
        task.go_on.set()
        until(lambda: 6 in task.seen)
    assert task.seen == [1, 6]


def test_a_picture_that_cannot_be_looked_at_ends_nothing(
    live: LiveCalibration, task: Note, pictures: Pictures, caplog: pytest.LogCaptureFixture
) -> None:
    with live:
        for seq in (3, 4):
            pictures.given.append(seq)
            until(lambda: pictures.taken == len(pictures.given))
            time.sleep(0.02)
        until(lambda: 4 in task.seen)
    assert "looking at a picture failed" in caplog.text


def test_long_work_leaves_pictures_and_commands_running(
    live: LiveCalibration, task: Note, page: Page, pictures: Pictures
) -> None:
    release = threading.Event()

    def work() -> str:
        assert release.wait(LONG_S)
        return "worked out"

    with live:
        live.handle("work", {"work": work})
        pictures.given.append(1)
        until(lambda: "saw 2" in page.order)
        release.set()
        until(lambda: "worked out" in page.order)


def test_work_that_fails_is_told(live: LiveCalibration, page: Page) -> None:
    def work() -> str:
        raise CalibrationError("Too few views: take more.")

    with live:
        live.handle("work", {"work": work})
        until(lambda: "failed: Too few views: take more." in page.order)


def test_the_end_is_told_to_everybody_once_and_nothing_goes_on_after_it(live: LiveCalibration, page: Page) -> None:
    with live:
        assert not live.wait(0.0)
        assert live.handle("end", {}) == {"saved": True, "sentence": "That was it.", "paths": []}
        assert live.wait(LONG_S)
        assert live.ending is not None
        with pytest.raises(CalibrationError, match="has ended"):
            live.handle("end", {})
    assert [(each.kind, each.payload["sentence"]) for each in page.events] == [("calibration_ended", "That was it.")]


def test_a_camera_that_fails_reaches_the_task(live: LiveCalibration, task: Note, pictures: Pictures) -> None:
    pictures.fails = True
    with live:
        until(lambda: task.health and not task.health["top"].running)
        assert task.health["top"].last_error == "The camera is unplugged."


def test_stopping_waits_for_a_command_that_is_writing(live: LiveCalibration, task: Note) -> None:
    written = threading.Event()
    begun = threading.Event()

    def slow(name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        begun.set()
        time.sleep(0.3)
        written.set()
        return {}

    task.handle = slow  # type: ignore[method-assign]
    with live:
        command = threading.Thread(target=lambda: live.handle("save", {}))
        command.start()
        assert begun.wait(LONG_S)
        assert live.stop()
        assert written.is_set()
    command.join(LONG_S)
    with pytest.raises(CalibrationError, match="has ended"):
        live.handle("end", {})


def test_commands_are_checked() -> None:
    table = CommandTable({"place": (("camera", "exact?"), lambda args: dict(args)), "finish": ((), lambda args: {})})
    assert table.handle("place", {"camera": "top"}) == {"camera": "top"}
    assert table.handle("place", {"camera": "top", "exact": True}) == {"camera": "top", "exact": True}
    with pytest.raises(ConfigError, match="There is no command 'fly' here: there are finish, place"):
        table.handle("fly", {})
    with pytest.raises(ConfigError, match="finish takes no arguments; x was given"):
        table.handle("finish", {"x": 1})
    with pytest.raises(ConfigError, match=r"place takes camera, exact\?; nothing was given"):
        table.handle("place", {})
