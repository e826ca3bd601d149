"""What a metric is, what it is computed from, and what comes out: a number, or the reason why there is none."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from cathxr.core import FloatArray
from cathxr.training.metrics.motion import Motion, smoothed
from cathxr.training.placing import PlacedTask
from cathxr.training.state import Offer, TrialResult

MOST_UNSEEN = 0.1
"""Beyond this share of unseen time, what adds up over a trial (paths, turns, breaches) is not given."""

Depth = Callable[[FloatArray], FloatArray]
"""From points (N, 3) mm in `box` to how far (N,) mm they are outside the blood, in the wall; negative in the blood."""


@dataclass(frozen=True)
class Measure:
    """A number in the metric's unit, or None with the reason."""

    value: float | None
    reason: str = ""

    def __post_init__(self) -> None:
        if (self.value is None) == (self.reason == ""):
            raise ValueError("Measure: expected a value, or a reason why there is none")
        if self.value is not None and not np.isfinite(self.value):
            raise ValueError(f"Measure: expected a finite value, got {self.value}")


def none(reason: str) -> Measure:
    """Return the measure that there is not."""
    return Measure(None, reason)


@dataclass(frozen=True, eq=False)
class Run:
    """Everything that a trial's metrics are computed from.

    motion: as recorded (see `motion_of`). depth: None without a heart's labels. expert_box (M, 3): an expert's path of
    the tip in the same task, None without one.
    """

    result: TrialResult
    placed: PlacedTask
    motion: Motion
    depth: Depth | None = None
    expert_box: FloatArray | None = None

    @cached_property
    def smooth(self) -> Motion:
        """The motion without tremor and noise: what paths, speeds and wall breaches are taken from."""
        return smoothed(self.motion)

    @property
    def reached(self) -> tuple[Offer, ...]:
        """The targets that were reached."""
        return tuple(each for each in self.result.offers if each.reached)

    @cached_property
    def movements(self) -> tuple[Motion, ...]:
        """The motion towards each reached target, from its offer until it was reached, where it was seen throughout."""
        origin = self.result.began_ns
        parts = [
            self.smooth.between((each.offered_ns - origin) / 1e9, (each.until_ns - origin) / 1e9)
            for each in self.reached
        ]
        return tuple(each for each in parts if each.whole)

    @property
    def blind(self) -> str:
        """Why sums over the trial must not be given: too much of it was not seen; "" where they may."""
        if len(self.motion.t_s) == 0 or not self.motion.seen.any():
            return "the tip was never seen"
        share = self.result.unseen_share
        if share > MOST_UNSEEN:
            return f"the tip was not seen in {100.0 * share:.0f} % of the time, more than {100.0 * MOST_UNSEEN:.0f} %"
        return ""


@dataclass(frozen=True)
class Metric:
    """One metric of the catalogue. better: which way is better, "neither" where it depends on the task.

    formula: in words. source: where it comes from. function: from a Run to its Measure.
    """

    key: str
    name: str
    unit: str
    better: Literal["lower", "higher", "neither"]
    formula: str
    source: str
    function: Callable[[Run], Measure]
