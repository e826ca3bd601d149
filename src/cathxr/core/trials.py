"""What a study is made of: participants by code, trials with their measures, answers to surveys. Plain values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from cathxr.core.participant_code import participant_code_fault


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
    """A person, by code only (`participant_code_fault`).

    sequence: the order of conditions that was drawn, their keys joined by > as in "2d>3d", "" before the draw. group: a
    code of a stratum such as novice or expert; "" where the study has none. joined: UTC, ISO 8601.
    """

    code: str
    sequence: str = ""
    group: str = ""
    joined: str = ""

    def __post_init__(self) -> None:
        _check_code("Participant", self.code)

    @property
    def conditions(self) -> tuple[str, ...]:
        """The conditions in this participant's order; empty before the draw."""
        return tuple(self.sequence.split(">")) if self.sequence else ()


@dataclass(frozen=True)
class Draw:
    """One draw of a sequence. number: 1, 2, … within the group; participant: "" once deleted; drawn: UTC."""

    group: str
    number: int
    sequence: str
    participant: str
    drawn: str


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

    def __post_init__(self) -> None:
        reached_s = 0.0 if self.reached_s is None else self.reached_s
        # NaN fails every comparison; stores check many thousands of these
        if not (0 <= self.offered_s < math.inf and 0 <= self.path_mm < math.inf and 0 <= reached_s < math.inf):
            times = (self.offered_s, self.reached_s, self.path_mm)
            raise ValueError(f"TargetResult {self.key}: expected finite numbers of at least 0, got {times}")
        if self.misses < 0:
            raise ValueError(f"TargetResult {self.key}: expected misses of at least 0, got {self.misses}")


@dataclass(frozen=True)
class TrialStart:
    """A trial that has begun and of which no end is known: kept, so that a crash does not make it vanish.

    The fields are those of the TrialRecord that it becomes.
    """

    id: str
    participant: str
    task: str
    condition: str
    number: int
    period: int
    began: str
    practice: bool = False
    session: str = ""
    box: str = ""
    software: str = ""
    task_sha256: str = ""

    def __post_init__(self) -> None:
        _check_code("TrialStart", self.participant)
        _check_counts(self.id, self.number, self.period)


@dataclass(frozen=True)
class TrialRecord:
    """One trial: who, what, under which condition, how it ended, what was measured, and where that comes from.

    id: unique, made when the trial begins. number: 1, 2, … within participant and condition. period: 1, 2, … of the
    conditions in the participant's order; 0 for practice. began: UTC, ISO 8601. active_s: from start to end without
    pauses. measures: by the metric's key; a metric that cannot be had is absent, never 0. unseen_share: share of the
    active time without a tracked pose. invalid: why it must not count, "" when it may; set by a person or a rule stated
    before the data, never silently. session: the recording's folder, below the folder of all recordings; box: the
    station it was recorded at. task_sha256: digest of the task file's text, since a task may change and keep its key.
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
    task_sha256: str = ""

    def __post_init__(self) -> None:
        _check_code("TrialRecord", self.participant)
        _check_counts(self.id, self.number, self.period)
        if not (math.isfinite(self.active_s) and self.active_s >= 0 and 0 <= self.unseen_share <= 1):
            raise ValueError(
                f"TrialRecord {self.id}: expected active_s of at least 0 and unseen_share from 0 to 1, got "
                f"{self.active_s} and {self.unseen_share}"
            )
        if not all(map(math.isfinite, self.measures.values())):
            odd = next(key for key, value in self.measures.items() if not math.isfinite(value))
            raise ValueError(
                f"TrialRecord {self.id}: expected a finite {odd}, got {self.measures[odd]}; leave out what is not there"
            )
        object.__setattr__(self, "measures", MappingProxyType(dict(self.measures)))

    @property
    def reached(self) -> int:
        """How many targets were reached."""
        return sum(each.reached_s is not None for each in self.targets)


@dataclass(frozen=True)
class Answer:
    """One answer of a participant to an item of a survey. value: on the item's own scale; text where it asks for words.

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
        _check_code("Answer", self.participant)
        if (self.value is None) == (self.text == ""):
            raise ValueError("Answer: expected a value or a text, and not both")
        if self.value is not None and not math.isfinite(self.value):
            raise ValueError(f"Answer: expected a finite value, got {self.value}")


def _check_code(what: str, code: str) -> None:
    fault = participant_code_fault(code)
    if fault is not None:
        raise ValueError(f"{what}: participant: {fault}")


def _check_counts(identifier: str, number: int, period: int) -> None:
    if not identifier or number < 1 or period < 0:
        raise ValueError(
            f"Trial {identifier!r}: expected an id, a number of at least 1 and a period of at least 0, got {number} "
            f"and {period}"
        )
