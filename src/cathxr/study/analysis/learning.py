"""Learning curves: how a measure changes over a participant's trials, whatever the view."""

import math
from dataclasses import dataclass

import numpy as np

from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.estimates import Estimate, change_text, in_sentence, range_text
from cathxr.study.analysis.mixed_fit import fit_random_intercept
from cathxr.study.analysis.observations import observations, ordinals


@dataclass(frozen=True)
class Place:
    """The trials that were somebody's n-th. mean: on the measure's scale; n: how many participants have one."""

    ordinal: int
    mean: float
    n: int


@dataclass(frozen=True)
class Curve:
    """One participant's trials in the order in which they were done: places (1, 2, …), values, views."""

    participant: str
    ordinals: tuple[int, ...]
    values: tuple[float, ...]
    conditions: tuple[str, ...]


@dataclass(frozen=True)
class Learning:
    """per_doubling: the change when the number of trials done doubles (the power law of practice), with participants'

    own levels and the view taken out; None where there are too few trials. One view first for everybody makes it
    impossible to tell learning from the view: then it is None too, and the reading says so.
    """

    measure: Measure
    curves: tuple[Curve, ...]
    places: tuple[Place, ...]
    per_doubling: Estimate | None
    p: float | None
    reading: str


def learning(data: StudyData, measure: Measure) -> Learning:
    """Return how `measure` changes over the trials. Source of the law: Newell and Rosenbloom 1981."""
    observed = observations(data, measure)
    place = ordinals(observed.trials)
    curves = []
    found: dict[str, list[tuple[int, int]]] = {}
    for i, trial in enumerate(observed.trials):
        found.setdefault(trial.participant, []).append((place[i], i))
    for code in observed.participants:
        rows = sorted(found[code])
        curves.append(
            Curve(
                code,
                tuple(at for at, _ in rows),
                tuple(float(observed.y[i]) for _, i in rows),
                tuple(observed.trials[i].condition for _, i in rows),
            )
        )
    places = tuple(
        Place(at, float(observed.y[here].mean()), int(here.sum()))
        for at in range(1, max(place, default=0) + 1)
        if (here := np.array(place) == at).any()
    )
    what = in_sentence(measure.name)
    columns = [np.log2(np.array(place, dtype=np.float64))]
    for condition in data.conditions[1:]:
        column = np.array([each.condition == condition.key for each in observed.trials], dtype=np.float64)
        if len(column) and np.ptp(column) > 0.0:
            columns.append(column)
    nothing = Learning(measure, tuple(curves), places, None, None, f"There are too few trials for a curve of {what}.")
    if len(observed.participants) < 2 or max(place, default=0) < 2 or np.ptp(observed.y) == 0.0:
        return nothing
    matrix = np.column_stack([np.ones(len(place)), *(each - each.mean() for each in columns)])
    if _same_order(curves):
        told = f"Learning of {what} cannot be told from the view: everybody had the views in the same order."
        return Learning(measure, tuple(curves), places, None, None, told)
    groups = [each.participant for each in observed.trials]
    fit = fit_random_intercept(observed.y, matrix, groups=groups, within=[False] + [True] * len(columns))
    if fit is None or np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        return nothing
    effect = fit.estimate(1, 1.0 - data.alpha)
    most = places[-1].ordinal
    told = (
        f"Each doubling of the number of trials done went with {what} {change_text(effect.value, measure)} "
        f"({range_text(effect, measure)}), that is {change_text(effect.value * math.log2(most), measure)} from the "
        f"first trial to number {most}."
    )
    if not effect.excludes_zero:
        told += " No change at all is possible too."
    return Learning(measure, tuple(curves), places, effect, fit.p(1), told)


def _same_order(curves: list[Curve]) -> bool:
    """Return whether each view was had at the same places by everybody, and more than one view was had."""
    orders = {tuple(sorted(zip(each.ordinals, each.conditions, strict=True))) for each in curves}
    longest = max(orders, key=len)
    same = all(order == longest[: len(order)] for order in orders)
    return same and len({condition for _, condition in longest}) > 1
