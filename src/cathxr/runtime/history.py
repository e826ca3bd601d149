"""The count at any recent instant, from encoder readings that arrive at instants of their own."""

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from statistics import median
from threading import Lock
from typing import Protocol

from cathxr.core import Reading
from cathxr.devices.encoder_stream import SAME_RUN

_KEPT_NS = 2_000_000_000
_PERIOD_SAMPLES = 15
_GAP_PERIODS = 5


class Corrector(Protocol):
    """Corrects each reading's count by what went before: geometry's RollFollower takes out the play of the gears."""

    def corrected(self, count: float) -> float: ...

    def reset(self) -> None: ...


@dataclass(frozen=True)
class Sample:
    """A count at an instant, corrected, real-valued between the encoder's steps.

    predicted: beyond the last reading. flags: of all readings that it was made from.
    """

    count: float
    predicted: bool
    flags: int = 0


@dataclass(frozen=True)
class _Entry:
    """A reading, with what is to be added to its count."""

    reading: Reading
    offset: float = 0.0

    @property
    def t_ns(self) -> int:
        return self.reading.t_ns


class History:
    """The last two seconds of readings. Safe for one thread that adds and others that ask.

    corrector: is given every reading's count in order, and reset wherever the count does not go on: readings whose
    flags tell of another run of the board (encoder_stream.SAME_RUN), or whose time or number goes back. Across such a
    break nothing is interpolated or predicted.
    """

    def __init__(self, corrector: Corrector | None = None) -> None:
        self._lock = Lock()
        self._corrector = corrector
        self._entries: deque[_Entry] = deque()
        self._intervals_ns: deque[int] = deque(maxlen=_PERIOD_SAMPLES)

    def add(self, reading: Reading) -> None:
        """Append a reading. Time or sequence going back means that the board began anew: what was is forgotten."""
        with self._lock:
            if self._entries:
                last = self._entries[-1].reading
                if reading.t_ns <= last.t_ns or reading.seq <= last.seq:
                    self._forget()
                else:
                    self._intervals_ns.append((reading.t_ns - last.t_ns) // (reading.seq - last.seq))
                    if self._corrector is not None and not _goes_on(last, reading):
                        self._corrector.reset()
            offset = 0.0 if self._corrector is None else self._corrector.corrected(reading.count) - reading.count
            self._entries.append(_Entry(reading, offset))
            while reading.t_ns - self._entries[0].t_ns > _KEPT_NS:
                self._entries.popleft()

    def clear(self) -> None:
        """Forget everything: the encoder has gone, and what it counts when it returns is another count."""
        with self._lock:
            self._forget()

    @property
    def newest(self) -> Reading | None:
        """The reading that came last; None where all is forgotten."""
        with self._lock:
            return self._entries[-1].reading if self._entries else None

    def at(self, t_ns: int) -> Sample | None:
        """Return the count at `t_ns`, None where it is unknown.

        Between two readings: linear in time, unless more than five sample periods lie between them. After the last one:
        the last two readings' line, for at most one sample period, and flagged as predicted. Never across a restart.
        """
        with self._lock:
            entries, intervals = tuple(self._entries), tuple(self._intervals_ns)
        if not entries or t_ns < entries[0].t_ns:
            return None
        index = bisect_left(entries, t_ns, key=lambda each: each.t_ns)
        if index < len(entries) and entries[index].t_ns == t_ns:
            exact = entries[index]
            return Sample(exact.reading.count + exact.offset, False, exact.reading.flags)
        predicted = index == len(entries)
        if not intervals or (predicted and index < 2):
            return None
        before, after = entries[index - 2 : index] if predicted else entries[index - 1 : index + 1]
        span_ns, period_ns = after.t_ns - before.t_ns, median(intervals)
        late = predicted and t_ns - after.t_ns > period_ns
        if late or span_ns > _GAP_PERIODS * period_ns or not _goes_on(before.reading, after.reading):
            return None
        along = (t_ns - before.t_ns) / span_ns
        count = before.reading.count + along * (after.reading.count - before.reading.count)
        # Which side of the play the gears touch on is known up to the last reading, and not carried on.
        offset = before.offset + min(along, 1.0) * (after.offset - before.offset)
        return Sample(count + offset, predicted, before.reading.flags | after.reading.flags)

    def _forget(self) -> None:
        self._entries.clear()
        self._intervals_ns.clear()
        if self._corrector is not None:
            self._corrector.reset()


def _goes_on(before: Reading, after: Reading) -> bool:
    """Return whether the count of a reading goes on from that of one before it."""
    return not (before.flags ^ after.flags) & SAME_RUN
