"""What a trial says of itself while it runs and when it has ended. Plain values."""

from dataclasses import dataclass
from enum import StrEnum

from cathxr.core.trials import Outcome, TargetResult


class Phase(StrEnum):
    """Where a trial stands."""

    WAITING = "waiting"
    RUNNING = "running"
    PAUSED = "paused"
    ENDED = "ended"


@dataclass(frozen=True)
class TrialState:
    """A trial at the last Track. target: the current one's key, None before and after.

    number: how many targets were offered so far; of: how many there will be (None in practice); reached: how many were.
    in_a_row: in practice. progress: of the dwell, 0 to 1. distance_mm, angle_deg, up_deg: see `Closeness`, None where
    nothing is seen. hindrance: why nothing can be reached just now, "" when it can. active_s, remaining_s (also of the
    current target, None without a limit of its own): at the last Track or act.
    """

    phase: Phase
    target: str | None
    number: int
    of: int | None
    reached: int
    in_a_row: int
    progress: float
    distance_mm: float | None
    angle_deg: float | None
    up_deg: float | None
    hindrance: str
    active_s: float
    remaining_s: float
    target_remaining_s: float | None
    finished: Outcome | None


@dataclass(frozen=True)
class Offer:
    """One target that was offered: instants in ns of the host's clock, active seconds and path as in `TargetResult`.

    until_ns: when it was reached, missed, or the trial ended.
    """

    result: TargetResult
    offered_ns: int
    until_ns: int

    @property
    def reached(self) -> bool:
        """Whether it was reached."""
        return self.result.reached_s is not None


@dataclass(frozen=True)
class TrialResult:
    """How a trial ended. stretches: the active stretches, (from, to) ns. unseen_share: see `TrialRecord`."""

    id: str
    outcome: Outcome
    began_ns: int
    ended_ns: int
    active_s: float
    offers: tuple[Offer, ...]
    unseen_share: float
    stretches: tuple[tuple[int, int], ...]

    @property
    def targets(self) -> tuple[TargetResult, ...]:
        """The targets in the order in which they were offered."""
        return tuple(each.result for each in self.offers)

    @property
    def reached(self) -> int:
        """How many targets were reached."""
        return sum(each.reached for each in self.offers)
