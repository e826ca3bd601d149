"""Writes everything to a session in a thread of its own, so that no disk ever delays the tracking.

Replaying a session's Observations must give its Tracks bit for bit. Therefore a recording begins with the first
Observation after a reset of detectors and tracker, and each such reset is written down as an Event `tracker_reset`
with the seq it comes before. Should Observations be lost (a disk that cannot keep up), what follows is left out, and
counted, until a new reset has been asked for and has come: what is in the file always replays exactly.
"""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from cathxr.core import Clock, Event, Health, Image, Observation, Reading, Track
from cathxr.runtime.fanout import sentence
from cathxr.runtime.moment import Moment
from cathxr.runtime.queues import Queue

RESET_EVENT = "tracker_reset"
_ITEMS_BOUND = 8192
_PICTURES_BOUND = 24
_WAIT_S = 0.25
_log = logging.getLogger(__name__)


class Writer(Protocol):
    """What the recorder needs of a session: one method for each noun, of which any may raise on a bad disk."""

    def write_reading(self, reading: Reading) -> None: ...
    def write_observation(self, observation: Observation) -> None: ...
    def write_track(self, track: Track) -> None: ...
    def write_truth(self, truth: Track) -> None: ...
    def write_event(self, event: Event) -> None: ...
    def write_health(self, health: Health) -> None: ...
    def write_image(self, image: Image) -> None: ...
    def flush_if_due(self) -> None: ...
    def close(self) -> None: ...


@dataclass(frozen=True)
class RecorderReport:
    """How a recording went. lost_pairs, lost_items, lost_pictures: left out for want of time. error: why it broke."""

    pairs: int
    lost_pairs: int
    lost_items: int
    lost_pictures: int
    error: str | None = None


class _State(Enum):
    AWAITING_RESET = "awaiting reset"
    RECORDING = "recording"
    CLOSED = "closed"


class Recorder:
    """Takes items without blocking and writes them in its thread, from `start` to `stop`.

    open_writer: called by `start`, so that what it raises reaches whoever asked. request_reset: asks the source for
    a reset of detectors and tracker after a loss; `note_reset` must be told of every reset. failed: told once, in the
    recording thread, why the recording broke. videos: also write the pictures.
    """

    def __init__(
        self,
        open_writer: Callable[[], Writer],
        *,
        clock: Clock,
        request_reset: Callable[[], None],
        failed: Callable[[str], None],
        videos: bool = False,
        bound: int = _ITEMS_BOUND,
    ) -> None:
        self._open_writer, self._request_reset, self._failed = open_writer, request_reset, failed
        self._clock, self._videos, self._bound = clock, videos, bound
        self._jobs: Queue[Callable[[Writer], None]] = Queue(bound, keep_oldest=True)
        self._lock = threading.Lock()
        self._state = _State.AWAITING_RESET
        self._reset_asked = True
        self._pairs = self._lost_pairs = self._lost_items = self._lost_pictures = self._waiting_pictures = 0
        self._last_seq: int | None = None
        self._error: str | None = None
        self._writer: Writer | None = None
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    def start(self) -> None:
        """Open the session. Pairs are let in after the reset that the caller then asks for.

        Raises:
            CathxrError: the session cannot be opened.
        """
        self._writer = self._open_writer()
        self._thread.start()

    def stop(self, timeout_s: float) -> RecorderReport:
        """Write what waits, close the session, and return how it went. What takes longer goes on in the thread."""
        with self._lock:
            self._state = _State.CLOSED
        self._jobs.close()
        self.wait(timeout_s)
        return self.report()

    def wait(self, timeout_s: float) -> bool:
        """Wait until everything is written and the session closed; return whether it is."""
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def report(self) -> RecorderReport:
        """Return how it goes so far."""
        with self._lock:
            return RecorderReport(self._pairs, self._lost_pairs, self._lost_items, self._lost_pictures, self._error)

    def note_reset(self, seq: int) -> None:
        """Record that detectors and tracker were reset before Observation `seq`: pairs are let in from here on."""
        marker = Event(self._clock.now_ns(), RESET_EVENT, {"before_seq": seq})
        taken = self._jobs.put(lambda writer: writer.write_event(marker))
        with self._lock:
            self._reset_asked = False
            if self._state is not _State.CLOSED:
                self._state = _State.RECORDING if taken else _State.AWAITING_RESET

    def moment(self, moment: Moment) -> None:
        """Record one Moment: Observation and Track together or not at all, its pictures where there is time."""
        observation, track = moment.observation, moment.track
        if observation is None:
            return

        def write(writer: Writer) -> None:
            writer.write_observation(observation)
            writer.write_track(track)

        with self._lock:
            if self._state is _State.CLOSED:
                return
            taken = self._state is _State.RECORDING and self._jobs.put(write)
            self._pairs += taken
            self._last_seq = track.seq if taken else None
            self._lost_pairs += not taken and self._pairs > 0
            ask = not taken and not self._reset_asked and len(self._jobs) <= self._bound // 2
            self._reset_asked |= ask
            if not taken:
                self._state = _State.AWAITING_RESET
        if ask:
            self._request_reset()
        if taken and self._videos:
            self._put_pictures(tuple(moment.images.values()))

    def truth(self, truth: Track) -> None:
        """Record the truth of the pair that was let in last; that of a pair left out is left out too."""
        with self._lock:
            wanted = truth.seq == self._last_seq
        if wanted:
            self._put(lambda writer: writer.write_truth(truth))

    def reading(self, reading: Reading) -> None:
        """Record one encoder reading."""
        self._put(lambda writer: writer.write_reading(reading))

    def event(self, event: Event) -> None:
        """Record one event."""
        self._put(lambda writer: writer.write_event(event))

    def health(self, health: Health) -> None:
        """Record one source's state."""
        self._put(lambda writer: writer.write_health(health))

    def _put(self, job: Callable[[Writer], None]) -> None:
        if not self._jobs.put(job):
            with self._lock:
                self._lost_items += self._state is not _State.CLOSED

    def _put_pictures(self, images: tuple[Image, ...]) -> None:
        """Queue a pair's pictures, both or none: pictures are what fills the memory when a disk is slow."""

        def write(writer: Writer) -> None:
            try:
                for image in images:
                    writer.write_image(image)
            finally:
                with self._lock:
                    self._waiting_pictures -= len(images)

        with self._lock:
            room = self._waiting_pictures + len(images) <= _PICTURES_BOUND and self._jobs.put(write)
            self._waiting_pictures += len(images) if room else 0
            self._lost_pictures += 0 if room else len(images)

    def _run(self) -> None:
        """Write until closed and empty; an error ends the recording and nothing else."""
        writer = self._writer
        if writer is None:
            raise AssertionError("the thread starts after the session is open")
        try:
            while not self._jobs.finished:
                job = self._jobs.get(_WAIT_S)
                if job is not None:
                    job(writer)
                else:
                    writer.flush_if_due()
            writer.close()
        except Exception as error:  # a thread's top: stored, told, and the recording is over
            self._break(writer, sentence(error))

    def _break(self, writer: Writer, text: str) -> None:
        with self._lock:
            self._state, self._error = _State.CLOSED, text
        self._jobs.close()
        while self._jobs.get(0.0) is not None:
            pass
        _log.error("the recording stopped: %s", text)
        try:
            writer.close()
        except Exception:  # the disk is bad already, and that has been said
            _log.warning("the broken recording could not be closed", exc_info=True)
        self._failed(text)
