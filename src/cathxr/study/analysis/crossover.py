"""The AB/BA analysis by person: the view's effect with the period's taken out, from one value a person and period.

It asks less than the mixed model: people may differ in how much a view helps them, for each person counts as one.
Sources: Hills and Armitage 1979, Br J Clin Pharmacol 8:7; Koch 1972, Biometrics 28:577; Senn 2002, Cross-over Trials.
"""

import warnings
from dataclasses import dataclass
from math import comb

import numpy as np
from scipy import stats

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.estimates import Estimate, comparison_reading
from cathxr.study.analysis.observations import Observations, observations
from cathxr.study.analysis.paired import ExactTest


@dataclass(frozen=True)
class CrossOver:
    """view: subject minus reference; period: second minus first; carry_over: of the group that began with the reference

    minus the other's, by their sums over both periods. All on the measure's scale. exact: the rank-sum test of the
    period differences. sizes: participants who began with the reference, and with the subject. why: why there is none.
    """

    measure: Measure
    view: Estimate
    view_p: float
    period: Estimate
    period_p: float
    carry_over: Estimate
    carry_over_p: float
    exact: ExactTest
    sizes: tuple[int, int]
    reading: str


def cross_over(data: StudyData, measure: Measure, *, reference: str, subject: str) -> CrossOver | None:
    """Return the analysis of both views (keys), or None without two people in each order."""
    return cross_over_of(observations(data, measure), data, reference=reference, subject=subject)


def cross_over_of(observed: Observations, data: StudyData, *, reference: str, subject: str) -> CrossOver | None:
    """Return the analysis of these observations. The order is the one in which the trials were done."""
    first, second, reference_first = _by_person(observed, reference=reference, subject=subject)
    sizes = (int(reference_first.sum()), int((~reference_first).sum()))
    if min(sizes) < 2:
        return None
    level = 1.0 - data.alpha
    step = second - first
    # Began with the reference: step = view + period; with the subject: step = period − view.
    view, view_p = _half_difference(step[reference_first], step[~reference_first], level=level)
    period, period_p = _half_difference(step[reference_first], -step[~reference_first], level=level)
    total = first + second
    carry, carry_p = _half_difference(total[reference_first], total[~reference_first], level=level)
    exact = rank_sum(step[reference_first], step[~reference_first], name="Rank-sum of period differences")
    reading = comparison_reading(
        view, observed.measure, subject=data.name_of(subject), reference=data.name_of(reference)
    )
    return CrossOver(
        observed.measure, view, view_p, period, period_p, carry.scaled(2.0), carry_p, exact, sizes, reading
    )


def _by_person(observed: Observations, *, reference: str, subject: str) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Return (n,) means in the earlier and in the later view, and whether the earlier one was the reference."""
    values: dict[str, dict[str, list[float]]] = {}
    periods: dict[str, dict[str, set[int]]] = {}
    for trial, value in zip(observed.trials, observed.y, strict=True):
        if trial.condition in (reference, subject):
            values.setdefault(trial.participant, {}).setdefault(trial.condition, []).append(float(value))
            periods.setdefault(trial.participant, {}).setdefault(trial.condition, set()).add(trial.period)
    rows = []
    for code in sorted(values):
        found = values[code]
        if len(found) < 2 or any(len(each) != 1 for each in periods[code].values()):
            continue
        begins = min(periods[code][reference]) < min(periods[code][subject])
        order = (reference, subject) if begins else (subject, reference)
        rows.append((float(np.mean(found[order[0]])), float(np.mean(found[order[1]])), begins))
    table = np.array([row[:2] for row in rows], dtype=np.float64).reshape(len(rows), 2)
    return table[:, 0], table[:, 1], np.array([row[2] for row in rows], dtype=bool)


def _half_difference(a: FloatArray, b: FloatArray, *, level: float) -> tuple[Estimate, float]:
    """Return half the difference of two means, a − b, with Student's interval (pooled), and its p."""
    value = float(a.mean() - b.mean()) / 2.0
    noise = 1e-9 * max(float(np.abs(a).max()), float(np.abs(b).max()))
    if float(np.ptp(a)) <= noise and float(np.ptp(b)) <= noise:  # nothing to estimate a spread from
        return Estimate(value, value, value, level), 1.0 if abs(value) <= noise else 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that one of both groups is all alike is no harm: the spread is pooled
        result = stats.ttest_ind(a, b)
        interval = result.confidence_interval(level)
    return Estimate(value, float(interval.low) / 2.0, float(interval.high) / 2.0, level), float(result.pvalue)


def rank_sum(a: FloatArray, b: FloatArray, *, name: str) -> ExactTest:
    """Return the two-sided rank-sum test of a (n,) and b (m,): exact up to 184,756 draws, ties with mid-ranks.

    Without ties by SciPy's exact distribution over all draws, with ties by going through every draw.
    """
    draws = comb(len(a) + len(b), len(a))
    enumerated = draws <= comb(20, 10)
    tied = len(np.unique(np.concatenate([a, b]))) < len(a) + len(b)
    method: object = "asymptotic"
    if enumerated:
        method = stats.PermutationMethod(n_resamples=draws, batch=2**12) if tied else "exact"
    result = stats.mannwhitneyu(a, b, method=method)
    smallest = min(1.0, 2.0 / draws)
    return ExactTest(name, float(result.statistic), float(result.pvalue),
                     len(a) + len(b), enumerated, smallest)  # fmt: skip
