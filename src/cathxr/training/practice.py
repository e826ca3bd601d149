"""Familiarisation: how long it took, and whether its criterion was met."""

import dataclasses
from dataclasses import dataclass

from cathxr.core.trials import Outcome
from cathxr.training.state import TrialResult
from cathxr.training.task import Practice, Task


@dataclass(frozen=True)
class Familiarisation:
    """A practice trial's length and outcome. longest_row: of targets reached one after another; wanted: to pass."""

    met: bool
    outcome: Outcome
    active_s: float
    offered: int
    reached: int
    longest_row: int
    wanted: int

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        how = "met" if self.met else "not met"
        return (
            f"Practice: criterion {how} after {self.active_s:.0f} s: {self.longest_row} of {self.wanted} targets in a "
            f"row, {self.reached} reached of {self.offered} offered."
        )


def familiarisation(result: TrialResult, wanted: int) -> Familiarisation:
    """Return how a practice trial went; `wanted` targets in a row were its criterion."""
    row = longest = 0
    for each in result.offers:
        row = row + 1 if each.reached else 0
        longest = max(longest, row)
    met = result.outcome is Outcome.COMPLETED
    return Familiarisation(met, result.outcome, result.active_s, len(result.offers), result.reached, longest, wanted)


def practice_of(task: Task, rule: Practice, *, target_limit_s: float) -> Task:
    """Return a task to practise on the targets of `task`."""
    return dataclasses.replace(
        task, key=f"{task.key}_practice"[:64], practice=rule, target_limit_s=target_limit_s, draw=None, step=None
    )
