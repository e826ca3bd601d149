"""Whether the view does the same in both periods of an AB/BA study: view x period, which is also the carry-over.

The same mixed model as the primary one, with view x period in the sequence's place: in an AB/BA study the interaction,
a carry-over from the first view, and a difference between the two groups are one and the same contrast (Senn 2002,
Cross-over Trials in Clinical Research, 3.1).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.estimates import Estimate, change_text, in_sentence, p_text, range_text, verb_of
from cathxr.study.analysis.mixed_fit import Fit, fit_random_intercept
from cathxr.study.analysis.observations import Observations, observations

_VIEW, _CHANGE = 1, 3


@dataclass(frozen=True)
class Interaction:
    """first, second: the view's effect in each period by itself; change: the second minus the first.

    All are on the measure's scale. p: of the change being 0; dof: of all three, since the change is one between people.
    """

    measure: Measure
    first: Estimate
    second: Estimate
    change: Estimate
    p: float
    dof: float
    reading: str


def interaction(data: StudyData, measure: Measure) -> Interaction | None:
    """Return view x period; None without two views, two periods, and two people in either order of the views."""
    observed = observations(data, measure)
    if len(data.conditions) != 2 or not _both_orders(observed):
        return None
    fits = [_fit(observed, data, period) for period in (1, 2)]
    if fits[0] is None or fits[1] is None:
        return None
    level = 1.0 - data.alpha
    first, second = (fit.estimate(_VIEW, level) for fit in fits if fit is not None)
    change, p = fits[0].estimate(_CHANGE, level), fits[0].p(_CHANGE)
    reading = _reading(measure, data, first, second, change, p)
    return Interaction(measure, first, second, change, p, float(fits[0].dof[_CHANGE]), reading)


def _both_orders(observed: Observations) -> bool:
    """Return whether two people or more began with either view, and the periods are 1 and 2."""
    began = {each.participant: each.condition for each in observed.trials if each.period == 1}
    both = {each.participant for each in observed.trials if each.period == 2} & set(began)
    orders = [began[each] for each in both]
    return (
        {each.period for each in observed.trials} == {1, 2}
        and len(set(orders)) == 2
        and min(orders.count(each) for each in set(orders)) >= 2
    )


def _fit(observed: Observations, data: StudyData, base: int) -> Fit | None:
    """Return the fit in which the view's coefficient is its effect in period `base`."""
    trials = observed.trials
    view = np.array([each.condition == data.conditions[1].key for each in trials], dtype=np.float64)
    period = np.array([each.period - base for each in trials], dtype=np.float64)
    columns = [np.ones(len(trials)), view, period, view * period]
    number = np.array([each.number for each in trials], dtype=np.float64)
    columns += _adding(columns, [number - number.mean(), *_tasks(observed)])
    within = [at not in (0, _CHANGE) for at in range(len(columns))]
    groups = [each.participant for each in trials]
    fit = fit_random_intercept(observed.y, np.column_stack(columns), groups=groups, within=within)
    return None if fit is None else replace(fit, dof=np.full(len(columns), fit.dof[_CHANGE]))


def _tasks(observed: Observations) -> list[FloatArray]:
    keys = sorted({each.task for each in observed.trials})
    return [np.array([each.task == key for each in observed.trials], dtype=np.float64) for key in keys[1:]]


def _adding(columns: Sequence[FloatArray], more: Sequence[FloatArray]) -> list[FloatArray]:
    """Return those of `more` that can be told from the columns before them."""
    kept: list[FloatArray] = []
    for each in more:
        tried = np.column_stack([*columns, *kept, each])
        if np.linalg.matrix_rank(tried) == tried.shape[1]:
            kept.append(each)
    return kept


def _reading(measure: Measure, data: StudyData, first: Estimate, second: Estimate, change: Estimate, p: float) -> str:
    reference, subject = (each.name for each in data.conditions)
    what = in_sentence(measure.name)
    told = (
        f"In the first period, {what} with {subject} {verb_of(measure.name)} {change_text(first.value, measure)} than "
        f"with {reference}, in the second {change_text(second.value, measure)}. Set against its effect in the first, "
        f"{subject} came out {change_text(change.value, measure)} in the second ({range_text(change, measure)}; "
        f"{p_text(p)})."
    )
    if change.excludes_zero:
        return (
            f"{told} So the view did not do the same in both: what was done first acted on what came after "
            "(carry-over), or the two groups differed. A study of two orders cannot tell which. The effect of the view "
            "over both periods is then not to be relied on; only the first period is free of carry-over."
        )
    return (
        f"{told} That the view does the same in both is among these, and so is every other change in that range: "
        "a carry-over as large as its ends is not ruled out, for this compares people with other people."
    )
