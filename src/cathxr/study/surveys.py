"""Surveys: their items and scores as TOML files say them, the built-in ones, and the scores of answers."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from importlib import resources
from typing import Annotated, Literal

from pydantic import Field

from cathxr.core import ConfigError
from cathxr.core.plain_text import plain_text_fault
from cathxr.core.trials import Answer
from cathxr.study.toml_reading import OptionalText, Strict, Text, read_toml

SCHEMA = "cathxr-survey/1"
GUIDE = "docs/study.md"
BUILT_IN = ("paper", "sus", "tlx", "ssq")


class Kind(StrEnum):
    """What an item takes."""

    RATING = "rating"
    """A number on the item's scale."""
    WORDS = "words"
    """Free text."""


@dataclass(frozen=True)
class Item:
    """One item. Ratings go from minimum to maximum in steps; low, high: what the ends mean; labels: of every step."""

    key: str
    text: str
    kind: Kind = Kind.RATING
    minimum: float = 1.0
    maximum: float = 5.0
    step: float = 1.0
    low: str = ""
    high: str = ""
    labels: tuple[str, ...] = ()
    optional: bool = False

    def fault(self, value: float | None, text: str) -> str | None:
        """Return why an answer does not fit this item, as the end of a sentence; None where it does."""
        if self.kind is Kind.WORDS:
            return "expected words" if value is not None or not text else plain_text_fault(text, lines=True)
        scale = f"expected a number from {self.minimum:g} to {self.maximum:g} in steps of {self.step:g}"
        if value is None:
            return f"{scale}, got {text[:40]!r}"
        steps = (value - self.minimum) / self.step
        on_scale = self.minimum <= value <= self.maximum and abs(steps - round(steps)) < 1e-9
        return None if on_scale else f"{scale}, got {value:g}"


@dataclass(frozen=True)
class Score:
    """A score: offset + the sum of weight x answer over its items. minimum, maximum: its range; better: which end."""

    key: str
    name: str
    offset: float
    weights: Mapping[str, float]
    minimum: float
    maximum: float
    better: str


@dataclass(frozen=True)
class Survey:
    """A survey. source: where it was published; instruction: read before the items."""

    key: str
    name: str
    source: str
    instruction: str
    items: tuple[Item, ...]
    scores: tuple[Score, ...] = ()

    def item(self, key: str) -> Item | None:
        """Return the item of a key."""
        return next((each for each in self.items if each.key == key), None)


@dataclass(frozen=True)
class ScoreValue:
    """A participant's score. value: None where it cannot be had, and then `missing` names the items without answer."""

    participant: str
    survey: str
    occasion: str
    score: str
    value: float | None
    missing: tuple[str, ...] = ()


class _Scale(Strict):
    minimum: float = 1.0
    maximum: float = 5.0
    step: Annotated[float, Field(gt=0.0)] = 1.0
    low: OptionalText = ""
    high: OptionalText = ""
    labels: list[Text] = Field(default_factory=list)


_MOST_STEPS = 1000
_COLUMNS = ("participant", "survey", "item", "occasion", "value", "words", "answered")
"""Columns of the files that answers are entered from: no item may be called so."""
_KEY = r"^[a-z0-9][a-z0-9_-]{0,39}$"


class _Item(Strict):
    key: Annotated[str, Field(pattern=_KEY)]
    text: Text
    kind: Literal["rating", "words"] = "rating"
    scale: _Scale | None = None
    low: OptionalText | None = None
    high: OptionalText | None = None
    optional: bool = False


class _Score(Strict):
    key: Annotated[str, Field(pattern=_KEY)]
    name: Text
    offset: float = 0.0
    weights: Annotated[dict[str, float], Field(min_length=1)]
    better: Literal["lower", "higher", "neither"] = "neither"


class _Document(Strict):
    schema_name: str = Field(alias="schema")
    key: Annotated[str, Field(pattern=_KEY)]
    name: Text
    source: OptionalText = ""
    instruction: OptionalText = ""
    scale: _Scale = _Scale()
    items: Annotated[list[_Item], Field(min_length=1, max_length=200)]
    scores: list[_Score] = Field(default_factory=list)


