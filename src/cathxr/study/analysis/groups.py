"""Groups of people, such as novices and experts: how each did, what the view did in each, and how they differ.

Nobody was put into a group by chance, so that a difference between groups is never the effect of belonging to one.
"""

import warnings
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.counts import outcome_model
from cathxr.study.analysis.crossover import rank_sum
from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.describe import Described, described
from cathxr.study.analysis.estimates import Estimate, change_text, in_sentence, p_text, range_text, verb_of
from cathxr.study.analysis.model import Model
from cathxr.study.analysis.multiple import holm
from cathxr.study.analysis.observations import observations
from cathxr.study.analysis.paired import ExactTest, differences


@dataclass(frozen=True)
class GroupResult:
    """One group by itself. participants: those with trials that count. model: the primary one, of this group alone."""

    name: str
    participants: int
    described: tuple[Described, ...]
    model: Model


@dataclass(frozen=True)
class GroupDifference:
    """One group minus another, each person counted once, on the measure's scale.

    kind: "level", of people's means over the views, or "view", of how much a view changes a person's value, and then
    `condition` is that view's name. effect, p: Welch's; rank_sum: the exact test beside it. sizes: of the reference and
    the subject. holm_p: p corrected over all secondary outcomes; None for the primary one. reading: in plain words.
    """

    measure: Measure
    kind: str
    condition: str
    reference: str
    subject: str
    effect: Estimate
    p: float
    rank_sum: ExactTest
    sizes: tuple[int, int]
    reading: str
    holm_p: float | None = None


@dataclass(frozen=True)
class Groups:
    """The groups of a study with the primary measure; differences: of the primary one, then of the secondary ones.

    ungrouped: codes that have trials which count and belong to no group. too_few: pairs that cannot be compared.
    """

    results: tuple[GroupResult, ...]
    differences: tuple[GroupDifference, ...]
    ungrouped: tuple[str, ...]
    too_few: tuple[str, ...]


def groups(data: StudyData) -> Groups | None:
    """Return the groups' analysis; None where fewer than two groups have trials that count."""
    group_of = {each.code: each.group for each in data.participants}
    counted = observations(data, data.primary).participants
    names = tuple(dict.fromkeys(each.group for each in data.participants if each.group and each.code in counted))
    if len(names) < 2:
        return None
    results = []
    for name in names:
        alone = _of_group(data, name)
        people = sum(group_of.get(code) == name for code in counted)
        results.append(
            GroupResult(name, people, described(alone, data.primary), outcome_model(alone, data.primary))
        )  # fmt: skip
    pairs = [(names[0], each) for each in names[1:]]
    first = [found for pair in pairs for found in _compared(data, data.primary, pair, group_of)]
    others = [
        found
        for measure in data.secondary
        for pair in pairs
        for found in _compared(data, measure, pair, group_of)
        if found.kind == "level"
    ]
    corrected = holm([each.p for each in others])
    others = [replace(each, holm_p=p) for each, p in zip(others, corrected, strict=True)]
    compared = {(each.reference, each.subject) for each in first}
    return Groups(
        tuple(results),
        (*first, *others),
        tuple(code for code in counted if not group_of.get(code)),
        tuple(f"{subject} and {reference}" for reference, subject in pairs if (reference, subject) not in compared),
    )


def _of_group(data: StudyData, name: str) -> StudyData:
    people = tuple(each for each in data.participants if each.group == name)
    codes = {each.code for each in people}
    return replace(data, participants=people, trials=tuple(each for each in data.trials if each.participant in codes))


def _compared(
    data: StudyData, measure: Measure, pair: tuple[str, str], group_of: dict[str, str]
) -> list[GroupDifference]:
    """Return how the second group differs from the first: in its level, and in what each further view does."""
    values: list[tuple[str, str, dict[str, float]]] = [("level", "", _levels(data, measure))]
    for condition in data.conditions[1:]:
        found = differences(data, measure, reference=data.conditions[0].key, subject=condition.key)
        values.append(("view", condition.name, dict(zip(found.participants, map(float, found.d), strict=True))))
    compared = []
    for kind, condition_name, by_code in values:
        reference, subject = (
            np.array([value for code, value in by_code.items() if group_of.get(code) == name]) for name in pair
        )
        if min(len(reference), len(subject)) < 2 or float(np.ptp(np.concatenate([reference, subject]))) == 0.0:
            continue
        effect, p = _welch(subject, reference, level=1.0 - data.alpha)
        reading = _reading(kind, condition_name, effect, p, measure, pair, data.conditions[0].name)
        test = rank_sum(reference, subject, name="Rank-sum of both groups")
        sizes = (len(reference), len(subject))
        compared.append(GroupDifference(measure, kind, condition_name, *pair, effect, p, test, sizes, reading))
    return compared


def _levels(data: StudyData, measure: Measure) -> dict[str, float]:
    """Return each person's mean over the views, each view counting once, of those who have trials in every view."""
    observed = observations(data, measure)
    places: dict[str, dict[str, list[float]]] = {}
    for trial, value in zip(observed.trials, observed.y, strict=True):
        places.setdefault(trial.participant, {}).setdefault(trial.condition, []).append(float(value))
    views = {each.condition for each in observed.trials}
    return {
        code: float(np.mean([np.mean(each) for each in found.values()]))
        for code, found in places.items()
        if set(found) == views
    }


def _welch(a: FloatArray, b: FloatArray, *, level: float) -> tuple[Estimate, float]:
    """Return the difference of two means, a − b, by Welch's t, which lets the groups spread unequally, and its p."""
    value = float(a.mean() - b.mean())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that one of both groups is all alike is no harm
        result = stats.ttest_ind(a, b, equal_var=False)
        interval = result.confidence_interval(level)
    return Estimate(value, float(interval.low), float(interval.high), level), float(result.pvalue)


def _reading(
    kind: str, condition: str, effect: Estimate, p: float, measure: Measure, pair: tuple[str, str], base: str
) -> str:
    what, (reference, subject) = in_sentence(measure.name), pair
    span = f"({range_text(effect, measure)}; {p_text(p)})"
    if kind == "level":
        told = f"In group {subject}, {what} {verb_of(measure.name)} {change_text(effect.value, measure)} than in "
        told += f"group {reference} {span}."
        return told if effect.excludes_zero else told + " No difference at all is among these."
    how = "relative to" if measure.log else "minus"
    told = f"{measure.name} with {condition} {how} that with {base} {verb_of(measure.name)} "
    told += f"{change_text(effect.value, measure)} in group {subject} than in group {reference} {span}."
    settled = " The view does not do the same in both." if effect.excludes_zero else ""
    return told + (settled or " That the view does the same in both is among these.")
