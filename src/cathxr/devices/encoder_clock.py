"""The board's clock in the host's: the line below all arrivals. Pure: instants come as arguments."""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise

_WRAP_US = 1 << 32
_BUCKET_NS = 250_000_000
_BUCKETS = 80
_SHORTEST_NS = 1_000_000_000
"""Over less than this, drift cannot be told from lateness and is smaller than it."""
_STEEPEST = 0.02
"""A ceramic resonator is within 0.5 % over its life; anything beyond 2 % is no clock."""


@dataclass(frozen=True)
class _Point:
    board_ns: int
    delay_ns: int
    """Host's instant of arrival minus board's time: a constant, plus drift, plus whatever held the line up."""


class BoardClock:
    """Turns the board's micros() into the host's monotonic clock, for one run of the board without a restart.

    A report arrives late by a varying time, never early; the board's time plus the least lateness is the best there
    is, and the two clocks drift apart by up to half a percent. So the offset is the line below all points (board's
    time, arrival minus board's time) of the last 20 s that comes closest to them: Moon, Skelly, Towsley, "Estimation
    and removal of clock skew from network delay measurements", INFOCOM 1999. The least lateness itself (USB) stays
    in: it is the rig's encoder_latency_s. micros() goes around every 71.6 minutes; with reports closer
    together than that nothing is ambiguous.
    """

    def __init__(self) -> None:
        self._last_us: int | None = None
        self._board_us = 0
        self._done: deque[_Point] = deque(maxlen=_BUCKETS)
        self._lowest: _Point | None = None
        self._bucket = 0
        self._slope = 0.0
        self._anchor: _Point | None = None

    @property
    def drift(self) -> float:
        """How much slower the board's clock runs than the host's, as a share."""
        return self._slope

    def stamp_ns(self, us: int, arrival_ns: int) -> int:
        """Return the host's instant of a report's latch plus the least lateness; at most `arrival_ns`.

        us: the report's micros(), modulo 2^32; reports come in the order in which they were latched.
        """
        self._board_us += 0 if self._last_us is None else (us - self._last_us) % _WRAP_US
        self._last_us = us
        board_ns = 1000 * self._board_us
        self._note(_Point(board_ns, arrival_ns - board_ns))
        return min(arrival_ns, board_ns + self._offset_ns(board_ns))

    def _note(self, point: _Point) -> None:
        """Keep the lowest point of every quarter of a second, and fit anew when it changes."""
        bucket = point.board_ns // _BUCKET_NS
        if self._lowest is not None and bucket != self._bucket:
            self._done.append(self._lowest)
            self._lowest = None
        self._bucket = bucket
        if self._lowest is None or point.delay_ns - self._lowest.delay_ns < self._slope * (
            point.board_ns - self._lowest.board_ns
        ):
            self._lowest = point
            self._fit([*self._done, point])

    def _offset_ns(self, board_ns: int) -> int:
        assert self._anchor is not None, "a point was noted"
        return self._anchor.delay_ns + round(self._slope * (board_ns - self._anchor.board_ns))

    def _fit(self, points: list[_Point]) -> None:
        """Take the edge of the points' lower hull that spans their mean time: the closest line below all of them."""
        if points[-1].board_ns - points[0].board_ns < _SHORTEST_NS:
            self._anchor, self._slope = min(points, key=lambda each: each.delay_ns), 0.0
            return
        hull: list[_Point] = []
        for point in points:
            while len(hull) >= 2 and _slope(hull[-2], point) <= _slope(hull[-2], hull[-1]):
                hull.pop()
            hull.append(point)
        middle = sum(each.board_ns for each in points) / len(points)
        self._anchor, self._slope = hull[-1], 0.0
        for before, after in pairwise(hull):
            if before.board_ns <= middle <= after.board_ns:
                self._anchor = after
                self._slope = max(-_STEEPEST, min(_STEEPEST, _slope(before, after)))


def _slope(before: _Point, after: _Point) -> float:
    return (after.delay_ns - before.delay_ns) / (after.board_ns - before.board_ns)
