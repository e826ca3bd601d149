"""Which two pictures belong together: pure logic over time stamps, without threads and without a clock.

Rules, in order:

1. Two pictures pair when their mid-exposures are at most 0.6 of a frame period apart. The period is the shorter of the
   two cameras', measured from their stamps and running numbers, so that pictures lost on the way do not lengthen it
   (the median of the last 15 intervals; the nominal one before that).
2. Among the pictures that could pair, the nearest wins. A pair waits only while a nearer picture could still come.
3. Two free-running cameras drift through half a period of skew, where jitter alone decides which neighbour is nearer.
   A nearer picture on the other side of the established skew must therefore be nearer by 0.2 of a period: it is 0.4
   instead of 0.6. Without this rule pictures would be lost at every turn; with it one is, once.
4. A picture whose partner does not come within 0.25 s (or 2.5 periods of a slow camera) goes alone, named for what is
   missing. While a camera is silent, the other's newest picture goes at once.
5. When nothing at all goes out for half a second, an empty pair says so, so that nobody takes old for present.

Every picture is used at most once, and what goes out is strictly increasing in time.
"""

from collections import deque
from dataclasses import dataclass, field
from statistics import median
from typing import Generic, Protocol, TypeVar

TOLERANCE_PERIODS = 0.6
STICKINESS_PERIODS = 0.2
JITTER_PERIODS = 0.1
"""How much earlier than one period after the last a picture may be stamped."""
MAX_WAIT_NS = 250_000_000
SILENCE_NS = 500_000_000
_WAIT_PERIODS = 2.5
_PERIOD_SAMPLES = 15
_PENDING_BOUND = 32


class Stamped(Protocol):
    """Anything with an instant and a running number."""

    @property
    def t_ns(self) -> int: ...

    @property
    def seq(self) -> int: ...


Item = TypeVar("Item", bound=Stamped)


@dataclass(frozen=True)
class Pair(Generic[Item]):
    """Two pictures of one instant, or what there is of them. `t_ns`: the first camera's instant where it has one."""

    t_ns: int
    first: Item | None
    second: Item | None

    @property
    def skew_ns(self) -> int | None:
        """The second's instant minus the first's, None for an incomplete pair."""
        return None if self.first is None or self.second is None else self.second.t_ns - self.first.t_ns


