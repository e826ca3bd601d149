"""The roll at any recent instant, from encoder readings that arrive at instants of their own."""

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from statistics import median
from threading import Lock

from cathxr.core import Reading

_KEPT_NS = 2_000_000_000
_PERIOD_SAMPLES = 15
_GAP_PERIODS = 5


@dataclass(frozen=True)
class Sample:
    """A count at an instant, real-valued between the encoder's steps. predicted: beyond the last reading."""

    count: float
    predicted: bool


class History:
    """The last two seconds of readings. Safe for one thread that adds and others that ask."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._readings: deque[Reading] = deque()
        self._intervals_ns: deque[int] = deque(maxlen=_PERIOD_SAMPLES)

    def add(self, reading: Reading) -> None:
        """Append a reading. Time or sequence going back means that the board began anew: what was is forgotten."""
        with self._lock:
            if self._readings:
                last = self._readings[-1]
                if reading.t_ns <= last.t_ns or reading.seq <= last.seq:
                    self._readings.clear()
                    self._intervals_ns.clear()
                else:
                    self._intervals_ns.append((reading.t_ns - last.t_ns) // (reading.seq - last.seq))
            self._readings.append(reading)
            while reading.t_ns - self._readings[0].t_ns > _KEPT_NS:
                self._readings.popleft()

    def clear(self) -> None:
        """Forget everything: the encoder has gone, and what it counts when it returns is another count."""
        with self._lock:
            self._readings.clear()
            self._intervals_ns.clear()

    def at(self, t_ns: int) -> Sample | None:
        """Return the count at `t_ns`, None where it is unknown.

        Between two readings: linear in time, unless more than five sample periods lie between them. After the last one:
        the last two readings' line, for at most one sample period, and flagged as predicted.
        """
        with self._lock:
            readings, intervals = tuple(self._readings), tuple(self._intervals_ns)
        if not readings or t_ns < readings[0].t_ns:
            return None
        index = bisect_left(readings, t_ns, key=lambda each: each.t_ns)
        if index < len(readings) and readings[index].t_ns == t_ns:
            return Sample(float(readings[index].count), False)
        if not intervals:
            return None
        period_ns = median(intervals)
        predicted = index == len(readings)
        before, after = readings[index - 2 : index] if predicted else readings[index - 1 : index + 1]
        limit_ns = period_ns if predicted else _GAP_PERIODS * period_ns
        reach_ns = t_ns - after.t_ns if predicted else after.t_ns - before.t_ns
        if reach_ns > limit_ns or after.t_ns - before.t_ns > _GAP_PERIODS * period_ns:
            return None
        along = (t_ns - before.t_ns) / (after.t_ns - before.t_ns)
        return Sample(before.count + along * (after.count - before.count), predicted)
