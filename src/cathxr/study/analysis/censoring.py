"""Targets and trials not reached in time: success shares, Kaplan-Meier curves, and a Cox model with the limit in it."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from statsmodels.duration.hazard_regression import PHReg
from statsmodels.duration.survfunc import SurvfuncRight
from statsmodels.stats.proportion import proportion_confint

from cathxr.core.arrays import FloatArray
from cathxr.core.trials import Outcome, TrialRecord
from cathxr.study.analysis.data import StudyData, counted
from cathxr.study.analysis.estimates import Estimate, percent


@dataclass(frozen=True, eq=False)
class Success:
    """One view's trials. completed of trials, with the share's Wilson interval, which takes trials as independent.

    targets_reached of targets. time_s, share: (M,) the Kaplan-Meier curve: the share of trials not yet completed after
    each instant, from 1 at 0. median_s: None where fewer than half were completed.
    """

    condition: str
    completed: int
    trials: int
    share: Estimate
    targets_reached: int
    targets: int
    time_s: FloatArray
    not_yet: FloatArray
    censored_s: FloatArray
    median_s: float | None


@dataclass(frozen=True)
class Hazard:
    """How much faster `subject` completes than the reference at any moment: log of the hazard ratio, above 0 is faster.

    Cox's model stratified by participant, period in it where it varies; trials cut by the limit count as cut.
    """

    subject: str
    log_ratio: Estimate
    p: float
    reading: str


@dataclass(frozen=True)
class Censoring:
    """censored of trials were cut by the limit. hazards: none where nothing was cut or there is no model (why)."""

    censored: int
    trials: int
    views: tuple[Success, ...]
    hazards: tuple[Hazard, ...]
    why: str
    reading: str


def censoring(data: StudyData) -> Censoring:
    """Return how often the time limit came first, by view, and the comparison that takes account of it."""
    trials = [each for each in counted(data.trials) if any(each.condition == known.key for known in data.conditions)]
    views = tuple(
        success([each for each in trials if each.condition == condition.key], condition.key, level=1.0 - data.alpha)
        for condition in data.conditions
        if any(each.condition == condition.key for each in trials)
    )
    cut = sum(each.outcome is Outcome.TIMED_OUT for each in trials)
    if not cut:
        return Censoring(0, len(trials), views, (), "", "Every trial that counts was completed within its limit.")
    hazards, why = _hazards(trials, data)
    shares = "; ".join(f"{data.name_of(each.condition)}: {each.completed} of {each.trials}" for each in views)
    told = (
        f"The time limit cut {cut} of {len(trials)} trials (completed: {shares}). How long those would have taken is "
        "not known, only that it is longer than the limit."
    )
    return Censoring(
        cut, len(trials), views, hazards, why, " ".join(filter(None, [told, *(each.reading for each in hazards), why]))
    )


def success(trials: Sequence[TrialRecord], condition: str, *, level: float = 0.95) -> Success:
    """Return the successes of one view's trials.

    Raises:
        ValueError: there are none.
    """
    if not trials:
        raise ValueError("trials: expected one or more, got none")
    done = np.array([each.outcome is Outcome.COMPLETED for each in trials], dtype=bool)
    times = np.array([each.active_s for each in trials], dtype=np.float64)
    curve = SurvfuncRight(times, done.astype(np.int64))
    low, high = proportion_confint(int(done.sum()), len(trials), alpha=1.0 - level, method="wilson")
    time_s = np.concatenate([[0.0], np.asarray(curve.surv_times, dtype=np.float64)])
    not_yet = np.concatenate([[1.0], np.asarray(curve.surv_prob, dtype=np.float64)])
    median = next((float(t) for t, share in zip(time_s, not_yet, strict=True) if share <= 0.5), None)
    return Success(
        condition,
        int(done.sum()),
        len(trials),
        Estimate(float(done.mean()), float(low), float(high), level),
        sum(each.reached for each in trials),
        sum(len(each.targets) for each in trials),
        time_s,
        not_yet,
        np.sort(times[~done]),
        median,
    )


def _hazards(trials: Sequence[TrialRecord], data: StudyData) -> tuple[tuple[Hazard, ...], str]:
    present = [each for each in data.conditions if any(trial.condition == each.key for trial in trials)]
    columns = [[float(trial.condition == each.key) for trial in trials] for each in present[1:]]
    if not columns:
        return (), ""
    periods = [[float(trial.period == each) for trial in trials] for each in sorted({t.period for t in trials})[1:]]
    exog = np.array([*columns, *periods]).T
    done = np.array([each.outcome is Outcome.COMPLETED for each in trials])
    strata = np.unique([each.participant for each in trials], return_inverse=True)[1]
    centred = exog - np.stack([exog[strata == each].mean(axis=0) for each in strata])
    if np.linalg.matrix_rank(centred) < exog.shape[1]:
        return (), "The Cox model cannot tell the view from the period here."
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            times = np.array([each.active_s for each in trials])
            result = PHReg(times, exog, status=done.astype(np.int64), strata=strata, ties="efron").fit(disp=0)
            errors = np.asarray(result.bse, dtype=np.float64)
        except (np.linalg.LinAlgError, ValueError):
            errors = np.array([np.inf])
    # An error this large says that the likelihood has no maximum: one view won in every comparison.
    if not np.isfinite(errors).all() or float(errors.max()) > 10.0:
        return (), "The Cox model has no estimate here: too few completed trials, or one view was always first."
    bounds, values, ps = result.conf_int(alpha=data.alpha), result.params, result.pvalues
    hazards = []
    for at, condition in enumerate(present[1:]):
        effect = Estimate(float(values[at]), float(bounds[at][0]), float(bounds[at][1]), 1.0 - data.alpha)
        hazards.append(Hazard(condition.key, effect, float(ps[at]), _told(effect, condition.name, present[0].name)))
    return tuple(hazards), ""


def _told(effect: Estimate, subject: str, reference: str) -> str:
    ratio = [math.exp(each) for each in (effect.value, effect.low, effect.high)]
    told = (
        f"Counting those as cut, a trial with {subject} is completed at {ratio[0]:.2f} times the rate of one with "
        f"{reference} (hazard ratio, {percent(effect.level)} interval {ratio[1]:.2f} to {ratio[2]:.2f}; above 1 is "
        "faster)"
    )
    return told + ("." if effect.excludes_zero else "; 1, no difference, is among these.")
