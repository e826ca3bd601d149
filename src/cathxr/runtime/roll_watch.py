"""Tells of the roll's validity when it changes."""

from collections.abc import Callable
from threading import Lock

from cathxr.core import Clock
from cathxr.runtime.moment import Moment, RollReport, RollSource


class RollWatch:
    """Looks at a source's roll with every Moment and whenever asked, and writes a report when it has changed.

    source: None where there is no encoder to speak of; then nothing is ever written. Any thread may call.
    """

    def __init__(self, source: RollSource | None, *, clock: Clock, write: Callable[[RollReport], None]) -> None:
        self._source, self._clock, self._write = source, clock, write
        self._lock = Lock()
        self._last: RollReport | None = None
        self._predicted = False

    def note(self, moment: Moment) -> None:
        """Take note of a Moment, then look."""
        self._predicted |= moment.track.roll_predicted
        self.look()

    def look(self, *, predictions: bool = False) -> None:
        """Write a report if the status has changed, or with `predictions` if predictions have begun or ended."""
        if self._source is None:
            return
        with self._lock:
            status = self._source.roll_status(self._clock.now_ns())
            last = self._last
            changed = last is None or status != last.status or (predictions and self._predicted != last.predicted)
            if not changed:
                self._predicted &= not predictions
                return
            self._last, self._predicted = RollReport(status, self._predicted), False
            self._write(self._last)
