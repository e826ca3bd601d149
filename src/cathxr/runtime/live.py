"""The live system: one source of Tracks, everything that wants them, the recorder, and the commands."""

import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

from cathxr.core import Clock, EndOfStream, Event, Health, Image, Reading, RollStatus, Source, Track
from cathxr.runtime.commands import Command, Commands, Steerable, manoeuvre_command, only, roll_command, steer_command
from cathxr.runtime.fanout import Fanout, sentence
from cathxr.runtime.moment import HealthReport, Moment, MomentSource, RecordingState, RollReport, RollSource
from cathxr.runtime.queues import Deadline
from cathxr.runtime.recording import OpenSession, Recordings
from cathxr.runtime.roll_watch import RollWatch
from cathxr.runtime.supervisor import Meter, RetryPolicy

_READ_TIMEOUT_S = 0.2
_HEALTH_PERIOD_S = 1.0
_JOIN_S = 1.9
_TRACKS_ONLY = "This source gives no Observations, only Tracks: record where it has its own recordings."
_log = logging.getLogger(__name__)

Truth = Callable[[int, int], Track]
"""Gives the exact Track at (t_ns, seq): a twin knows it."""


class Outlet(Protocol):
    """Where live clients are served from: the wire's Hub. Nothing here blocks."""

    def publish_track(self, track: Track) -> None: ...
    def publish_picture(self, image: Image, *, seq: int) -> None: ...
    def publish_event(self, event: Event) -> None: ...
    def publish_health(self, sources: tuple[Health, ...], *, t_ns: int, skew_ns: int | None = None) -> None: ...
    def publish_roll(self, status: RollStatus, *, predicted: bool) -> None: ...
    def publish_session(self, *, recording: bool, name: str | None = None, seconds: float = 0.0) -> None: ...


@dataclass(frozen=True, eq=False)
class LiveOptions:
    """What a live system may have besides its source. Without an entry it refuses what would need it.

    commands: further ones, by name.
    """

    world: Steerable | None = None
    truth: Truth | None = None
    open_session: OpenSession | None = None
    no_recording: str = "This system records nothing: it was started without a folder for recordings."
    record_videos: bool = False
    commands: Mapping[str, Command] = field(default_factory=dict)
    policy: RetryPolicy = field(default_factory=RetryPolicy)


