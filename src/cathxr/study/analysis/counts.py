"""The model for counts, such as breaches or targets reached: rates compared as ratios, with errors that are robust.

A Poisson regression by generalised estimating equations (Liang and Zeger 1986, Biometrika 73:13), people as clusters,
working independence: only the mean is taken for granted, so that counts may spread more or less than Poisson's. The
covariance is Mancl and DeRouen's (2001, Biometrics 57:126), and intervals are Student's with people − columns degrees
of freedom: the plain robust error and the normal distribution find, of eight people, a difference where there is none
in 14 of 100 studies instead of 5 (docs/statistics.md has the figures).
"""

import warnings
from dataclasses import replace

import numpy as np
from statsmodels.genmod.cov_struct import Independence
from statsmodels.genmod.families import Poisson
from statsmodels.genmod.generalized_estimating_equations import GEE

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.design_matrix import design_matrix
from cathxr.study.analysis.mixed import model_of
from cathxr.study.analysis.mixed_fit import Fit
from cathxr.study.analysis.model import Model, told_model, without_model
from cathxr.study.analysis.observations import Observations, observations

_LARGEST_ERROR = 10.0
"""Of a coefficient on the log scale: beyond it the counts say nothing about that term."""


def outcome_model(data: StudyData, measure: Measure) -> Model:
    """Return the model of a measure over the trials that count: the one for counts, or the mixed model."""
    observed = observations(data, measure)
    return count_model_of(observed, data) if measure.count else model_of(observed, data)


def count_model_of(observed: Observations, data: StudyData) -> Model:
    """Return the model for counts of these observations; its effects are logarithms of ratios.

    Raises:
        ValueError: a value is no count.
    """
    measure, y = replace(observed.measure, log=True), observed.y
    if len(y) and (float(y.min()) < 0.0 or bool((y != np.round(y)).any())):
        raise ValueError(f"{measure.key}: expected whole numbers of at least 0")
    if len(observed.participants) < 2 or len({each.condition for each in observed.trials}) < 2:
        why = f"{measure.name}: needs at least two participants and two views with data."
        return without_model("counts", observed, measure, why)
    if float(np.ptp(y)) == 0.0:
        why = f"{measure.name}: every trial has the same number, {y[0]:.0f}, so there is nothing to compare."
        return without_model("counts", observed, measure, why)
    empty = _views_without(observed, data)
    if empty:
        why = f"{measure.name}: none at all with {', '.join(empty)}, so that no ratio can be given; see the exact test."
        return without_model("counts", observed, measure, why)
    left_out: list[str] = []
    for left_out in ([], ["trial"], ["period", "trial"]):
        columns = design_matrix(observed, data, without=["sequence", *left_out])
        fit = _fit(y, columns.matrix, [each.participant for each in observed.trials])
        if fit is not None:
            return told_model(
                "counts", observed, data, measure=measure, columns=columns, fit=fit, left_out=left_out, remarks=()
            )
    return without_model("counts", observed, measure, f"{measure.name}: too few people or counts for the model.")


def _views_without(observed: Observations, data: StudyData) -> list[str]:
    """Return the names of views in which nothing at all was counted."""
    totals: dict[str, float] = {}
    for trial, value in zip(observed.trials, observed.y, strict=True):
        totals[trial.condition] = totals.get(trial.condition, 0.0) + float(value)
    return [data.name_of(key) for key, total in totals.items() if total == 0.0]


def _fit(y: FloatArray, matrix: FloatArray, groups: list[str]) -> Fit | None:
    """Return the fit of counts y (N,) on matrix (N, P); None where there are too few people or no finite estimate."""
    people = len(set(groups))
    dof = people - matrix.shape[1]
    if dof < 1:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of iterations that do not settle, which is looked at below
        try:
            model = GEE(y, matrix, groups=np.asarray(groups), family=Poisson(), cov_struct=Independence())
            result = model.fit(cov_type="bias_reduced", maxiter=100)
        except (np.linalg.LinAlgError, ValueError):
            return None
        coefficients = np.asarray(result.params, dtype=np.float64)
        errors = np.asarray(result.bse, dtype=np.float64)
    settled = bool(result.converged) and bool(np.isfinite(coefficients).all()) and bool(np.isfinite(errors).all())
    if not settled or float(errors.max()) > _LARGEST_ERROR or float(np.abs(coefficients).max()) > _LARGEST_ERROR:
        return None
    return Fit(coefficients, errors, np.full(len(coefficients), float(dof)), 0.0, 0.0, False)
