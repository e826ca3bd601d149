"""What a study is to be, fixed before its data: conditions, orders, trials, practice, outcomes, exclusions, surveys."""

from dataclasses import dataclass
from enum import StrEnum

from cathxr.core import ConfigError
from cathxr.study.exclusion_rules import Rule


class Asked(StrEnum):
    """When a survey is asked."""

    BEFORE = "before"
    """Once, before anything else."""
    EACH = "each"
    """After the trials of every condition."""
    END = "end"
    """Once, after all trials."""


class PracticeWhen(StrEnum):
    """When practice comes."""

    FIRST = "first"
    """Once, before the first condition and in its view."""
    EACH = "each"
    """Before every condition, in its view."""


@dataclass(frozen=True)
class Condition:
    """One condition of the study. view: "2d", "3d" or "free", what the live system shows."""

    key: str
    name: str
    view: str


@dataclass(frozen=True)
class PracticePlan:
    """The familiarisation. task: the key of a task with a practice rule."""

    task: str
    when: PracticeWhen = PracticeWhen.FIRST


@dataclass(frozen=True)
class SurveyPlan:
    """A survey of the study, by its key, and when it is asked."""

    survey: str
    asked: Asked


@dataclass(frozen=True)
class StudyDesign:
    """A study's design, as study.toml says it.

    sequences: the orders of conditions that participants are allocated to, each of the conditions' keys. tasks: done in
    turn within a condition, each `trials_per_condition` times. blocks: sizes of allocation blocks, in whole sets of
    sequences. seed: of the allocation, None: drawn when the study is initialised and kept in its store. primary and
    secondary: keys of metrics.
    """

    key: str
    title: str
    question: str
    conditions: tuple[Condition, ...]
    sequences: tuple[tuple[str, ...], ...]
    tasks: tuple[str, ...]
    trials_per_condition: int
    planned: int
    primary: str
    secondary: tuple[str, ...] = ()
    practice: PracticePlan | None = None
    groups: tuple[str, ...] = ()
    blocks: tuple[int, ...] = (1, 2)
    seed: int | None = None
    exclusions: tuple[Rule, ...] = ()
    surveys: tuple[SurveyPlan, ...] = ()

    def __post_init__(self) -> None:
        keys = [each.key for each in self.conditions]
        if not keys or len(set(keys)) != len(keys):
            raise ValueError(f"conditions: expected different keys, got {keys}")
        outcomes = (self.primary, *self.secondary)
        for what, named in (
            ("conditions: names", [each.name for each in self.conditions]),
            ("trials.tasks", self.tasks),
            ("outcomes", outcomes),
            ("participants.groups", self.groups),
        ):
            twice = next((each for each in named if list(named).count(each) > 1), None)
            if twice is not None:
                raise ValueError(f"{what}: expected each once, got {twice} twice")
        for sequence in self.sequences:
            if sorted(sequence) != sorted(keys):
                raise ValueError(f"sequences: expected each to hold {keys} once, got {list(sequence)}")
        if not self.sequences or len(set(self.sequences)) != len(self.sequences):
            raise ValueError("sequences: expected at least one, and none twice")
        asked = [(each.survey, each.asked) for each in self.surveys]
        if len(set(asked)) != len(asked):
            raise ValueError("surveys: expected each to be asked once at a time, got one twice")
        rules = [each.key for each in self.exclusions]
        if len(set(rules)) != len(rules):
            raise ValueError(f"exclusions: expected different keys, got {rules}")

    @property
    def trials_a_condition(self) -> int:
        """How many trials a participant does in one condition, all tasks together."""
        return self.trials_per_condition * len(self.tasks)

    @property
    def balanced(self) -> bool:
        """Whether over the sequences every condition stands equally often in every place."""
        return all(len(set(column)) == len(self.conditions) for column in zip(*self.sequences, strict=True)) and all(
            column.count(key) * len(self.conditions) == len(column)
            for column in zip(*self.sequences, strict=True)
            for key in set(column)
        )

    def condition(self, key: str) -> Condition:
        """Return the condition of a key.

        Raises:
            ConfigError: there is none.
        """
        for each in self.conditions:
            if each.key == key:
                return each
        raise ConfigError(f"No condition is called {key}; there are {', '.join(each.key for each in self.conditions)}.")

    def occasions(self, plan: SurveyPlan, sequence: tuple[str, ...]) -> tuple[str, ...]:
        """Return the occasions of a survey for a participant of that sequence, as `Answer.occasion` writes them."""
        if plan.asked is Asked.EACH:
            return tuple(f"after:{each}" for each in sequence)
        return (plan.asked.value,)

    def task_of(self, number: int) -> str:
        """Return the task of the trial that is the `number`-th valid one (from 1) of a condition."""
        return self.tasks[(number - 1) % len(self.tasks)]


def sequence_text(sequence: tuple[str, ...]) -> str:
    """Return a sequence as `Participant.sequence` writes it, such as "2d>3d"."""
    return ">".join(sequence)
