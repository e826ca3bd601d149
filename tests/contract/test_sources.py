"""The one contract that every source keeps: each driver that is installed, found as the program finds it."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from cathxr.app.plugins import CAMERAS, ENCODERS, available, load, make_camera, make_encoder
from cathxr.core import ConfigError, DeviceError, DeviceNotFound, EndOfStream, Image, Reading, Rig, Source, Track
from cathxr.devices.clock import ManualClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.runtime.replay import ReplaySource
from cathxr.twin.board_camera import TwinBoardCamera

PERIOD_NS = 40_000_000
"""The longest period of anything here: the video's and the session's."""

DRIVERS = [(group, name) for group in (CAMERAS, ENCODERS) for name in available(group)]
SOURCES = [*DRIVERS, ("source", "replay"), ("source", "twin board")]
Make = Callable[[], Source[Any]]


@pytest.fixture(params=SOURCES, ids=lambda each: f"{each[0]}:{each[1]}")
def made(request: pytest.FixtureRequest, small_rig: Rig, clock: ManualClock) -> Source[Any]:
    """A closed source of each kind. A driver of somebody else's is tried without options."""
    group, name = request.param
    if name == "twin board":
        texture = np.full((76, 76), 255, np.uint8)
        texture[16:60, 16:38] = 0
        options = {"texture": texture, "px_per_mm": 1.0, "offset_mm": (8.0, 8.0)}
        return TwinBoardCamera(small_rig, "top", clock=clock, options=options)
    if group == "source":
        return ReplaySource(request.getfixturevalue("session"), clock=clock, tracker=None)
    options: dict[str, Any] = {}
    if name == "opencv" and group == CAMERAS:
        options = {"device": str(request.getfixturevalue("video"))}
    if group == CAMERAS:
        return make_camera(name, small_rig, "top", clock=clock, options=options)
    if name == "serial":
        board = FakeBoard(lambda t_ns: t_ns // 10_000_000, start_ns=clock.now_ns())
        options = {"port": "fake", "open_port": FakePort(board, clock).open}
    return make_encoder(name, small_rig, clock=clock, options=options)


@pytest.fixture
def source(made: Source[Any]) -> Source[Any]:
    """The same, but skipped where this computer lacks the device."""
    try:
        with made:
            return made
    except DeviceNotFound as error:
        pytest.skip(f"no such device here: {error}")


def items(source: Source[Any], count: int) -> list[Any]:
    """Read so many items; an end before is an end."""
    found: list[Any] = []
    try:
        for _ in range(50 * count):
            item = source.read(1.0)
            if item is not None:
                found.append(item)
            if len(found) == count:
                break
    except EndOfStream:
        pass
    assert found
    return found


def test_the_built_in_drivers_are_found() -> None:
    # They are declared in pyproject.toml like anyone's: this fails where cathxr is not installed.
    assert set(available(CAMERAS)) >= {"twin", "opencv"}
    assert set(available(ENCODERS)) >= {"twin", "serial"}


def test_numbers_and_instants_increase(source: Source[Any]) -> None:
    with source:
        found = items(source, 8)
    assert len(found) == 8
    assert found[0].seq >= 0
    assert all(one.seq < other.seq and one.t_ns < other.t_ns for one, other in pairwise(found))


def test_items_are_what_they_say(source: Source[Any], small_rig: Rig) -> None:
    with source:
        for item in items(source, 3):
            assert isinstance(item, (Image, Reading, Track))
            if isinstance(item, Image):
                assert item.camera == "top"
                assert item.size_px == small_rig.cameras["top"].size_px


def test_instants_lie_in_the_past_of_the_hosts_clock(source: Source[Any], clock: ManualClock) -> None:
    with source:
        for _ in range(5):
            item = items(source, 1)[0]
            assert clock.now_ns() - 1_000_000_000 <= item.t_ns <= clock.now_ns()


def test_reading_takes_no_longer_than_asked(source: Source[Any], clock: ManualClock) -> None:
    with source:
        for timeout_s in (0.0, 0.001, 0.02, 0.0):
            before_ns = clock.now_ns()
            source.read(timeout_s)
            assert clock.now_ns() - before_ns <= timeout_s * 1e9
        # Without waiting, nothing new comes once what is due has been taken.
        assert any(source.read(0.0) is None for _ in range(3))


def test_nothing_is_lost_by_a_timeout(source: Source[Any]) -> None:
    with source:
        found = [item for _ in range(100) if (item := source.read(0.003)) is not None]
    assert len(found) >= 2
    assert all(other.seq == one.seq + 1 for one, other in pairwise(found))


def test_a_closed_source_cannot_be_read(made: Source[Any], source: Source[Any]) -> None:
    for each in (made, source):
        with pytest.raises(DeviceError, match="before it is opened"):
            each.read(0.0)


def test_closing_twice_and_closing_unopened_do_no_harm(made: Source[Any]) -> None:
    made.__exit__(None, None, None)
    made.__exit__(None, None, None)
    with pytest.raises(DeviceError):
        made.read(0.0)


def test_it_opens_again_and_time_goes_on(source: Source[Any]) -> None:
    with source:
        before = items(source, 3)[-1]
    with source:
        after = items(source, 1)[0]
    assert after.t_ns > before.t_ns


def test_an_error_of_the_users_passes_through_and_closes_it(source: Source[Any]) -> None:
    def use() -> None:
        with source:
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        use()
    with pytest.raises(DeviceError):
        source.read(0.0)


def test_the_end_is_the_end_every_time(source: Source[Any], clock: ManualClock) -> None:
    with source:
        for _ in range(60):
            try:
                source.read(1.0)
            except EndOfStream:
                break
        else:
            pytest.skip("this source does not end")
        for _ in range(3):
            with pytest.raises(EndOfStream):
                source.read(0.0)
            clock.advance_ns(PERIOD_NS)
    with source:
        assert items(source, 2)  # opened again, it begins again


def test_whoever_comes_late_is_told_by_a_gap(source: Source[Any], clock: ManualClock) -> None:
    with source:
        first = items(source, 1)[0]
        clock.advance_ns(5 * PERIOD_NS + PERIOD_NS // 2)
        late = items(source, 1)[0]
        if isinstance(late, Track):
            pytest.skip("a replay gives what is less than 100 ms late, for the tracker's sake")
        assert late.seq > first.seq + 1
        assert clock.now_ns() - late.t_ns < 3 * PERIOD_NS  # the newest, not the oldest


@pytest.mark.parametrize(("group", "name"), DRIVERS, ids=lambda each: str(each))
def test_options_that_nobody_knows_are_refused(group: str, name: str, small_rig: Rig, clock: ManualClock) -> None:
    if not available(group)[name].value.startswith("cathxr."):
        pytest.skip("another package's driver")
    driver = load(group, name)
    arguments = (small_rig, "top") if group == CAMERAS else (small_rig,)
    with pytest.raises(ConfigError, match="no_such_option"):
        driver(*arguments, clock=clock, options={"no_such_option": 1})


def test_a_driver_that_nobody_installed_is_refused_with_those_there_are() -> None:
    with pytest.raises(ConfigError, match="no camera driver named 'webcam': there are opencv, twin"):
        load(CAMERAS, "webcam")
    with pytest.raises(ConfigError, match=r"no plug-in of the group cathxr\.none named 'x': none is installed"):
        load("cathxr.none", "x")
