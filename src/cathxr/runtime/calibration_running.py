"""A calibration running, whatever it looks at: commands under one lock, long work in a thread, states to the page."""

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

from cathxr.core import CalibrationError, Clock, Event, Health, Image
from cathxr.runtime.calibration_task import Ending, Job, Steps
from cathxr.runtime.fanout import sentence
from cathxr.runtime.queues import Deadline
from cathxr.runtime.supervisor import DeviceThread
from cathxr.wire.calibration_messages import CalibrationState

_HEALTH_NS = 1_000_000_000
_JOIN_S = 1.9
_WRITING_S = 10.0
"""Files on a slow disk may take longer than anything else here; half of them would be worse."""
_log = logging.getLogger(__name__)


class Outlet(Protocol):
    """Where the page is served from: the wire's Hub. Nothing here blocks."""

    def publish_calibration(self, state: CalibrationState) -> None: ...
    def publish_picture(self, image: Image, *, seq: int) -> None: ...
    def publish_event(self, event: Event) -> None: ...
    def publish_health(self, sources: tuple[Health, ...], *, t_ns: int, skew_ns: int | None = None) -> None: ...


class RunningCalibration(ABC):
    """Runs a task. A context manager: entering starts it, leaving stops it.

    A thread for each device gives what it reads to the deriving class, whose `_look_once` is called over and over in
    one more thread: to wait a little for news, and to give them to the task.
    """

    _what = "a picture"

    def __init__(self, task: Steps, devices: Mapping[str, DeviceThread[Any]], *, outlet: Outlet, clock: Clock) -> None:
        self._outlet, self._clock, self._devices = outlet, clock, dict(devices)
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._stopping = threading.Event()
        self._steps = task
        self._ended = threading.Event()
        self._looker = threading.Thread(target=self._look, name="calibration", daemon=True)
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="calibration-work")
        self._working: Future[Any] | None = None
        self._published: CalibrationState | None = None
        self._health_due_ns = 0

    def __enter__(self) -> Self:
        with self._lock:
            self._after_change()
        for device in self._devices.values():
            device.start()
        self._looker.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def stop(self) -> bool:
        """End everything within about two seconds; return whether all threads did end. What is being written is."""
        self._stopping.set()
        self._arrived.set()
        deadline = Deadline(_JOIN_S)
        for device in self._devices.values():
            device.ask_to_stop()
        self._worker.shutdown(wait=False, cancel_futures=True)
        # Whoever carries out a command holds the lock: a file that is being written is written first.
        free = self._lock.acquire(timeout=_WRITING_S)
        if free:
            self._lock.release()
        if self._looker.ident is not None:
            self._looker.join(deadline.left_s)
        joined = [device.join(deadline.left_s) for device in self._devices.values()]
        working = self._working is not None and self._working.running()
        return free and all(joined) and not self._looker.is_alive() and not working

    @property
    def ending(self) -> Ending | None:
        """How a person brought it to its end, None before."""
        return self._steps.ending

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came."""
        return self._ended.wait(timeout_s)

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the answer to an operator's command.

        Raises:
            CathxrError: it cannot be done; the sentence says why.
        """
        with self._lock:
            if self._stopping.is_set() or self._steps.ending is not None:
                raise CalibrationError("This calibration has ended: start the command again for another.")
            result = self._steps.handle(name, args)
            self._after_change()
        return result

    @abstractmethod
    def _look_once(self) -> None:
        """Wait a little for what the devices give, and give it to the task."""

    def _look(self) -> None:
        """Look until told to stop."""
        while not self._stopping.is_set():
            self._look_once()
            self._guarded(self._report)

    def _report(self) -> None:
        """Tell of the devices once a second."""
        now_ns = self._clock.now_ns()
        if now_ns < self._health_due_ns or not self._devices:
            return
        self._health_due_ns = now_ns + _HEALTH_NS
        sources = {name: device.health(now_ns) for name, device in self._devices.items()}
        self._outlet.publish_health(tuple(sources.values()), t_ns=now_ns)
        with self._lock:
            self._steps.note_health(sources)
            self._after_change()

    def _guarded(self, step: Callable[[], None]) -> None:
        """Do one step of the looking thread; what fails is logged, and the next may do better."""
        try:
            step()
        except Exception:  # a thread's top
            _log.exception("looking at %s failed", self._what)

    def _after_change(self) -> None:
        """Publish the state, start what is to be worked out, and tell the end. Under the lock."""
        job = self._steps.take_job()
        if job is not None and not self._stopping.is_set():
            if self._working is not None:
                self._working.cancel()  # what has not begun is void
            with suppress(RuntimeError):  # it is being stopped at this moment
                self._working = self._worker.submit(self._work, job)
        state = self._steps.state()
        if state != self._published:
            self._published = state
            self._outlet.publish_calibration(state)
        ending = self._steps.ending
        if ending is not None and not self._ended.is_set():
            payload = {"sentence": ending.sentence, "saved": ending.saved}
            self._outlet.publish_event(Event(self._clock.now_ns(), "calibration_ended", payload))
            self._ended.set()

    def _work(self, job: Job[Any]) -> None:
        """Do one job in the worker's thread and give its outcome to the task."""
        try:
            value = job.work()
        except Exception as error:  # a thread's top: the task shows it
            expected = type(error).__module__.startswith("cathxr.") or isinstance(error, ValueError)
            _log.log(logging.INFO if expected else logging.ERROR, "a calibration's work failed", exc_info=error)
            outcome = partial(job.failed, sentence(error))
        else:
            outcome = partial(job.done, value)
        with self._lock:
            if not self._stopping.is_set() and self._steps.ending is None:
                try:
                    outcome()
                    self._after_change()
                except Exception:  # a thread's top
                    _log.exception("the outcome of a calibration's work could not be taken")