@dataclass
class _Stream(Generic[Item]):
    """One camera's pictures that still wait, with their arrivals, and what its stamps tell."""

    period_ns: float
    pending: deque[tuple[Item, int]] = field(default_factory=deque)
    intervals_ns: deque[int] = field(default_factory=lambda: deque(maxlen=_PERIOD_SAMPLES))
    last: Item | None = None
    last_arrival_ns: int | None = None
    delay_ns: int = 0
    unpaired: int = 0

    def add(self, item: Item, now_ns: int) -> None:
        """Append a picture and measure the period anew."""
        if self.last is not None and item.seq > self.last.seq:
            self.intervals_ns.append((item.t_ns - self.last.t_ns) // (item.seq - self.last.seq))
            if len(self.intervals_ns) == _PERIOD_SAMPLES:
                self.period_ns = float(median(self.intervals_ns))
        self.last, self.delay_ns = item, now_ns - item.t_ns
        self.pending.append((item, now_ns))

    def take(self) -> Item:
        return self.pending.popleft()[0]

    def discard(self) -> None:
        self.pending.popleft()
        self.unpaired += 1


class Pairer(Generic[Item]):
    """Pairs two streams of stamped items. Not safe for several threads; whoever tracks owns it."""

    def __init__(self, first_period_ns: int, second_period_ns: int) -> None:
        if min(first_period_ns, second_period_ns) <= 0:
            raise ValueError(f"period: expected positive ones, got {first_period_ns} and {second_period_ns} ns")
        self._streams: tuple[_Stream[Item], _Stream[Item]] = (_Stream(first_period_ns), _Stream(second_period_ns))
        self._skew_ns: int | None = None
        self._last_t_ns: int | None = None
        self._last_out_ns: int | None = None
        self._started_ns: int | None = None

    @property
    def unpaired(self) -> tuple[int, int]:
        """How many of each camera's pictures went unused so far."""
        return self._streams[0].unpaired, self._streams[1].unpaired

    @property
    def period_ns(self) -> float:
        """The shorter of the two frame periods."""
        return min(each.period_ns for each in self._streams)

    @property
    def max_wait_ns(self) -> float:
        """The longest that a picture waits for its partner."""
        return max(float(MAX_WAIT_NS), _WAIT_PERIODS * max(each.period_ns for each in self._streams))

    def offer(self, camera: int, item: Item, now_ns: int) -> list[Pair[Item]]:
        """Return the pairs that are ready after one more picture. camera: 0 or 1; now_ns: when it arrived."""
        stream = self._streams[camera]
        stream.last_arrival_ns = now_ns
        last = stream.last
        backwards = last is not None and item.t_ns <= last.t_ns
        if backwards or item.t_ns > now_ns + MAX_WAIT_NS:
            stream.unpaired += 1  # a stamp that goes back or lies in the future is of no use to anyone
            return self.poll(now_ns)
        stream.add(item, now_ns)
        if len(stream.pending) > _PENDING_BOUND:
            stream.discard()
        return self.poll(now_ns)

    def poll(self, now_ns: int) -> list[Pair[Item]]:
        """Return the pairs that are ready at `now_ns`."""
        if self._started_ns is None:
            self._started_ns = now_ns
        found: list[Pair[Item]] = []
        while self._step(now_ns, found):
            pass
        quiet_since = self._last_out_ns if self._last_out_ns is not None else self._started_ns
        if not found and now_ns - quiet_since >= SILENCE_NS:
            self._emit(Pair(now_ns, None, None), now_ns, found)
        return found

    def next_poll_ns(self) -> int | None:
        """Return when `poll` could next have something without another picture; None before the first poll."""
        if self._started_ns is None:
            return None
        times = [float((self._last_out_ns if self._last_out_ns is not None else self._started_ns) + SILENCE_NS)]
        first, second = self._streams
        if first.pending and second.pending:
            times.append(self._better_until_ns())
        elif first.pending or second.pending:
            times.append((first.pending or second.pending)[0][1] + self.max_wait_ns)
        return int(max(0.0, min(times))) + 1

    def flush(self) -> list[Pair[Item]]:
        """Return the pairs that wait for something better, when nothing more will come."""
        found: list[Pair[Item]] = []
        while self._streams[0].pending and self._streams[1].pending:
            self._step(None, found)
        for stream in self._streams:
            while stream.pending:
                stream.discard()
        return found

    def _step(self, now_ns: int | None, found: list[Pair[Item]]) -> bool:
        """Do one thing to the streams' heads; return whether another may follow. now_ns None: no more will come."""
        first, second = self._streams
        if not (first.pending and second.pending):
            return now_ns is not None and self._alone(now_ns, found)
        skew = second.pending[0][0].t_ns - first.pending[0][0].t_ns
        early, late = (first, second) if skew >= 0 else (second, first)
        if abs(skew) > TOLERANCE_PERIODS * self.period_ns:
            early.discard()
            return True
        if len(early.pending) > 1:
            rival = abs(early.pending[1][0].t_ns - late.pending[0][0].t_ns)
            if rival < abs(skew) - self._stickiness_ns(skew):
                early.discard()
                return True
        elif now_ns is not None and now_ns < self._better_until_ns():
            return False
        self._skew_ns = skew
        one, other = first.take(), second.take()
        self._emit(Pair(one.t_ns, one, other), now_ns, found)
        return True

    def _better_until_ns(self) -> float:
        """Return until when a nearer partner for the later of the two heads may still arrive; long past: none can."""
        first, second = self._streams
        skew = second.pending[0][0].t_ns - first.pending[0][0].t_ns
        early, late = (first, second) if skew >= 0 else (second, first)
        nearer_ns = abs(skew) - self._stickiness_ns(skew)
        due_ns = early.pending[0][0].t_ns + (1.0 - JITTER_PERIODS) * early.period_ns
        last_useful_ns = late.pending[0][0].t_ns + nearer_ns
        if len(early.pending) > 1 or due_ns >= last_useful_ns:
            return float("-inf")
        return min(
            last_useful_ns + max(0, early.delay_ns) + 0.5 * self.period_ns, late.pending[0][1] + self.max_wait_ns
        )

    def _stickiness_ns(self, skew: int) -> float:
        """Return by how much a rival must be nearer than a pair of this skew."""
        same_side = self._skew_ns is not None and (skew >= 0) == (self._skew_ns >= 0)
        return STICKINESS_PERIODS * self.period_ns if same_side else 0.0

    def _alone(self, now_ns: int, found: list[Pair[Item]]) -> bool:
        """Send a picture alone whose partner does not come. Return whether there may be more to do."""
        first, second = self._streams
        own, other = (first, second) if first.pending else (second, first)
        if not own.pending:
            return False
        heard_ns = other.last_arrival_ns if other.last_arrival_ns is not None else self._started_ns
        silent = heard_ns is not None and now_ns - heard_ns >= self.max_wait_ns
        if not silent and now_ns - own.pending[0][1] < self.max_wait_ns:
            return False
        while silent and len(own.pending) > 1:
            own.discard()
        item = own.take()
        self._emit(Pair(item.t_ns, item if own is first else None, item if own is second else None), now_ns, found)
        return bool(own.pending)

    def _emit(self, pair: Pair[Item], now_ns: int | None, found: list[Pair[Item]]) -> None:
        """Append a pair unless it would go back in time."""
        if now_ns is not None:
            self._last_out_ns = now_ns
        if self._last_t_ns is not None and pair.t_ns <= self._last_t_ns:
            for stream, item in zip(self._streams, (pair.first, pair.second), strict=True):
                stream.unpaired += item is not None
            return
        self._last_t_ns = pair.t_ns
        found.append(pair)
