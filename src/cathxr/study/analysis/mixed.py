"""The primary model: measure ~ view + period + sequence + trial, with an intercept for each participant."""

import numpy as np

from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.design_matrix import design_matrix
from cathxr.study.analysis.mixed_fit import fit_random_intercept
from cathxr.study.analysis.model import Model, told_model, without_model
from cathxr.study.analysis.observations import Observations, observations


def mixed_model(data: StudyData, measure: Measure, *, uncut: bool = False) -> Model:
    """Return the model of `measure` over the trials that count. uncut: leave out those that the time limit cut."""
    observed = observations(data, measure)
    if uncut:
        observed = observed.where(~observed.censored)
    return model_of(observed, data)


def model_of(observed: Observations, data: StudyData) -> Model:
    """Return the model of these observations."""
    measure, groups = observed.measure, [each.participant for each in observed.trials]
    if len(set(groups)) < 2 or len({each.condition for each in observed.trials}) < 2:
        why = f"{measure.name}: needs at least two participants and two views with data."
        return without_model("mixed", observed, measure, why)
    if float(np.ptp(observed.y)) == 0.0:
        why = f"{measure.name}: every trial has the same value, so there is nothing to compare."
        return without_model("mixed", observed, measure, why)
    left_out: list[str] = []
    for left_out in ([], ["sequence"], ["sequence", "period", "trial"]):
        columns = design_matrix(observed, data, without=left_out)
        fit = fit_random_intercept(
            observed.y, columns.matrix, groups=groups, within=[False, *(each.within for each in columns.columns)]
        )
        if fit is not None:
            break
    else:
        return without_model("mixed", observed, measure, f"{measure.name}: too few trials for the model.")
    remarks: list[str] = []
    if not fit.grouped:
        remarks.append("Participants did not differ more than their own trials did: an ordinary regression.")
    cut = int(np.count_nonzero(observed.censored))
    if cut:
        remarks.append(
            f"{cut} of {len(groups)} trials ended by the time limit and are in the model with the limit "
            "as their time: differences are rather under- than overstated (see the analysis of targets not reached)."
        )
    return told_model(
        "mixed", observed, data, measure=measure, columns=columns, fit=fit, left_out=left_out, remarks=remarks
    )
