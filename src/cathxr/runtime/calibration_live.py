"""A calibration running: a thread for each camera, one that looks at the newest pictures, one for long work.

A picture that nobody has looked at when the next one comes is passed over: the page shows the present.
"""

import logging
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

from cathxr.core import CalibrationError, Clock, Event, Health, Image, Source
from cathxr.runtime.calibration_task import Ending, Job, Task
from cathxr.runtime.fanout import sentence
from cathxr.runtime.queues import Deadline, Queue
from cathxr.runtime.supervisor import DeviceThread
from cathxr.wire.calibration_messages import CalibrationState

_WAIT_S = 0.1
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


class LiveCalibration:
    """Runs a Task. A context manager: entering starts it, leaving stops it.

    sources: the cameras by the name that their pictures have; each picture that was looked at is published, and then
    the state that belongs to it. stills: pictures that do not change, published once.
    """

    def __init__(
        self,
        task: Task[Any],
        sources: Mapping[str, Source[Image]],
        *,
        outlet: Outlet,
        clock: Clock,
        stills: tuple[Image, ...] = (),
    ) -> None:
        self._task, self._outlet, self._clock, self._stills = task, outlet, clock, stills
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._newest: dict[str, Queue[Image]] = {name: Queue(1) for name in sources}
        self._devices = {
            name: DeviceThread(name, source, partial(self._take, name), clock=clock) for name, source in sources.items()
        }
        self._stopping = threading.Event()
        self._ended = threading.Event()
        self._looker = threading.Thread(target=self._look, name="calibration", daemon=True)
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="calibration-work")
        self._working: Future[Any] | None = None
        self._published: CalibrationState | None = None
        self._health_due_ns = 0

    def __enter__(self) -> Self:
        for image in self._stills:
            self._outlet.publish_picture(image, seq=image.seq)
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
        return self._task.ending

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came."""
        return self._ended.wait(timeout_s)

    def handle(self, name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the answer to an operator's command.

        Raises:
            CathxrError: it cannot be done; the sentence says why.
        """
        with self._lock:
            if self._stopping.is_set() or self._task.ending is not None:
                raise CalibrationError("This calibration has ended: start the command again for another.")
            result = self._task.handle(name, args)
            self._after_change()
        return result

    def _take(self, name: str, image: Image) -> None:
        self._newest[name].put(image)
        self._arrived.set()

    def _look(self) -> None:
        """Look at the newest picture of each camera in turn until told to stop."""
        while not self._stopping.is_set():
            self._arrived.wait(_WAIT_S)
            self._arrived.clear()
            for name in self._newest:
                image = self._newest[name].get(0.0)
                if image is not None and not self._stopping.is_set():
                    self._guarded(partial(self._look_at, image))
            self._guarded(self._report)

    def _look_at(self, image: Image) -> None:
        found = self._task.examine(image)
        with self._lock:
            if self._task.ending is not None:
                return
            self._task.look(image, found)
            self._outlet.publish_picture(image, seq=image.seq)
            self._after_change()

    def _report(self) -> None:
        """Tell of the cameras once a second."""
        now_ns = self._clock.now_ns()
        if now_ns < self._health_due_ns or not self._devices:
            return
        self._health_due_ns = now_ns + _HEALTH_NS
        sources = {name: device.health(now_ns) for name, device in self._devices.items()}
        self._outlet.publish_health(tuple(sources.values()), t_ns=now_ns)
        with self._lock:
            self._task.note_health(sources)
            self._after_change()

    def _guarded(self, step: Callable[[], None]) -> None:
        """Do one step of the looking thread; what fails is logged, and the next picture may do better."""
        try:
            step()
        except Exception:  # a thread's top
            _log.exception("looking at a picture failed")

    def _after_change(self) -> None:
        """Publish the state, start what is to be worked out, and tell the end. Under the lock."""
        job = self._task.take_job()
        if job is not None and not self._stopping.is_set():
            if self._working is not None:
                self._working.cancel()  # what has not begun is void
            with suppress(RuntimeError):  # it is being stopped at this moment
                self._working = self._worker.submit(self._work, job)
        state = self._task.state()
        if state != self._published:
            self._published = state
            self._outlet.publish_calibration(state)
        ending = self._task.ending
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
            if not self._stopping.is_set() and self._task.ending is None:
                try:
                    outcome()
                    self._after_change()
                except Exception:  # a thread's top
                    _log.exception("the outcome of a calibration's work could not be taken")
