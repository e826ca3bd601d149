"""The seeds' page running: commands under one lock, the segmentation in a thread, states to the page."""

import logging
import threading
from collections.abc import Mapping
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

from cathxr.core import CathxrError, Clock, Event
from cathxr.heart.seeds import Seed
from cathxr.runtime.calibration_task import Ending
from cathxr.runtime.fanout import sentence
from cathxr.runtime.heart_seeds import SeedSession
from cathxr.wire.heart_messages import HeartSeedsState

_SHOW_EVERY_NS = 100_000_000
_JOIN_S = 1.9
_WRITING_S = 10.0
_log = logging.getLogger(__name__)


class SeedsOutlet(Protocol):
    """Where the page is served from: the wire's Hub. Nothing here blocks."""

    def publish_heart_seeds(self, state: HeartSeedsState) -> None: ...
    def publish_event(self, event: Event) -> None: ...


class _Stopped(Exception):
    """Raised in the segmentation's thread, from its own progress: a person does not want it any more."""


class HeartSeedsRun:
    """Runs a session. A context manager: entering starts it, leaving stops it. For any thread."""

    def __init__(self, session: SeedSession, *, outlet: SeedsOutlet, clock: Clock) -> None:
        self._session, self._outlet, self._clock = session, outlet, clock
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._ended = threading.Event()
        self._working: threading.Thread | None = None
        self._published: HeartSeedsState | None = None
        self._shown_ns = 0

    def __enter__(self) -> Self:
        with self._lock:
            self._after_change()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def ending(self) -> Ending | None:
        """How a person brought it to its end, None before."""
        return self._session.ending

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came."""
        return self._ended.wait(timeout_s)

    def stop(self) -> bool:
        """End everything within about two seconds; return whether all threads did end. What is being written is."""
        self._stopping.set()
        free = self._lock.acquire(timeout=_WRITING_S)  # whoever carries out a command holds it
        if free:
            self._lock.release()
        if self._working is not None:
            self._working.join(_JOIN_S)
        return free and (self._working is None or not self._working.is_alive())

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the answer to an operator's command.

        Raises:
            CathxrError: it cannot be done; the sentence says why.
        """
        with self._lock:
            if self._stopping.is_set() or self._session.ending is not None:
                raise CathxrError("The seeds' page has ended: start the command again to go on.")
            result = self._session.handle(name, args)
            self._after_change()
        return result

    def _after_change(self) -> None:
        """Begin what is to be segmented, publish the state, tell the end. Under the lock."""
        seeds = None if self._stopping.is_set() else self._session.take_work()
        if seeds is not None:
            # A daemon: a library that does not come back must not keep the process.
            self._working = threading.Thread(target=self._work, args=(seeds,), name="segmentation", daemon=True)
            self._working.start()
        self._publish()
        ending = self._session.ending
        if ending is not None and not self._ended.is_set():
            payload = {"sentence": ending.sentence, "saved": ending.saved}
            self._outlet.publish_event(Event(self._clock.now_ns(), "seeds_ended", payload))
            self._stopping.set()
            self._ended.set()

    def _publish(self) -> None:
        state = self._session.state()
        if state != self._published:
            self._published = state
            self._outlet.publish_heart_seeds(state)
            self._shown_ns = self._clock.now_ns()

    def _progress(self, what: str, share: float | None) -> None:
        """Take the segmentation's progress, in its thread; end it there when nobody wants it."""
        if self._stopping.is_set() or self._session.stop_wanted:
            raise _Stopped
        with self._lock:
            self._session.note_progress(what, share)
            if self._clock.now_ns() - self._shown_ns >= _SHOW_EVERY_NS:
                self._publish()

    def _work(self, seeds: tuple[Seed, ...]) -> None:
        """Segment, in a thread of its own, and give the outcome to the session."""
        try:
            found = self._session.segment(seeds, self._progress)
        except _Stopped:
            outcome = partial(self._session.take_failure, "")
        except Exception as error:  # a thread's top: the session shows it
            expected = isinstance(error, CathxrError)
            _log.log(logging.INFO if expected else logging.ERROR, "the segmentation failed", exc_info=error)
            outcome = partial(self._session.take_failure, sentence(error))
        else:
            outcome = partial(self._session.take_outcome, found)
        with self._lock:
            if not self._stopping.is_set():
                outcome()
                self._after_change()
