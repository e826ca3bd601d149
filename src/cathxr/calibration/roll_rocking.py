"""The gears' play, from rocking the encoder's gear between its two stops while the catheter's gear is locked.

With the catheter's gear held, the encoder's gear turns freely within the play and no further: how far it comes is the
backlash, and the middle between the stops is where the encoder stands for the catheter's angle. Pure.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cathxr.calibration.roll_sentences import counted
from cathxr.core import CalibrationError, FloatArray

STOPS_EACH = 4
"""Stops wanted on each side: fewer say little about how well they repeat."""
WIDEST_DEG = 3.0
"""More play than any printed pair of gears has (0.3 to 0.5 degrees): the catheter was not held."""
_STROKE = 0.6
"""Share of a usual stroke that one must cover to count: a finger trembles, and turns back half-way at times."""
_NARROW_COUNTS = 3
_STEADY_COUNTS = 1.5
_STEADY_SHARE = 0.2
_OUTLIERS = 3.0
_MOST_POINTS = 20_000
_ROUNDING = 1.0 / 12.0
"""Variance of a stop that lies anywhere between two counts, as long as it is always the same stop."""


@dataclass(frozen=True)
class Play:
    """The gears' play, in encoder counts. middle: between the stops; std of each; stops: how many were used."""

    counts: float
    counts_std: float
    middle: float
    middle_std: float
    stops: int


@dataclass(frozen=True)
class RockingProgress:
    """How far it is. low, high: the range so far, counts; None before the first. stops: on the side that has fewer."""

    low: int | None
    high: int | None
    stops: int


class Rocking:
    """Collects the counts of one rocking; `play` evaluates them."""

    def __init__(self) -> None:
        self._path: list[int] = []
        self.low: int | None = None
        self.high: int | None = None

    def add(self, count: int) -> None:
        """Take the next count. Only turning points are kept, so that resting at a stop costs nothing."""
        self.low = count if self.low is None else min(self.low, count)
        self.high = count if self.high is None else max(self.high, count)
        path = self._path
        if path and path[-1] == count:
            return
        if len(path) >= 2 and (path[-1] - path[-2]) * (count - path[-1]) > 0:
            path[-1] = count
        else:
            path.append(count)
        if len(path) > _MOST_POINTS:
            del path[: _MOST_POINTS // 2]

    def progress(self) -> RockingProgress:
        """Return how far it is."""
        low, high = self._stops()
        return RockingProgress(self.low, self.high, min(len(low), len(high)))

    def play(self, *, counts_per_degree: float) -> Play:
        """Return the play. counts_per_degree: of the catheter.

        std: of the mean stops, from how well they repeat (as of a t-distribution: there are few), and of two stops
        that each lie anywhere between two counts.

        Raises:
            CalibrationError: it was not rocked, was rocked too far, or does not come to the same stops each time.
        """
        if self.low is None or self.high is None or self.low == self.high:
            raise CalibrationError("The encoder did not move: rock its gear gently to and fro, from stop to stop.")
        width_deg = (self.high - self.low) / counts_per_degree
        if width_deg > WIDEST_DEG:
            raise CalibrationError(
                f"The encoder moved by {width_deg:.1f} degrees, which is no play: lock the catheter's gear, and rock "
                "only the encoder's gear."
            )
        low, high = self._stops()
        if min(len(low), len(high)) < STOPS_EACH:
            raise CalibrationError(
                f"Rock on: the gear has come to {counted(min(len(low), len(high)), 'stop')} on one side, and "
                f"{STOPS_EACH} on each are needed."
            )
        return _play(_without_outliers(low), _without_outliers(high))

    def _stops(self) -> tuple[list[int], list[int]]:
        """Return the (low, high) stops so far: the turning points of strokes that are of the usual length.

        The first is where it began and the last may be on its way: neither is a stop.
        """
        if self.low is None or self.high is None or self.low == self.high:
            return [], []
        least = 1.0 if self.high - self.low <= _NARROW_COUNTS else 2.0  # a count at rest may flicker
        strokes = [
            abs(after - before) for (before, _), (after, _) in pairwise(_turning_points(self._path, least=least))
        ]
        if not strokes:
            return [], []
        turns = _turning_points(self._path, least=max(least, _STROKE * float(np.percentile(strokes, 75))))[1:]
        return [each for each, is_high in turns if not is_high], [each for each, is_high in turns if is_high]


def _turning_points(path: Sequence[int], *, least: float) -> list[tuple[int, bool]]:
    """Return (count, whether it is a high) of each turning point after which the path came back by `least`."""
    found: list[tuple[int, bool]] = []
    low = high = path[0]
    rising: bool | None = None
    for count in path[1:]:
        low, high = min(low, count), max(high, count)
        if rising is not False and high - count >= least:
            found.append((high, True))
            rising, low = False, count
        elif rising is not True and count - low >= least:
            found.append((low, False))
            rising, high = True, count
    return found


def _without_outliers(stops: Sequence[int]) -> FloatArray:
    """Return the stops without those that are far from the others, of which there may be few.

    Raises:
        CalibrationError: there are more.
    """
    values = np.asarray(stops, dtype=np.float64)
    off = np.abs(values - np.median(values))
    kept = values[off <= _OUTLIERS * max(1.0, 1.4826 * float(np.median(off)))]
    if len(kept) < max(STOPS_EACH - 1, 0.67 * len(values)):
        raise CalibrationError(_UNSTEADY)
    return np.asarray(kept)


def _play(low: FloatArray, high: FloatArray) -> Play:
    freedom = len(low) + len(high) - 2
    squares = float(((low - low.mean()) ** 2).sum() + ((high - high.mean()) ** 2).sum())
    counts = float(high.mean() - low.mean())
    if (squares / freedom) ** 0.5 > max(_STEADY_COUNTS, _STEADY_SHARE * counts):
        raise CalibrationError(_UNSTEADY)
    spread = squares / (freedom - 2) * (1.0 / len(low) + 1.0 / len(high))
    # Rounding that always goes the same way stays; where the stops vary by themselves, it averages out (as dither).
    dither = max(0.0, squares / freedom - _ROUNDING)
    variance = spread + 2.0 * _ROUNDING * float(np.exp(-4.0 * np.pi**2 * dither))
    middle = 0.5 * float(high.mean() + low.mean())
    return Play(counts, variance**0.5, middle, 0.5 * variance**0.5, len(low) + len(high))


_UNSTEADY = (
    "The stops were not the same each time: lock the catheter's gear so that it cannot creep, and rock again, gently."
)
