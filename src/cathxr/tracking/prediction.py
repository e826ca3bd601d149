"""The curve expected from the last ones, and where on it each measured point is: the fit's start while tracking."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import Detection, FloatArray
from cathxr.geometry.curve_kernels import carry_on, resample
from cathxr.tracking.fit import Guess, guess_of
from cathxr.tracking.guess_kernels import place
from cathxr.tracking.pair_work import LINE_POINTS, PairWork
from cathxr.tracking.skew import SKEW_NS, at_instant, motion, shift_view

_OLDEST_NS = 250_000_000
_STEADY_NS = 100_000_000
_FARTHEST_MM = 8.0


@dataclass(frozen=True)
class Shutter:
    """When a picture's rows are open. middle_row: of the picture's instant; row_s: from a row to the next, 0 global."""

    middle_row: float = 0.0
    row_s: float = 0.0

    def late_ns(self, row: float) -> int:
        """Return how much later than the picture's instant a row's is, ns."""
        return round(1e9 * self.row_s * (row - self.middle_row))


_Times = tuple[int, ...]
"""When the pair was, and when each of its views was; empty for none."""


class Prediction:
    """Remembers the last two fitted curves and carries their motion on.

    A curve is kept as it is at the pair's instant and as it is at each view's own. Three curves' memory goes round:
    what is learned takes the place of the third, so that a copy of this object made before holds what it held.
    """

    def __init__(self, shutters: Sequence[Shutter] = (Shutter(), Shutter())) -> None:
        """Take each view's shutter."""
        views = len(shutters)
        self._shutters = tuple(shutters)
        self._rolling = any(each.row_s for each in shutters)
        self._speed = np.zeros((LINE_POINTS, 3))
        self._rooms = tuple(np.zeros((1 + views, LINE_POINTS, 3)) for _ in range(3))
        self._times: tuple[_Times, _Times] = ((), ())
        self._expected = np.zeros((1 + views, LINE_POINTS, 3))
        self._shift = np.zeros((views, LINE_POINTS, 3))

    def reset(self) -> None:
        """Forget what came before."""
        self._times = ((), ())

    def learn(self, t_ns: int, curve: FloatArray, detections: Sequence[Detection]) -> None:
        """Take over the curve (N, 3) mm fitted to what the views measured: rounded end's centre first, entry last."""
        last, before, spare = self._rooms
        resample(np.ascontiguousarray(curve), spare[0])
        for view, each in enumerate(detections):
            spare[1 + view] = spare[0]
            if _skewed(each, t_ns):
                spare[1 + view] += self._shift[view]
        self._rooms = (spare, last, before)
        self._times = ((t_ns, *(each.t_ns for each in detections)), self._times[0])

    def guess(self, t_ns: int, table: FloatArray, detections: Sequence[Detection], work: PairWork) -> Guess | None:
        """Return the start of the fit at an instant; None where nothing recent is known or it fits nothing.

        table: the cameras' numbers, see `fit.camera_table`; work: holds what the detections measured. What a view
        measured at another instant is moved to this one.
        """
        self._shift[:] = 0.0
        if not self._expect(0, t_ns):
            return None
        if self._rolling:
            self._move(t_ns, self._expected[0])
        for view, each in enumerate(detections):
            if _skewed(each, t_ns):
                if not self._expect(1 + view, each.t_ns):
                    return None
                self._shift[view] = self._expected[1 + view] - self._expected[0]
        return self._placed(t_ns, table, detections, work)

    def expected(self, t_ns: int) -> FloatArray | None:
        """Return the curve (K, 3) mm expected at an instant, cap's centre first; None where nothing recent is known.

        The array is the next one's.
        """
        return self._expected[0] if self._expect(0, t_ns) else None

    def again(
        self, t_ns: int, curve: FloatArray, table: FloatArray, detections: Sequence[Detection], work: PairWork
    ) -> Guess | None:
        """Return the start of another fit, now that the curve of the instant is known: its motion is known better.

        curve (N, 3) mm: the rounded end's centre first, the entry last; the rest: see `guess`.
        """
        resample(np.ascontiguousarray(curve), self._expected[0])
        last, before, _ = self._rooms
        if self._rolling:
            self._move(t_ns, self._expected[0])
        for view, each in enumerate(detections):
            if _skewed(each, t_ns):
                then, earlier = self._since(1 + view, each.t_ns)
                late = 1e-9 * (each.t_ns - t_ns)
                times = (late, then + late if then else 0.0, earlier + late if earlier else 0.0)
                seen = self._expected[1 + view]
                seen[:] = self._expected[0] + self._shift[view]
                at_instant(seen, last[1 + view], before[1 + view], times, self._shift[view])
                self._shift[view] = seen - self._shift[view]
        return self._placed(t_ns, table, detections, work)

    def tip_motion(self, t_ns: int, tip: FloatArray) -> tuple[float, float | None]:
        """Return (speed, its change since the last pair), mm/s, of a rounded end's centre (3,) mm at an instant.

        The speed is 0 and the change None where nothing recent is known of them.
        """
        then, earlier = self._since(0, t_ns)
        if then == 0.0:
            return 0.0, None
        last, before, _ = self._rooms
        velocity = (last[0, 0] - tip) / then
        speed = float(np.sqrt(velocity @ velocity))
        if earlier == 0.0:
            return speed, None
        change = velocity - (before[0, 0] - last[0, 0]) / (earlier - then)
        return speed, float(np.sqrt(change @ change))

    def _move(self, t_ns: int, curve: FloatArray) -> None:
        """Set how a curve (K, 3) mm moves at an instant, by what came before; at rest where nothing recent is known."""
        last, before, _ = self._rooms
        motion(curve, last[0], before[0], self._since(0, t_ns), self._speed)

    def _since(self, which: int, t_ns: int) -> tuple[float, float]:
        """Return when the last two curves were, s from an instant and negative; 0 for what is too long ago.

        which: 0 of the pair, 1 + v of view v.
        """
        last, before = self._times
        if not last or not 0 < t_ns - last[which] <= _STEADY_NS:
            return 0.0, 0.0
        if not before or not 0 < last[which] - before[which] <= _STEADY_NS:
            return 1e-9 * (last[which] - t_ns), 0.0
        return 1e-9 * (last[which] - t_ns), 1e-9 * (before[which] - t_ns)

    def _placed(self, t_ns: int, table: FloatArray, detections: Sequence[Detection], work: PairWork) -> Guess | None:
        """Return the start of a fit at the curve expected."""
        end, first, begin = 0.0, 0, 0
        here = self._expected[0]
        for view, each in enumerate(detections):
            stop, until = first + len(each.curve_px), begin + len(each.end_px)
            skewed = _skewed(each, t_ns)
            there = self._expected[1 + view] if skewed else here
            furthest = place(table[view], there, (first, stop), work.arrays)
            if furthest < 0.0:
                return None
            shutter = self._shutters[view]
            if skewed or shutter.row_s:
                rows = shutter.middle_row, shutter.row_s
                parts = (first, stop), (begin, until)
                shift_view(table[view], self._shift[view], self._speed, rows, there, *parts, work.arrays)
            end, first, begin = max(end, furthest), stop, until
        last = int(np.ceil(end * (LINE_POINTS - 1)))
        if last < 3:
            return None
        at = work.arrays.at[: work.points]
        at[at > 0.0] *= (LINE_POINTS - 1) / last
        return guess_of(here[: last + 1], at, work)

    def _expect(self, which: int, t_ns: int) -> bool:
        """Set the curve expected at an instant, of the pair (0) or of view v (1 + v); return whether there is one."""
        (times, earlier), (last, before, _) = self._times, self._rooms
        if not times or not 0 <= t_ns - times[which] <= _OLDEST_NS:
            return False
        ahead = 0.0
        if earlier and 0 < times[which] - earlier[which] <= _STEADY_NS:
            ahead = (t_ns - times[which]) / (times[which] - earlier[which])
        carry_on(last[which], before[which], ahead, _FARTHEST_MM, self._expected[which])
        return True


def _skewed(detection: Detection, t_ns: int) -> bool:
    return abs(detection.t_ns - t_ns) > SKEW_NS
