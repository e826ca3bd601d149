"""What is analysed: the study's conditions and measures, its people, trials and answers, as plain values."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from cathxr.core.trials import Answer, Outcome, Participant, TrialRecord

FULL_TRIALS = (Outcome.COMPLETED, Outcome.TIMED_OUT)
"""How a trial must have ended for its measures to count."""


@dataclass(frozen=True)
class Condition:
    """One of the compared conditions, such as a view. key: as in TrialRecord.condition; name: as a person reads it."""

    key: str
    name: str


@dataclass(frozen=True)
class Measure:
    """A measured quantity. key: "t" (completion time), "nT" (targets reached), else a key of TrialRecord.measures.

    better: which way is better. log: compared as a ratio of geometric means; such values must be positive. count: a
    whole number of at least 0, compared as a ratio of means by the model for counts; not together with log.
    """

    key: str
    name: str
    unit: str = ""
    better: Literal["lower", "higher", "neither"] = "lower"
    log: bool = False
    count: bool = False

    def value_of(self, trial: TrialRecord) -> float | None:
        """Return the trial's value on the measure's own scale (log already taken), or None where it has none."""
        if self.key == "t":
            value: float | None = trial.active_s
        elif self.key == "nT":
            value = float(trial.reached) if trial.targets else trial.measures.get("nT")
        else:
            value = trial.measures.get(self.key)
        if value is None or not math.isfinite(value) or (self.log and value <= 0.0):
            return None
        return math.log(value) if self.log else float(value)

    @property
    def label(self) -> str:
        """The name with its unit, as an axis or a table's head has it."""
        return f"{self.name}, {self.unit}" if self.unit else self.name

    def told(self, value: float) -> str:
        """Return a value of the model's scale as a person reads it, with its unit."""
        shown = math.exp(value) if self.log else value
        return f"{shown:.3g} {self.unit}".strip() if abs(shown) < 1000 else f"{shown:.0f} {self.unit}".strip()


TIME = Measure("t", "Completion time", "s", "lower", log=True)
"""The time from the trial's start to its last target, pauses not counted."""


@dataclass(frozen=True)
class SurveyItem:
    """One item of a survey. words: the question; low, high: the ends of its scale, None where it asks for text.

    title: the survey's name; "" where only its key is known.
    """

    survey: str
    item: str
    words: str
    low: float | None = None
    high: float | None = None
    title: str = ""


@dataclass(frozen=True)
class SurveyScore:
    """One participant's score of a whole survey, such as SUS.

    unit: what it is out of; better: which way is better; ends: the least and greatest that there can be.
    """

    survey: str
    scale: str
    participant: str
    occasion: str
    value: float
    unit: str = ""
    better: Literal["lower", "higher", "neither"] = "neither"
    ends: tuple[float, float] | None = None


@dataclass(frozen=True)
class StudyData:
    """All that an analysis takes.

    conditions: the first is the reference that the others are compared with. rules: the exclusion rules, stated before
    the data. seed: of what is drawn by chance (only where full enumeration is too long). alpha: of every test.
    """

    name: str
    conditions: tuple[Condition, ...]
    participants: tuple[Participant, ...]
    trials: tuple[TrialRecord, ...]
    answers: tuple[Answer, ...] = ()
    primary: Measure = TIME
    secondary: tuple[Measure, ...] = ()
    items: tuple[SurveyItem, ...] = ()
    scores: tuple[SurveyScore, ...] = ()
    rules: tuple[str, ...] = ()
    changes: tuple[str, ...] = ()
    seed: int = 0
    alpha: float = 0.05

    def __post_init__(self) -> None:
        if len({each.key for each in self.conditions}) != len(self.conditions) or not self.conditions:
            raise ValueError("conditions: expected one or more different keys")
        if not 0.0 < self.alpha < 1.0:
            raise ValueError(f"alpha: expected between 0 and 1, got {self.alpha}")

    def name_of(self, condition: str) -> str:
        """Return a condition's name; its key where the study does not know it."""
        return next((each.name for each in self.conditions if each.key == condition), condition)

    def occasion_of(self, occasion: str) -> str:
        """Return when a survey was asked as a person reads it: "after:3d" is "after 3D view"."""
        when, _, condition = occasion.partition(":")
        return f"{when} {self.name_of(condition)}" if condition else {"end": "at the end"}.get(when, when)

    def order_of(self, sequence: str) -> str:
        """Return a sequence as a person reads it, such as "2D view, then 3D view"."""
        return ", then ".join(self.name_of(each) for each in sequence.split(">")) if sequence else "order unknown"

    def sequence_of(self, participant: str) -> str:
        """Return the order of conditions that the participant was allocated to, "" where that is not known."""
        return next((each.sequence for each in self.participants if each.code == participant), "")


def why_not(trial: TrialRecord) -> str:
    """Return why a trial does not count in the analysis, "" where it does."""
    if trial.practice:
        return "practice"
    if trial.invalid:
        return f"invalid: {trial.invalid}"
    if trial.outcome is Outcome.ABORTED:
        return "aborted by a person"
    if trial.outcome is Outcome.INTERRUPTED:
        return "interrupted: the program ended under it"
    return ""


def counted(trials: Iterable[TrialRecord]) -> tuple[TrialRecord, ...]:
    """Return the trials that count: no practice, not invalid, and ended by completion or by the time limit."""
    return tuple(each for each in trials if not why_not(each))
