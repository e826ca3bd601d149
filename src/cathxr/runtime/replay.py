"""Plays a recorded session again: offline to the last bit, or live in real time as a Source of Tracks."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from threading import Event
from types import TracebackType
from typing import Self

from cathxr.core import Clock, DeviceError, EndOfStream, Health, Image, Observation, Track, Tracker
from cathxr.runtime.fanout import Fanout
from cathxr.runtime.moment import Moment
from cathxr.runtime.recorder import RESET_EVENT
from cathxr.runtime.supervisor import Meter
from cathxr.storage.session import SessionReader

_LATE_NS = 100_000_000
_PAUSE_NS = 100_000_000
"""Between the end of a session and its next beginning."""


@dataclass(frozen=True, eq=False)
class ReplayOptions:
    """How a session is played. speed: 1 is real time. loop: begin again at the end. pictures: if there are videos."""

    speed: float = 1.0
    loop: bool = False
    pictures: bool = True

    def __post_init__(self) -> None:
        if not 0.01 <= self.speed <= 100.0:
            raise ValueError(f"speed: expected 0.01 to 100, got {self.speed}")


def replay_tracks(session: SessionReader, tracker: Tracker) -> Iterator[Track]:
    """Yield the Tracks that `tracker` makes of a session's Observations: the recorded ones bit for bit, latency aside.

    The tracker is reset where it was reset while recording.

    Raises:
        DataError: the session is damaged.
    """
    resets = reset_seqs(session)
    tracker.reset()
    for observation in session.observations():
        if observation.seq in resets:
            tracker.reset()
        yield tracker.update(observation)


def reset_seqs(session: SessionReader) -> frozenset[int]:
    """Return the seqs of the Observations before which the tracker was reset while recording."""
    events = (each for each in session.events() if each.kind == RESET_EVENT)
    return frozenset(int(each.payload.get("before_seq", -1)) for each in events)


class ReplaySource:
    """A Source of Tracks from a session, at the pace at which they were recorded (times `speed`).

    tracker: makes the Tracks anew from the Observations; None gives the recorded ones. Tracks and pictures are stamped
    with the instants at which they are due now, so that time goes on when the session begins again; `seq` goes on too,
    and equals the recorded one the first time through. The Observation in a Moment is as it was recorded.
    """

    def __init__(
        self, session: SessionReader, *, clock: Clock, tracker: Tracker | None, options: ReplayOptions | None = None
    ) -> None:
        self.resets: Fanout[int] = Fanout()
        self._session, self._clock, self._tracker = session, clock, tracker
        self._options = options or ReplayOptions()
        self._reset_wanted = Event()
        self._meter = Meter()
        self._moments: Iterator[Moment] | None = None
        self._next: Moment | None = None
        self._ended = False
        self._recorded_ns = self._start_ns = self._first_seq = self._base_seq = self._last_seq = 0
        self._last_t_ns = -1
        self._skew_ns: int | None = None

    def __enter__(self) -> Self:
        if self._moments is not None:
            raise DeviceError("The replay is open already: close it first.")
        self._base_seq = self._last_seq = 0
        self._ended = False
        self._meter.restart()
        self._begin(self._last_t_ns + 1)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._moments = self._next = None

    def read(self, timeout_s: float) -> Track | None:
        """Return the next Track, None when none is due within `timeout_s`.

        Raises:
            EndOfStream: the session is over; DeviceError: it is not open; DataError: it is damaged.
        """
        moment = self.read_moment(timeout_s)
        return None if moment is None else moment.track

    def read_moment(self, timeout_s: float) -> Moment | None:
        """Return the next Track with its Observation and pictures, None when none is due in time. Raises as `read`."""
        if self._moments is None:
            raise DeviceError("The replay is read before it is opened: use it in a with statement.")
        until_ns = self._clock.now_ns() + round(max(0.0, timeout_s) * 1e9)
        while True:
            moment = self._peek()
            due_ns = self._due_ns(moment.track.t_ns)
            self._clock.wait_until_ns(min(due_ns, until_ns))
            if due_ns > until_ns:
                return None
            self._next = None
            now_ns = self._clock.now_ns()
            if now_ns - due_ns <= _LATE_NS or now_ns > until_ns or not self._has_due():
                return self._stamped(moment)
            # Too slow for this speed: the tracker has seen this one, and a newer one is wanted.

    def request_reset(self) -> None:
        """Have the tracker reset before the next Observation. From any thread."""
        self._reset_wanted.set()

    def health(self, now_ns: int) -> tuple[Health, ...]:
        """Return the Health of the replay; its losses are Tracks left out because it could not keep the pace."""
        running = self._moments is not None and not self._ended
        return (self._meter.health(now_ns, "replay", running=running),)

    @property
    def skew_ns(self) -> int | None:
        """The latest Observation's skew."""
        return self._skew_ns

    def _begin(self, earliest_ns: int) -> None:
        """Start the session from its first Observation, which is due as soon as it is ready."""
        self._moments = self._played()
        self._next = next(self._moments, None)
        if self._next is not None:
            self._recorded_ns, self._first_seq = self._next.track.t_ns, self._next.track.seq
        self._start_ns = max(earliest_ns, self._clock.now_ns())

    def _peek(self) -> Moment:
        """Return the next Moment as recorded. Raises EndOfStream."""
        if self._next is None and self._moments is not None:
            self._next = next(self._moments, None)
        if self._next is None and self._options.loop and self._last_seq > 0:
            self._base_seq = self._last_seq + 1
            self._begin(self._last_t_ns + _PAUSE_NS)
        if self._next is None:
            self._ended = True
            raise EndOfStream
        return self._next

    def _has_due(self) -> bool:
        """Return whether another Moment is due already."""
        if self._next is None and self._moments is not None:
            self._next = next(self._moments, None)
        return self._next is not None and self._due_ns(self._next.track.t_ns) <= self._clock.now_ns()

    def _due_ns(self, recorded_ns: int) -> int:
        return self._start_ns + round((recorded_ns - self._recorded_ns) / self._options.speed)

    def _stamped(self, moment: Moment) -> Moment:
        """Return a recorded Moment as one of now."""
        seq = moment.track.seq if self._base_seq == 0 else self._base_seq + moment.track.seq - self._first_seq
        self._last_seq, self._last_t_ns = seq, self._due_ns(moment.track.t_ns)
        if moment.observation is not None:
            self._skew_ns = moment.observation.skew_ns
        track = replace(moment.track, seq=seq, t_ns=self._last_t_ns, latency_ns=None)
        images = {name: replace(each, t_ns=self._due_ns(each.t_ns)) for name, each in moment.images.items()}
        self._meter.count(seq, self._clock.now_ns())
        return Moment(track, moment.observation, images)

    def _played(self) -> Iterator[Moment]:
        """Yield the session's Moments as recorded, the tracker run anew where there is one."""
        resets = reset_seqs(self._session) if self._tracker is not None else frozenset()
        recorded = {} if self._tracker is not None else {each.seq: each for each in self._session.tracks()}
        pictures = _PictureFinder(self._session) if self._options.pictures and self._session.videos else None
        if self._tracker is not None:
            self._tracker.reset()
        for observation in self._session.observations():
            if self._tracker is not None:
                if observation.seq in resets or self._reset_wanted.is_set():
                    self._reset_wanted.clear()
                    self._tracker.reset()
                    self.resets.write(observation.seq)
                track: Track | None = self._tracker.update(observation)
            else:
                track = recorded.get(observation.seq)
            if track is not None:
                images = {} if pictures is None else pictures.images(observation)
                yield Moment(track, observation, images)


class _PictureFinder:
    """Walks through a session's videos beside its Observations."""

    def __init__(self, session: SessionReader) -> None:
        self._videos = {camera: session.images(camera) for camera in session.rig.cameras}
        self._next: dict[str, Image | None] = {}

    def images(self, observation: Observation) -> Mapping[str, Image]:
        """Return the pictures that an Observation was made from, as far as they were recorded."""
        found = {}
        for detection in observation.detections:
            image = self._at(detection.camera, detection.t_ns) if detection.seq >= 0 else None
            if image is not None:
                found[detection.camera] = image
        return found

    def _at(self, camera: str, t_ns: int) -> Image | None:
        """Return the camera's picture of exactly that instant, None where it was not recorded."""
        video = self._videos.get(camera)
        if video is None:
            return None
        waiting = self._next.pop(camera, None)
        for image in chain(() if waiting is None else (waiting,), video):
            if image.t_ns == t_ns:
                return image
            if image.t_ns > t_ns:
                self._next[camera] = image
                return None
        return None