class LiveSystem:
    """Runs a source of Tracks in a thread and hands on what comes. A context manager: entering starts, leaving stops.

    Takers are added to `moments`, `truths`, `events`, `reports` (Health, once a second), `rolls` (the roll's validity,
    at every change) and `recordings` (the recorder's state, once a second while it runs and at every change); they are
    called in the system's threads and never block. Any source will do; one that is a MomentSource also gives
    Observations, pictures and resets, one that is a RollSource the roll's validity.
    """

    def __init__(self, source: Source[Track], *, clock: Clock, options: LiveOptions | None = None) -> None:
        self.moments: Fanout[Moment] = Fanout()
        self.truths: Fanout[Track] = Fanout()
        self.events: Fanout[Event] = Fanout()
        self.reports: Fanout[HealthReport] = Fanout()
        self.recordings: Fanout[RecordingState] = Fanout()
        self.rolls: Fanout[RollReport] = Fanout()
        self._source, self._clock = source, clock
        self._options = options or LiveOptions()
        self._rich = source if isinstance(source, MomentSource) else None
        self._rolled = source if isinstance(source, RollSource) else None
        self._roll_watch = RollWatch(self._rolled, clock=clock, write=self._tell_roll)
        self._recorder = Recordings(
            self._options.open_session if self._rich is not None else None,
            clock=clock,
            request_reset=self._request_reset,
            announce=self.announce,
            refusal=self._options.no_recording if self._rich is not None else _TRACKS_ONLY,
            videos=self._options.record_videos,
        )
        self._meter = Meter()
        self._error: str | None = None
        self._running = False
        self._stopping = threading.Event()
        self._ended = threading.Event()
        self._threads = (
            threading.Thread(target=self._track, name="tracking", daemon=True),
            threading.Thread(target=self._supervise, name="supervisor", daemon=True),
        )
        self._commands = self._make_commands()

    def __enter__(self) -> Self:
        if self._rich is not None:
            self._rich.resets.add("recorder", self._after_reset)
        self.moments.add("recorder", self._record_moment)
        self.moments.add("roll", self._roll_watch.note)
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def stop(self) -> bool:
        """End everything within about two seconds; return whether all threads did end."""
        self._stopping.set()
        deadline = Deadline(_JOIN_S)
        self._recorder.close()
        for thread in self._threads:
            if thread.ident is not None:
                thread.join(deadline.left_s)
        return not any(thread.is_alive() for thread in self._threads)

    @property
    def ended(self) -> bool:
        """Whether the source has given all it has."""
        return self._ended.is_set()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end of the source; return whether it came."""
        return self._ended.wait(timeout_s)

    def connect(self, name: str, outlet: Outlet) -> None:
        """Publish everything to `outlet`: the Track before its pictures, for whoever waits for it."""

        def moment(each: Moment) -> None:
            outlet.publish_track(each.track)
            for image in each.images.values():
                outlet.publish_picture(image, seq=each.track.seq)

        def session(each: RecordingState) -> None:
            outlet.publish_session(recording=each.recording, name=each.name, seconds=each.seconds)

        def report(each: HealthReport) -> None:
            outlet.publish_health(each.sources, t_ns=each.t_ns, skew_ns=each.skew_ns)

        self.moments.add(name, moment)
        self.events.add(name, outlet.publish_event)
        self.reports.add(name, report)
        self.recordings.add(name, session)
        self.rolls.add(name, lambda each: outlet.publish_roll(each.status, predicted=each.predicted))

    def take_reading(self, reading: Reading) -> None:
        """Record an encoder reading: a taker for `OpticalSource.readings`."""
        recorder = self._recorder.recorder
        if recorder is not None:
            recorder.reading(reading)

    def announce(self, event: Event) -> None:
        """Tell everyone, and the recording, what happened."""
        recorder = self._recorder.recorder
        if recorder is not None:
            recorder.event(event)
        self.events.write(event)
        if event.kind.startswith("recording_"):
            self.recordings.write(self._recorder.state())

    @property
    def commands(self) -> Commands:
        """What operators may ask for; more may be added."""
        return self._commands

    def start_recording(self, name: str) -> None:
        """Begin a recording in a folder of that name, which may lie inside another one's. Raises CathxrError."""
        self._recorder.begin(name)

    def stop_recording(self) -> Mapping[str, Any]:
        """End the recording and return how it went. Raises ConfigError where none runs."""
        return self._recorder.stop({})

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the answer to an operator's command; see `Commands.handle` for what it raises."""
        return self._commands.handle(name, args)

    def recording_state(self) -> RecordingState:
        """Return whether a recording runs."""
        return self._recorder.state()

    def roll_status(self) -> RollStatus:
        """Return whether the roll is valid, and what to do where it is not."""
        return RollStatus(False, False) if self._rolled is None else self._rolled.roll_status(self._clock.now_ns())

    def wait_written(self, timeout_s: float) -> bool:
        """Wait until the recording that was stopped last is on the disk; return whether it is."""
        return self._recorder.wait(timeout_s)

    def health_report(self) -> HealthReport:
        """Return the Health of every source, of the recorder, and of each output that failed."""
        now_ns = self._clock.now_ns()
        sources: list[Health] = []
        if self._rich is not None:
            sources += self._rich.health(now_ns)
        if self._rich is None or self._error is not None:
            sources.append(self._meter.health(now_ns, "tracks", running=self._running, error=self._error))
        recorder = self._recorder.recorder
        if recorder is not None:
            report = recorder.report()
            losses = report.lost_pairs + report.lost_items + report.lost_pictures
            sources.append(Health(now_ns, "recorder", True, None, 0.0, losses, report.error))
        for fanout in (self.moments, self.truths, self.events, self.reports, self.recordings, self.rolls):
            sources += fanout.health(now_ns)
        return HealthReport(now_ns, tuple(sources), None if self._rich is None else self._rich.skew_ns)

    def _make_commands(self) -> Commands:
        commands, world = Commands(), self._options.world
        commands.add("steer", steer_command(world, self._clock))
        commands.add("manoeuvre", manoeuvre_command(world, self._clock))
        commands.add("reset_tracker", self._reset_tracker)
        commands.add("record_start", self._recorder.start)
        commands.add("record_stop", self._recorder.stop)
        rolled = self._rolled
        confirm, zero = (None, None) if rolled is None else (rolled.confirm_roll, rolled.zero_roll)
        commands.add("roll_confirm", roll_command("roll_confirm", confirm, partial(self._say, "roll_confirmed")))
        commands.add("roll_zero", roll_command("roll_zero", zero, partial(self._say, "roll_zeroed")))
        for name, command in self._options.commands.items():
            commands.add(name, command)
        return commands

    def _reset_tracker(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("reset_tracker", args, ())
        self._request_reset()
        self._say("reset_asked")
        return {}

    def _say(self, kind: str) -> None:
        """Tell everyone, and the recording, that this has happened now."""
        self.announce(Event(self._clock.now_ns(), kind, {}))

    def _tell_roll(self, report: RollReport) -> None:
        """Hand on the roll's validity; the recording gets it too, as an event."""
        self.rolls.write(report)
        recorder = self._recorder.recorder
        if recorder is not None:
            recorder.event(Event(self._clock.now_ns(), "roll_status", asdict(report.status)))

    def _request_reset(self) -> None:
        if self._rich is not None:
            self._rich.request_reset()

    def _after_reset(self, seq: int) -> None:
        recorder = self._recorder.recorder
        if recorder is not None:
            recorder.note_reset(seq)

    def _record_moment(self, moment: Moment) -> None:
        recorder = self._recorder.recorder
        if recorder is not None:
            recorder.moment(moment)

    def _track(self) -> None:
        """Read and hand on until told to stop; whatever fails is stored, shown, and tried again by the policy."""
        failures = 0
        while not self._stopping.is_set():
            try:
                with self._source:
                    self._running = True
                    self._meter.restart()
                    while not self._stopping.is_set():
                        moment = self._next()
                        if moment is not None:
                            failures, self._error = 0, None
                            self._hand_on(moment)
            except EndOfStream:
                self._running = False
                self.announce(Event(self._clock.now_ns(), "end_of_stream", {}))
                self._ended.set()
                return
            except Exception as error:  # a thread's top
                failures += 1
                self._error = sentence(error)
                _log.error("the source of tracks failed (%d in a row)", failures, exc_info=error)
                self._stopping.wait(self._options.policy.wait_s(failures))
            finally:
                self._running = False

    def _next(self) -> Moment | None:
        if self._rich is not None:
            return self._rich.read_moment(_READ_TIMEOUT_S)
        track = self._source.read(_READ_TIMEOUT_S)
        return None if track is None else Moment(track)

    def _hand_on(self, moment: Moment) -> None:
        """Give a Moment to every taker, then the truth of its instant."""
        self._meter.count(moment.track.seq, self._clock.now_ns())
        self.moments.write(moment)
        recorder = self._recorder.recorder
        wanted = recorder is not None or self.truths.has_takers
        if self._options.truth is not None and moment.images and wanted:
            truth = self._options.truth(moment.track.t_ns, moment.track.seq)
            if recorder is not None:
                recorder.truth(truth)
            self.truths.write(truth)

    def _supervise(self) -> None:
        """Report once a second."""
        while not self._stopping.wait(_HEALTH_PERIOD_S):
            try:
                self._report()
            except Exception:  # a thread's top: the next report may be better, and tracking does not need it
                _log.exception("a health report failed")

    def _report(self) -> None:
        report = self.health_report()
        recorder = self._recorder.recorder
        if recorder is not None:
            for each in report.sources:
                recorder.health(each)
        self.reports.write(report)
        self._roll_watch.look(predictions=True)
        state = self._recorder.state()
        if state.recording:
            self.recordings.write(state)
