"""Devices that give something at even instants of a clock: what is due, when, and what was missed."""

import numpy as np

from cathxr.core import Clock, DeviceError

NS = 1_000_000_000


class Timed:
    """Something that comes due at even instants of a clock; whoever comes late gets the newest and the rest is lost."""

    def __init__(self, clock: Clock, *, origin_ns: int, rate_hz: float, ready_ns: int) -> None:
        self.losses = 0
        self._clock, self._origin_ns, self._rate_hz, self._ready_ns = clock, origin_ns, rate_hz, ready_ns
        self._first: int | None = None
        self._next = 0

    def start(self) -> None:
        """Begin with the first instant that is still to come."""
        self._first = self._next = self._newest() + 1

    def stop(self) -> None:
        """Be closed."""
        self._first = None

    def due(self, deadline_ns: int) -> tuple[int, int] | None:
        """Return seq and instant of what comes due next, waiting until the deadline; None when nothing does.

        Raises:
            DeviceError: it is not open.
        """
        if self._first is None:
            raise not_open()
        newest = self._newest()
        if newest > self._next:
            self.losses += newest - self._next
            self._next = newest
        ready_ns = self.instant_ns(self._next) + self._ready_ns
        if ready_ns > deadline_ns:
            self._clock.wait_until_ns(deadline_ns)
            return None
        self._clock.wait_until_ns(ready_ns)
        index, self._next = self._next, self._next + 1
        return index - self._first, self.instant_ns(index)

    def instant_ns(self, index: int) -> int:
        """Return the instant that an index stands for."""
        return self._origin_ns + round(index * NS / self._rate_hz)

    def _newest(self) -> int:
        past_ns = self._clock.now_ns() - self._ready_ns
        newest = int(np.floor((past_ns - self._origin_ns) * self._rate_hz / NS))
        # Instants are whole nanoseconds: one that was rounded down may be a hair nearer than even spacing says.
        return newest + 1 if self.instant_ns(newest + 1) <= past_ns else newest


def not_open() -> DeviceError:
    """Return the error of a device that is read before it is opened."""
    return DeviceError("The simulated device is read before it is opened: use it in a with statement.")
