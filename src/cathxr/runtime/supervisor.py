"""One thread for one device: opens it, reads it, hands on what comes, and brings it back when it fails.

The one retry policy: after a failure the device is closed and opened again after 0.5 s, then 1 s, 2 s, 4 s, and every
5 s from there on, for as long as the system runs. Anything that the device yields starts the policy anew. A device that
is open and yields nothing for 5 s counts as failed.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from cathxr.core import Clock, DeviceLost, EndOfStream, Health, Source
from cathxr.runtime.fanout import sentence
from cathxr.runtime.queues import Deadline

STALL_S = 5.0
_READ_TIMEOUT_S = 0.2
_RATE_WINDOW_NS = 2_000_000_000
_log = logging.getLogger(__name__)


class Numbered(Protocol):
    """Anything with a running number: a gap in it is a loss."""

    @property
    def seq(self) -> int: ...


Item = TypeVar("Item", bound=Numbered)


@dataclass(frozen=True)
class RetryPolicy:
    """How long to wait before another try: `first_s`, doubled at each failure in a row, up to `last_s`."""

    first_s: float = 0.5
    last_s: float = 5.0

    def wait_s(self, failures: int) -> float:
        """Return the wait after so many failures in a row (1 or more)."""
        return min(self.last_s, self.first_s * 2.0 ** min(failures - 1, 16))


class Meter:
    """Age, smoothed rate and losses of a stream of numbered items. Safe for several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._arrivals_ns: deque[int] = deque(maxlen=1024)
        self._last_seq: int | None = None
        self._losses = 0

    def restart(self) -> None:
        """Take the next number as a new beginning, not as a gap."""
        with self._lock:
            self._last_seq = None

    def count(self, seq: int, now_ns: int) -> None:
        """Note one item; numbers left out count as losses."""
        with self._lock:
            if self._last_seq is not None and seq > self._last_seq:
                self._losses += seq - self._last_seq - 1
            self._last_seq = seq
            self._arrivals_ns.append(now_ns)

    def health(self, now_ns: int, source: str, *, running: bool, losses: int = 0, error: str | None = None) -> Health:
        """Return the Health now; the rate is over the last two seconds. losses: others' to be added."""
        with self._lock:
            age_s = (now_ns - self._arrivals_ns[-1]) / 1e9 if self._arrivals_ns else None
            recent = [each for each in self._arrivals_ns if now_ns - each <= _RATE_WINDOW_NS]
            own_losses = self._losses
        return Health(now_ns, source, running, age_s, _rate_hz(recent, now_ns), own_losses + losses, error)


def _rate_hz(arrivals_ns: list[int], now_ns: int) -> float:
    """Return how many come a second; a stream that has paused for more than two intervals counts up to now."""
    intervals = len(arrivals_ns) - 1
    if intervals < 1 or arrivals_ns[-1] <= arrivals_ns[0]:
        return 0.0
    span_ns = arrivals_ns[-1] - arrivals_ns[0]
    paused = now_ns - arrivals_ns[-1] > 2 * span_ns / intervals
    return intervals * 1e9 / (now_ns - arrivals_ns[0] if paused else span_ns)


class DeviceThread(Generic[Item]):
    """Reads one Source in a thread of its own and gives every item to `deliver`, which never blocks.

    lost: called when the device has failed, before the next try. A device that cannot be closed in time is left to its
    thread, which ends with the program.
    """

    def __init__(
        self,
        name: str,
        source: Source[Item],
        deliver: Callable[[Item], object],
        *,
        clock: Clock,
        policy: RetryPolicy | None = None,
        lost: Callable[[], object] | None = None,
    ) -> None:
        self.name = name
        self._source = source
        self._deliver = deliver
        self._clock = clock
        self._policy = policy or RetryPolicy()
        self._lost = lost
        self._meter = Meter()
        self._stopping = threading.Event()
        self._ended = threading.Event()
        self._open = False
        self._error: str | None = None
        self._thread = threading.Thread(target=self._run, name=f"device-{name}", daemon=True)

    def start(self) -> None:
        """Begin; the device is opened in the thread, so that a slow or missing one holds nobody up."""
        self._thread.start()

    def ask_to_stop(self) -> None:
        """Have the thread close the device and end."""
        self._stopping.set()

    def join(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came."""
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    @property
    def ended(self) -> bool:
        """Whether the source has given all it has."""
        return self._ended.is_set()

    def health(self, now_ns: int, *, losses: int = 0) -> Health:
        """Return the device's Health; while it runs, what its driver warns of stands in place of an error."""
        error = self._error
        if error is None:
            error = " ".join(getattr(self._source, "warnings", ())) or None
        return self._meter.health(now_ns, self.name, running=self._open, losses=losses, error=error)

    def _run(self) -> None:
        failures = 0
        while not self._stopping.is_set():
            try:
                with self._source as source:
                    self._open = True
                    self._meter.restart()
                    stall = Deadline(STALL_S)
                    while not self._stopping.is_set():
                        item = source.read(_READ_TIMEOUT_S)
                        if item is not None:
                            failures, self._error, stall = 0, None, Deadline(STALL_S)
                            self._meter.count(item.seq, self._clock.now_ns())
                            self._deliver(item)
                        elif stall.left_s == 0.0:
                            raise DeviceLost(f"The {self.name} has sent nothing for {STALL_S:g} s: check its cable.")
            except EndOfStream:
                self._open = False
                self._ended.set()
                return
            except Exception as error:  # a thread's top: stored, shown in Health, and tried again by the policy
                failures += 1
                self._open = False
                self._error = sentence(error)
                _log.warning("%s failed (%d in a row): %s", self.name, failures, self._error)
                if self._lost is not None:
                    self._lost()
                self._stopping.wait(self._policy.wait_s(failures))
            finally:
                self._open = False
