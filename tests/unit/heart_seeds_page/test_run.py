"""The segmentation runs beside the commands: progress comes, it is stopped, its failures are shown, the end is told."""

import threading
from collections.abc import Callable
from typing import Any

import pytest

from cathxr.core import CathxrError, DataError, Event
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.heart_seeds import SeedSession
from cathxr.runtime.heart_seeds_run import HeartSeedsRun
from cathxr.wire.heart_messages import HeartSeedsState

from .conftest import labels_of

HANG_S = 60.0
"""Limit on waiting for what must come; not a measurement."""


class Page:
    """Takes what is published."""

    def __init__(self) -> None:
        self.states: list[HeartSeedsState] = []
        self.events: list[Event] = []
        self._news = threading.Condition()

    def publish_heart_seeds(self, state: HeartSeedsState) -> None:
        with self._news:
            self.states.append(state)
            self._news.notify_all()

    def publish_event(self, event: Event) -> None:
        self.events.append(event)

    def until(self, wanted: Callable[[HeartSeedsState], bool]) -> HeartSeedsState:
        """Wait until the newest state is wanted."""
        with self._news:
            assert self._news.wait_for(lambda: bool(self.states) and wanted(self.states[-1]), HANG_S), self.states[-1:]
            return self.states[-1]


def run(session: SeedSession, page: Page) -> HeartSeedsRun:
    return HeartSeedsRun(session, outlet=page, clock=MonotonicClock())


def test_without_labels_it_segments_at_once_and_seeds_may_be_placed_meanwhile(
    make_session: Callable[..., SeedSession], segmentation: Any
) -> None:
    segmentation.hold = threading.Event()
    page = Page()
    with run(make_session(), page) as running:
        page.until(lambda state: state.progress == 0.25 and state.doing == "Separating")
        running.handle("seeds_place", {"structure": "aorta", "position_mm": [-2.0, -15.0, 106.0]})
        assert page.states[-1].seeds
        assert page.states[-1].stage == "segmenting"
        segmentation.hold.set()
        state = page.until(lambda state: state.stage == "ready")
    assert state.labels_version == 1
    assert not state.is_current, "it began before the seed was placed"
    assert segmentation.given == [()]


def test_it_is_stopped(make_session: Callable[..., SeedSession], segmentation: Any) -> None:
    segmentation.hold = threading.Event()
    page = Page()
    with run(make_session(labels=labels_of()), page) as running:
        running.handle("seeds_segment", {})
        assert segmentation.begun.wait(HANG_S)
        running.handle("seeds_stop", {})
        state = page.until(lambda state: state.stage == "ready")
        assert (state.labels_version, state.labels_from) == (1, "file")
        segmentation.hold.set()
        running.handle("seeds_segment", {})
        page.until(lambda state: state.labels_version == 2)
        assert running.stop()


@pytest.mark.parametrize(
    ("error", "told"),
    [(DataError("There is no contrast in the heart."), "There is no contrast"), (KeyError("x"), "KeyError")],
)
def test_a_failure_is_shown(
    make_session: Callable[..., SeedSession], segmentation: Any, error: Exception, told: str
) -> None:
    segmentation.error = error
    page = Page()
    with run(make_session(), page):
        state = page.until(lambda state: state.stage == "failed")
    assert told in state.advice


def test_done_ends_it_also_in_the_midst_of_a_segmentation(
    make_session: Callable[..., SeedSession], segmentation: Any
) -> None:
    segmentation.hold = threading.Event()
    page = Page()
    with run(make_session(), page) as running:
        assert segmentation.begun.wait(HANG_S)
        running.handle("seeds_done", {})
        assert running.wait(HANG_S)
        assert running.ending is not None
        assert running.stop(), "no thread is left"
        with pytest.raises(CathxrError, match="has ended"):
            running.handle("seeds_segment", {})
    assert [(event.kind, event.payload["saved"]) for event in page.events] == [("seeds_ended", True)]


def test_leaving_ends_the_segmentation(make_session: Callable[..., SeedSession], segmentation: Any) -> None:
    segmentation.hold = threading.Event()
    running = run(make_session(), Page())
    running.__enter__()
    assert segmentation.begun.wait(HANG_S)
    assert running.stop()
    assert running.ending is None
