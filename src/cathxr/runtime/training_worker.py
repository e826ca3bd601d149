"""A thread that does one job after another: files and stores are touched there, never where Tracks come by."""

import logging
import threading
from collections.abc import Callable

from cathxr.runtime.queues import Queue

Job = Callable[[], object]
_WAIT_S = 0.25
_MOST_WAITING = 256
_log = logging.getLogger(__name__)


class Worker:
    """Does jobs in their order, in a thread of its own, from `start` to `close`.

    idle: called between jobs, about four times a second. A job that fails is logged, and the next one is done.
    """

    def __init__(self, name: str, *, idle: Job | None = None) -> None:
        self._jobs: Queue[Job] = Queue(_MOST_WAITING, keep_oldest=True)
        self._idle = idle
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def do(self, job: Job) -> bool:
        """Have a job done; return whether it was taken. Never blocks."""
        return self._jobs.put(job)

    def asked(self, job: Job, timeout_s: float) -> bool:
        """Have a job done and wait for its end; return whether it came in time."""
        done = threading.Event()

        def run() -> None:
            try:
                job()
            finally:
                done.set()

        return self.do(run) and done.wait(timeout_s)

    def close(self, timeout_s: float) -> bool:
        """Do what waits and end; return whether that was done in time."""
        self._jobs.close()
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while not self._jobs.finished:
            job = self._jobs.get(_WAIT_S)
            try:
                if job is not None:
                    job()
                elif self._idle is not None:
                    self._idle()
            except Exception:  # a thread's top: what a job must tell, it tells itself
                _log.exception("a job of %s failed", self._thread.name)
