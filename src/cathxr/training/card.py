"""A trainee's score card: this trial against the own best and against the cohort."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core.trials import TrialRecord
from cathxr.training.metrics.catalogue import METRICS
from cathxr.training.metrics.measure import Metric

FEWEST_OTHERS = 5
"""With fewer others a percentile would say more about them than about the trainee."""


@dataclass(frozen=True)
class CardLine:
    """One metric of the card. value: of this trial, None where it has none.

    history: (number of the trial in order, value) of this and the earlier trials that have it. best_before: of the
    earlier ones, None without or where neither way is better. is_best: whether this is better than that. percentile:
    share of the others, %, who do worse (half of those who do the same counts), None with fewer than 5 others.
    """

    metric: Metric
    value: float | None
    history: tuple[tuple[int, float], ...]
    best_before: float | None
    is_best: bool
    percentile: float | None
    others: int


@dataclass(frozen=True)
class ScoreCard:
    """The card of one trial."""

    record: TrialRecord
    earlier: int
    lines: tuple[CardLine, ...]


def score_card(record: TrialRecord, records: Sequence[TrialRecord]) -> ScoreCard:
    """Return the card of a trial among all records, itself included or not.

    Compared are valid trials of the same task and condition that are not practice. The own ones: those that began
    before it. The cohort: every other participant's median over such trials.
    """
    alike = [
        each
        for each in records
        if (each.task, each.condition) == (record.task, record.condition) and not each.invalid and not each.practice
    ]
    own = sorted(
        (
            each
            for each in alike
            if each.participant == record.participant and each.began < record.began and each.id != record.id
        ),
        key=lambda each: (each.began, each.id),
    )
    others: dict[str, list[TrialRecord]] = {}
    for each in alike:
        if each.participant != record.participant:
            others.setdefault(each.participant, []).append(each)
    lines = tuple(_line(metric, record, own, list(others.values())) for metric in METRICS)
    return ScoreCard(record, len(own), tuple(each for each in lines if each.value is not None or each.history))


def _line(
    metric: Metric, record: TrialRecord, own: Sequence[TrialRecord], others: Sequence[Sequence[TrialRecord]]
) -> CardLine:
    key, value = metric.key, record.measures.get(metric.key)
    history = [(number, each.measures[key]) for number, each in enumerate((*own, record), 1) if key in each.measures]
    before = [each.measures[key] for each in own if key in each.measures]
    sign = {"lower": -1.0, "higher": 1.0, "neither": 0.0}[metric.better]
    best = max(before, key=lambda each: sign * each) if before and sign else None
    middles = [
        float(np.median(known))
        for trials in others
        if (known := [each.measures[key] for each in trials if key in each.measures])
    ]
    percentile = None
    if value is not None and sign and len(middles) >= FEWEST_OTHERS:
        worse = [sign * each < sign * value for each in middles]
        same = [each == value for each in middles]
        percentile = 100.0 * (sum(worse) + 0.5 * sum(same)) / len(middles)
    return CardLine(
        metric=metric,
        value=value,
        history=tuple(history),
        best_before=best,
        is_best=value is not None and best is not None and sign * value > sign * best,
        percentile=percentile,
        others=len(middles),
    )
