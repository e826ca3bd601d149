"""The curve expected from the last ones, and where on it each measured point is: the fit's start while tracking."""

from collections.abc import Sequence

import numpy as np

from cathxr.core import Detection, FloatArray
from cathxr.geometry.curve_kernels import carry_on, resample
from cathxr.tracking.fit import Guess, guess_of
from cathxr.tracking.guess_kernels import place
from cathxr.tracking.pair_work import LINE_POINTS, PairWork

_OLDEST_NS = 250_000_000
_STEADY_NS = 100_000_000
_FARTHEST_MM = 8.0


class Prediction:
    """Remembers the last two fitted curves and carries their motion on.

    Three curves' memory goes round: what is learned takes the place of the third, so that a copy of this object made
    before holds what it held.
    """

    def __init__(self) -> None:
        self._rooms = tuple(np.zeros((LINE_POINTS, 3)) for _ in range(3))
        self._times: tuple[int | None, int | None] = (None, None)
        self._expected = np.zeros((LINE_POINTS, 3))

    def reset(self) -> None:
        """Forget what came before."""
        self._times = (None, None)

    def learn(self, t_ns: int, curve: FloatArray) -> None:
        """Take over a fitted curve (N, 3) mm, the rounded end's centre first, the entry last."""
        last, before, spare = self._rooms
        resample(np.ascontiguousarray(curve), spare)
        self._rooms = (spare, last, before)
        self._times = (t_ns, self._times[0])

    def guess(self, t_ns: int, table: FloatArray, detections: Sequence[Detection], work: PairWork) -> Guess | None:
        """Return the start of the fit at an instant; None where nothing recent is known or it fits nothing.

        table: the cameras' numbers, see `fit.camera_table`; work: holds what the detections measured.
        """
        if not self._expect(t_ns):
            return None
        end, first = 0.0, 0
        for view, each in enumerate(detections):
            stop = first + len(each.curve_px)
            furthest = place(table[view], self._expected, (first, stop), work.arrays)
            if furthest < 0.0:
                return None
            end, first = max(end, furthest), stop
        last = int(np.ceil(end * (LINE_POINTS - 1)))
        if last < 3:
            return None
        at = work.arrays.at[: work.points]
        at[at > 0.0] *= (LINE_POINTS - 1) / last
        return guess_of(self._expected[: last + 1], at, work)

    def _expect(self, t_ns: int) -> bool:
        """Set the curve expected at an instant; return whether there is one."""
        (then, earlier), (last, before, _) = self._times, self._rooms
        if then is None or not 0 <= t_ns - then <= _OLDEST_NS:
            return False
        ahead = 0.0
        if earlier is not None and 0 < then - earlier <= _STEADY_NS:
            ahead = (t_ns - then) / (then - earlier)
        carry_on(last, before, ahead, _FARTHEST_MM, self._expected)
        return True
