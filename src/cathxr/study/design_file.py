"""study.toml: a study's design, read and checked. Format: docs/study.md."""

from itertools import permutations
from typing import Annotated, Literal

from pydantic import Field

from cathxr.core import ConfigError
from cathxr.core.latin_square import williams_orders
from cathxr.study.design import Asked, Condition, PracticePlan, PracticeWhen, StudyDesign, SurveyPlan
from cathxr.study.exclusion_rules import Rule, RuleOf
from cathxr.study.toml_reading import OptionalText, Strict, Text, read_toml

SCHEMA = "cathxr-study/1"
GUIDE = "docs/study.md"

_Key = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,39}$")]
_Keys = Annotated[list[_Key], Field(min_length=1, max_length=40)]
_Sets = Annotated[int, Field(ge=1, le=20)]
_MOST_PERMUTED = 4


class _Condition(Strict):
    name: Text
    view: Literal["2d", "3d", "free"]


class _Sequences(Strict):
    kind: Literal["crossover", "latin", "permutations", "listed"] = "crossover"
    listed: list[_Keys] | None = None


class _Trials(Strict):
    tasks: _Keys
    per_condition: Annotated[int, Field(ge=1, le=100)]


class _Practice(Strict):
    task: _Key
    when: Literal["first", "each"] = "first"


class _Participants(Strict):
    planned: Annotated[int, Field(ge=1, le=100_000)]
    groups: list[_Key] = Field(default_factory=list)


class _Allocation(Strict):
    blocks: Annotated[list[_Sets], Field(min_length=1, max_length=10)] = Field(default_factory=lambda: [1, 2])
    seed: Annotated[int, Field(ge=0, lt=2**63)] | None = None


class _Outcomes(Strict):
    primary: Text
    secondary: list[Text] = Field(default_factory=list)


class _Exclusion(Strict):
    key: _Key
    reason: Text
    of: Literal["trial", "participant"] = "trial"
    measure: Text
    above: float | None = None
    below: float | None = None
    among: list[Text] = Field(default_factory=list, alias="is")


class _Survey(Strict):
    survey: _Key
    asked: Literal["before", "each", "end"]


class _Document(Strict):
    schema_name: str = Field(alias="schema")
    key: _Key
    title: Text
    question: OptionalText = ""
    conditions: Annotated[dict[_Key, _Condition], Field(min_length=1, max_length=12)]
    sequences: _Sequences = _Sequences()
    trials: _Trials
    practice: _Practice | None = None
    participants: _Participants
    allocation: _Allocation = _Allocation()
    outcomes: _Outcomes
    exclusions: list[_Exclusion] = Field(default_factory=list)
    surveys: list[_Survey] = Field(default_factory=list)


def design_from_text(text: str, *, name: str = "study.toml") -> StudyDesign:
    """Return the design of study.toml's text; `name` is the file's name in the sentences.

    Raises:
        ConfigError: it is not TOML, or a key is missing, unknown, or has a value it cannot have.
    """
    document = read_toml(text, _Document, name=name, schema=SCHEMA, guide=GUIDE)
    try:
        return _design(document)
    except ValueError as error:
        raise ConfigError(f"{name}: {error}. {GUIDE} describes the file.") from error


def sequences_of(kind: str, conditions: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """Return the sequences of a kind: crossover (AB and BA), latin (Williams), permutations (of up to 4 conditions).

    Raises:
        ValueError: the kind does not fit the number of conditions.
    """
    if kind == "crossover" and len(conditions) > 2:
        raise ValueError(f"sequences.kind: crossover is for two conditions, got {len(conditions)}; write latin")
    if kind == "permutations":
        if len(conditions) > _MOST_PERMUTED:
            raise ValueError(f"sequences.kind: permutations are for up to {_MOST_PERMUTED} conditions; write latin")
        return tuple(permutations(conditions))
    return tuple(tuple(conditions[each] for each in order) for order in williams_orders(len(conditions)))


def _design(document: _Document) -> StudyDesign:
    conditions = tuple(Condition(key, each.name, each.view) for key, each in document.conditions.items())
    keys = tuple(each.key for each in conditions)
    listed = document.sequences.listed
    if (listed is not None) != (document.sequences.kind == "listed"):
        raise ValueError('sequences: give `listed` with kind = "listed", and only then')
    sequences = sequences_of(document.sequences.kind, keys) if listed is None else tuple(map(tuple, listed))
    practice = document.practice
    return StudyDesign(
        key=document.key,
        title=document.title,
        question=document.question,
        conditions=conditions,
        sequences=sequences,
        tasks=tuple(document.trials.tasks),
        trials_per_condition=document.trials.per_condition,
        planned=document.participants.planned,
        primary=document.outcomes.primary,
        secondary=tuple(document.outcomes.secondary),
        practice=None if practice is None else PracticePlan(practice.task, PracticeWhen(practice.when)),
        groups=tuple(document.participants.groups),
        blocks=tuple(document.allocation.blocks),
        seed=document.allocation.seed,
        exclusions=tuple(_rule(each) for each in document.exclusions),
        surveys=tuple(SurveyPlan(each.survey, Asked(each.asked)) for each in document.surveys),
    )


def _rule(table: _Exclusion) -> Rule:
    return Rule(
        table.key, table.reason, RuleOf(table.of), table.measure, table.above, table.below, tuple(table.among)
    )  # fmt: skip
