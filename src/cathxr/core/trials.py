"""What a study is made of: participants by code, trials with their measures, answers to surveys. All of it plain values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType


class Outcome(StrEnum):
    """How a trial ended."""

    COMPLETED = "completed"
    """Every target was reached."""
    TIMED_OUT = "timed_out"
    """The time limit came first: the time to completion is censored there."""
    ABORTED = "aborted"
    """A person ended it."""
    INTERRUPTED = "interrupted"
    """The program ended under it, and it was not gone on with."""


@dataclass(frozen=True)
class Participant:
    """A person, by code only. sequence: the order of conditions that was drawn, "" before the draw.

    group: a code of a stratum such as novice or expert; "" where the study has none. joined: UTC, ISO 8601.
    """

    code: str
    sequence: str = ""
    group: str = ""
    joined: str = ""


@dataclass(frozen=True)
class TargetResult:
    """One target of a trial, in the order in which it was offered.

    reached_s: seconds of active time from the trial's start until it was reached, None when it was not. path_mm: of the
    tip while it was the target. misses: how often the tip left it again before the dwell was over.
    """

    key: str
    offered_s: float
    reached_s: float | None
    path_mm: float
    misses: int = 0


@dataclass(frozen=True)
class TrialRecord:
    """One trial: who, what, under which condition, how it ended, what was measured, and where that comes from.

    id: unique, made when the trial begins. number: 1, 2, … within participant and condition. period: 1, 2, … of the
    conditions in the participant's order; 0 for practice. began: UTC, ISO 8601. active_s: from start to end without
    pauses. measures: by the metric's key; a metric that cannot be had is absent, never 0. unseen_share: share of the
    active time without a tracked pose. invalid: why it must not count, "" when it may; set by a person or a rule stated
    before the data, never silently. session: the recording's folder; box: the station it was recorded at.
    """

    id: str
    participant: str
    task: str
    condition: str
    number: int
    period: int
    began: str
    outcome: Outcome
    active_s: float
    targets: tuple[TargetResult, ...] = ()
    measures: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    unseen_share: float = 0.0
    practice: bool = False
    invalid: str = ""
    session: str = ""
    box: str = ""
    software: str = ""

    @property
    def reached(self) -> int:
        """How many targets were reached."""
        return sum(each.reached_s is not None for each in self.targets)


@dataclass(frozen=True)
class Answer:
    """One answer of a participant to one item of a survey. value: on the item's own scale; text where it asks for words.

    occasion: when it was asked, such as "before", "after:2d"; one answer an item and occasion. answered: UTC.
    """

    participant: str
    survey: str
    item: str
    occasion: str
    answered: str
    value: float | None = None
    text: str = ""

    def __post_init__(self) -> None:
        if (self.value is None) == (self.text == ""):
            raise ValueError("Answer: expected a value or a text, and not both")
