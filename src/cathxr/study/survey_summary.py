"""Answers by item: how many, mean, sample standard deviation, and which were given: the paper's Table 1."""

import statistics
from collections.abc import Iterable
from dataclasses import dataclass

from cathxr.core.trials import Answer
from cathxr.study.surveys import Item, Kind, Survey


@dataclass(frozen=True)
class ItemSummary:
    """One item on one occasion. mean: None without answers; std: of the sample (n - 1), None with fewer than two.

    values: by participant, in the order of their codes.
    """

    item: Item
    occasion: str
    values: tuple[tuple[str, float], ...]
    mean: float | None
    std: float | None

    @property
    def count(self) -> int:
        """How many answered."""
        return len(self.values)


def item_summaries(survey: Survey, answers: Iterable[Answer]) -> tuple[ItemSummary, ...]:
    """Return a summary of every rating of a survey on every occasion that has answers, occasion by occasion."""
    given = [each for each in answers if each.survey == survey.key and each.value is not None]
    occasions = sorted({each.occasion for each in given})
    return tuple(
        _summary(item, occasion, given)
        for occasion in occasions
        for item in survey.items
        if item.kind is Kind.RATING
    )  # fmt: skip


def _summary(item: Item, occasion: str, answers: list[Answer]) -> ItemSummary:
    chosen = sorted(
        (each.participant, each.value)
        for each in answers
        if each.value is not None and (each.item, each.occasion) == (item.key, occasion)
    )
    values = [value for _, value in chosen]
    mean = statistics.fmean(values) if values else None
    std = statistics.stdev(values) if len(values) > 1 else None
    return ItemSummary(item, occasion, tuple(chosen), mean, std)
