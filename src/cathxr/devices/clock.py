"""Clocks: the host's monotonic one, and one that a person or a test moves by hand."""

import threading
import time


class MonotonicClock:
    """The host's monotonic clock: never set back, unrelated to the time of day."""

    def now_ns(self) -> int:
        """Return nanoseconds since an arbitrary start that is the same for all processes of this host."""
        return time.monotonic_ns()

    def wait_until_ns(self, t_ns: int) -> None:
        """Return at `t_ns`, or at once when that has passed."""
        while (left_ns := t_ns - time.monotonic_ns()) > 0:
            time.sleep(left_ns * 1e-9)


class ManualClock:
    """A clock for offline work and tests: waiting for an instant makes it that instant. Never goes back."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns
        self._lock = threading.Lock()

    def now_ns(self) -> int:
        """Return the instant it stands at."""
        with self._lock:
            return self._now_ns

    def wait_until_ns(self, t_ns: int) -> None:
        """Move to `t_ns`, or stay when that has passed."""
        with self._lock:
            self._now_ns = max(self._now_ns, t_ns)

    def advance_ns(self, duration_ns: int) -> None:
        """Move on by a duration.

        Raises:
            ValueError: the duration is negative.
        """
        if duration_ns < 0:
            raise ValueError(f"duration_ns: expected at least 0, got {duration_ns}")
        with self._lock:
            self._now_ns += duration_ns