def survey_from_text(text: str, *, name: str) -> Survey:
    """Return the survey of a TOML text; `name` is the file's name in the sentences.

    Raises:
        ConfigError: it is not TOML, or a key is missing, unknown, or has a value it cannot have.
    """
    document = read_toml(text, _Document, name=name, schema=SCHEMA, guide=GUIDE)
    items = tuple(_item(each, document.scale) for each in document.items)
    keys = [each.key for each in items]
    named = [each.key for each in document.scores]
    fault = None
    if len(set(keys)) != len(keys):
        fault = f"items: expected different keys, got {', '.join(keys)}"
    if len(set(named)) != len(named):
        fault = f"scores: expected different keys, got {', '.join(named)}"
    for each in items:
        fault = _item_fault(each) or fault
    ratings = {each.key: each for each in items if each.kind is Kind.RATING}
    for score in document.scores:
        odd = [key for key in score.weights if key not in ratings]
        if odd:
            fault = f"scores: {score.key}: {odd[0]} is no item with a rating"
    if fault is not None:
        raise ConfigError(f"{name}: {fault}; correct it.")
    return Survey(
        document.key, document.name, document.source, document.instruction, items,
        tuple(_score(each, ratings) for each in document.scores),
    )  # fmt: skip


def _item_fault(item: Item) -> str | None:
    """Return why an item cannot be asked or entered, as the middle of a sentence; None where it can."""
    if item.key in _COLUMNS:
        return f"items: {item.key} is the name of a column of the files that answers are entered from"
    if item.kind is Kind.WORDS:
        return None
    steps = (item.maximum - item.minimum) / item.step
    if not 1 <= steps <= _MOST_STEPS or abs(steps - round(steps)) > 1e-9:
        return f"items: {item.key}: expected a maximum that is 1 to {_MOST_STEPS} whole steps above the minimum"
    if item.labels and len(item.labels) != round(steps) + 1:
        return f"items: {item.key}: expected {round(steps) + 1} labels, one a step, got {len(item.labels)}"
    return None


def builtin_survey_text(key: str) -> str:
    """Return the TOML text of a built-in survey, one of BUILT_IN."""
    return resources.files("cathxr.study").joinpath("surveys").joinpath(f"{key}.toml").read_text(encoding="utf-8")


def builtin_surveys() -> tuple[Survey, ...]:
    """Return the built-in surveys: the paper's ten questions, SUS, raw NASA-TLX, SSQ."""
    return tuple(survey_from_text(builtin_survey_text(each), name=f"{each}.toml") for each in BUILT_IN)


def scores_of(survey: Survey, answers: Iterable[Answer]) -> tuple[ScoreValue, ...]:
    """Return every score of a survey for every participant and occasion that has an answer to it.

    A score of which an item has no answer is None: nothing is filled in.
    """
    values: dict[tuple[str, str], dict[str, float]] = {}
    for each in answers:
        if each.survey == survey.key:
            given = values.setdefault((each.participant, each.occasion), {})
            if each.value is not None:
                given[each.item] = each.value
    found = []
    for (participant, occasion), given in sorted(values.items()):
        for score in survey.scores:
            missing = tuple(key for key in score.weights if key not in given)
            value = None
            if not missing:
                value = score.offset + sum(weight * given[key] for key, weight in score.weights.items())
            found.append(ScoreValue(participant, survey.key, occasion, score.key, value, missing))
    return tuple(found)


def _item(table: _Item, common: _Scale) -> Item:
    scale = table.scale or common
    low = scale.low if table.low is None else table.low
    high = scale.high if table.high is None else table.high
    return Item(
        table.key, table.text, Kind(table.kind), scale.minimum, scale.maximum, scale.step, low, high,
        tuple(scale.labels), table.optional,
    )  # fmt: skip


def _score(table: _Score, ratings: Mapping[str, Item]) -> Score:
    ends = [
        sorted((weight * ratings[key].minimum, weight * ratings[key].maximum)) for key, weight in table.weights.items()
    ]
    lowest = table.offset + sum(each[0] for each in ends)
    highest = table.offset + sum(each[1] for each in ends)
    return Score(table.key, table.name, table.offset, dict(table.weights), lowest, highest, table.better)
