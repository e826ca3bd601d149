"""Training on a bench: a clock that is turned by hand, Tracks made by hand, real recordings, a real store."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cathxr.core import CathxrError, Detection, Event, Observation
from cathxr.runtime.commands import Commands
from cathxr.runtime.moment import Moment, RecordingState
from cathxr.runtime.recording import Recordings, session_opener
from cathxr.runtime.training_commands import TrainingCommands
from cathxr.runtime.training_live import TrainingSession
from cathxr.runtime.training_nouns import Store, StudyHere, TaskHere, TrainingParts
from cathxr.storage.rig_file import example_rig
from cathxr.storage.study_store import StudyStore
from cathxr.training import Place, Practice, Reach, Target, Task, place_task

from ...training_support.tracks import track

AT = "2026-01-01T00:00:00Z"
STEP_NS = 20_000_000
WAIT_S = 30.0
"""How long a test waits for a thread: a limit on hanging, not a measurement."""
HERE, THERE, FAR = (20.0, 0.0, 0.0), (50.0, 0.0, 0.0), (90.0, 0.0, 0.0)


def task(key: str = "two", **more: Any) -> TaskHere:
    """Return a task with a target here and one there, dwell 0.1 s."""
    targets = tuple(
        Target(name, name, Place(position_box_mm=np.array(place)), Reach("tip", 5.0, dwell_s=0.1))
        for name, place in (("here", HERE), ("there", THERE))
    )
    made = Task(key, key.capitalize(), "Reach both.", targets, 30.0, **more)
    roi = example_rig().roi
    return TaskHere(made, place_task(made, ct_from_box=np.eye(4), points_ct={}, roi=roi, sha256="f" * 64))


TASKS = (task(), task("habit", practice=Practice(1, 30.0), target_limit_s=5.0))


class Clock:
    """A clock that is turned by hand."""

    def __init__(self, start_ns: int) -> None:
        self.ns = start_ns

    def now_ns(self) -> int:
        return self.ns

    def wait_until_ns(self, t_ns: int) -> None:
        self.ns = max(self.ns, t_ns)


class Outlet:
    """Keeps what clients would be told."""

    def __init__(self) -> None:
        self.state: Any = None
        self.offer: Any = None
        self.locks: list[Mapping[str, Any]] = []

    def publish_training(self, state: Any) -> None:
        self.state = state

    def publish_training_offer(self, offer: Any) -> None:
        self.offer = offer

    def publish_lock(self, values: Mapping[str, Any], sentence: str) -> None:
        assert bool(sentence) == bool(values)
        self.locks.append(values)


class Station:
    """The live system, as far as training uses it."""

    def __init__(self, folder: Path, clock: Clock) -> None:
        self._clock, self.events, self.session = clock, [], None
        opener = session_opener(folder, rig=example_rig(), config={}, clock=clock, videos=False)
        self.recordings = Recordings(opener, clock=clock, request_reset=self._reset, announce=self.announce)
        self.seq = 0

    def _reset(self) -> None:
        if self.recordings.recorder is not None:
            self.recordings.recorder.note_reset(self.seq)

    def announce(self, event: Event) -> None:
        if self.recordings.recorder is not None:
            self.recordings.recorder.event(event)
        self.events.append(event)
        if self.session is not None:
            self.session.hear(event)

    def start_recording(self, name: str) -> None:
        self.recordings.begin(name)

    def stop_recording(self) -> Mapping[str, Any]:
        return self.recordings.stop({})

    def wait_written(self, timeout_s: float) -> bool:
        return self.recordings.wait(timeout_s)

    def recording_state(self) -> RecordingState:
        return self.recordings.state()


class Bench:
    """One life of the program, from its start to its end or its death."""

    def __init__(
        self,
        folder: Path,
        *,
        study: StudyHere | None = None,
        open_store: Callable[[], Store] | None = None,
        start_ns: int = 10**12,
        key: str = "training",
    ) -> None:
        self.folder, self.store_file, self.recordings = folder, folder / "store.sqlite", folder / "recordings"
        self.clock, self.outlet = Clock(start_ns), Outlet()
        self.station = Station(self.recordings, self.clock)
        self._ids = 0
        self.parts = TrainingParts(
            tasks=TASKS, open_store=open_store or self.opened, utc=self.utc, new_id=self.new_id,
            recordings=str(self.recordings), software="1.0", box="box-1", key=key, study=study,
        )  # fmt: skip
        self.session = TrainingSession(self.parts, clock=self.clock, outlet=self.outlet, station=self.station)
        self.station.session = self.session
        self.commands = Commands()
        for name, command in TrainingCommands(self.session).named().items():
            self.commands.add(name, command)
        self.session.publish_offer()
        self.session.books.start()
        self.session.after.worker.start()

    def opened(self) -> StudyStore:
        """Return the real store."""
        return StudyStore.create(self.store_file, study=self.parts.key, seed=1, software="1.0", at=AT)

    def utc(self) -> str:
        seconds = self.clock.ns // 10**9 % 86400
        return f"2026-01-01T{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}Z"

    def new_id(self) -> str:
        self._ids += 1
        return f"{self.clock.ns // 10**9:x}{self._ids:03d}"

    def do(self, name: str, **args: Any) -> Mapping[str, Any]:
        """Return the result of a command, and have clients told."""
        result = self.commands.handle(name, args)
        self.tell()
        return result

    def refusal(self, name: str, **args: Any) -> str:
        """Return the sentence of a command that must be refused."""
        try:
            self.commands.handle(name, args)
        except CathxrError as error:
            return str(error)
        raise AssertionError(f"{name} was carried out")

    def tell(self) -> Any:
        """Have clients told, and return what they were."""
        self.clock.ns += 100_000_000
        self.session.news()
        self.session.step(0.0)
        return self.outlet.state

    def feed(self, tips: Sequence[Sequence[float] | None]) -> None:
        """Give one Track after another, 50 a second."""
        for tip in tips:
            self.clock.ns += STEP_NS
            made = track(self.clock.ns, tip, seq=self.station.seq)
            missing = tuple(Detection(name, made.seq, made.t_ns, reason="test") for name in ("top", "front"))
            moment = Moment(made, Observation(made.seq, made.t_ns, missing))
            self.station.seq += 1
            if self.station.recordings.recorder is not None:
                self.station.recordings.recorder.moment(moment)
            self.session.take(moment)
            self.session.step(0.0)

    def start(self) -> str:
        """Begin the trial that is ready, past its countdown; return its id."""
        self.do("training_begin")
        assert self.outlet.state.phase == "countdown"
        self.feed([FAR] * 150)
        self.clock.ns += 100_000_000
        self.session.step(0.0)
        assert self.tell().phase == "running"
        return str(self.outlet.state.run.id)

    def reach_all(self) -> None:
        """Reach both targets in the order in which they are offered."""
        for _ in range(2):
            where = HERE if self.tell().now.target == "here" else THERE
            self.feed([where] * 12)

    def until(self, met: Callable[[], Any]) -> Any:
        """Wait for a thread."""
        deadline = time.monotonic() + WAIT_S
        while not (found := met()):
            assert time.monotonic() < deadline, self.outlet.state
            time.sleep(0.01)
            self.tell()
        return found

    def numbers(self) -> Any:
        """Wait for the numbers of the trial that has ended, and return its result."""
        self.until(lambda: self.outlet.state.result is not None and self.outlet.state.result.run is not None)
        self.until(lambda: not self.outlet.state.result.stored.startswith("The numbers"))
        return self.outlet.state.result

    def die(self) -> None:
        """End as a killed program does: what was recorded stays as it is, and nobody is told."""
        recorder = self.station.recordings.recorder
        if recorder is not None:
            self.until_recorded(recorder)
        self.session.books.close(WAIT_S)
        self.session.after.worker.close(WAIT_S)
        for held in self.session.running._mine.values():  # as the operating system does
            os.close(held._handle)

    def until_recorded(self, recorder: Any) -> None:
        """Wait until what was given so far is with the operating system: a killed program loses a quarter second."""
        time.sleep(0.8)

    def close(self) -> None:
        """End the threads."""
        self.station.recordings.close()
        self.session.after.worker.close(WAIT_S)
        self.session.books.close(WAIT_S)
        self.session.running.close()
