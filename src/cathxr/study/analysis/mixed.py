"""The primary model: measure ~ view + period + sequence + trial, with an intercept for each participant."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.design_matrix import Column, design_matrix
from cathxr.study.analysis.estimates import (
    Estimate,
    change_text,
    comparison_reading,
    in_sentence,
    p_text,
    range_text,
    verb_of,
)
from cathxr.study.analysis.mixed_fit import fit_random_intercept
from cathxr.study.analysis.observations import Observations, observations


@dataclass(frozen=True)
class Term:
    """One fixed effect with its interval, p and degrees of freedom, on the measure's scale, and its plain reading."""

    column: Column
    effect: Estimate
    p: float
    dof: float
    reading: str


@dataclass(frozen=True)
class MixedModel:
    """The fitted model. doubt: why the view cannot be told from period and practice here, and then holds both; "" else.

    sd_participant, sd_residual: on the measure's scale. censored: how many of the trials the time limit cut; they are
    in the model with the limit as their time. remarks: what a reader must know; why: why there is no model, then no
    terms.
    """

    measure: Measure
    terms: tuple[Term, ...]
    sd_participant: float
    sd_residual: float
    participants: int
    trials: int
    censored: int
    missing: int
    doubt: str
    remarks: tuple[str, ...]
    why: str = ""

    def of_kind(self, kind: str) -> tuple[Term, ...]:
        """Return the terms of a kind, such as "view"."""
        return tuple(each for each in self.terms if each.column.kind == kind)

    @property
    def view_alone(self) -> bool:
        """Whether the view's terms are the view's alone."""
        return not self.doubt

    @property
    def view(self) -> Term | None:
        """The first condition's contrast with the reference, None without one."""
        views = self.of_kind("view")
        return views[0] if views else None

    @property
    def reading(self) -> str:
        """The model's main result in plain words."""
        if self.why:
            return self.why
        return " ".join(each.reading for each in self.of_kind("view")) + (f" {self.doubt}" if self.doubt else "")


CONFOUNDED = (
    "This difference is not the view's alone: everybody had the views in the same order, or nobody has had both. So "
    "what looks like the view may be practice, tiredness, or other people. No statistics can separate them afterwards; "
    "half of the participants must begin with the other view."
)
"""The design's fault."""
TOO_FEW = (
    "This difference may be practice as well as the view: there are too few participants or trials here to tell them "
    "apart."
)


def mixed_model(data: StudyData, measure: Measure, *, uncut: bool = False) -> MixedModel:
    """Return the model of `measure` over the trials that count. uncut: leave out those that the time limit cut."""
    observed = observations(data, measure)
    if uncut:
        observed = observed.where(~observed.censored)
    return model_of(observed, data)


def model_of(observed: Observations, data: StudyData) -> MixedModel:
    """Return the model of these observations."""
    measure, groups = observed.measure, [each.participant for each in observed.trials]
    common: dict[str, Any] = {
        "participants": len(set(groups)),
        "trials": len(groups),
        "censored": int(np.count_nonzero(observed.censored)),
        "missing": observed.missing,
    }

    def without_model(why: str) -> MixedModel:
        return MixedModel(measure, (), 0.0, 0.0, **common, doubt=TOO_FEW, remarks=(), why=why)

    if len(set(groups)) < 2 or len({each.condition for each in observed.trials}) < 2:
        return without_model(f"{measure.name}: needs at least two participants and two views with data.")
    if float(np.ptp(observed.y)) == 0.0:
        return without_model(f"{measure.name}: every trial has the same value, so there is nothing to compare.")
    remarks: list[str] = []
    left_out: list[str] = []
    for left_out in ([], ["sequence"], ["sequence", "period", "trial"]):
        columns = design_matrix(observed, data, without=left_out)
        fit = fit_random_intercept(
            observed.y, columns.matrix, groups=groups, within=[False, *(each.within for each in columns.columns)]
        )
        if fit is not None:
            break
    else:
        return without_model(f"{measure.name}: too few trials for the model.")
    if left_out:
        remarks.append(f"Too few participants or trials to estimate {', '.join(left_out)}: left out of this model.")
    if columns.dropped:
        remarks.append(f"Cannot be told from the terms before: {', '.join(columns.dropped)}.")
    if not fit.grouped:
        remarks.append("Participants did not differ more than their own trials did: an ordinary regression.")
    if common["censored"]:
        remarks.append(
            f"{common['censored']} of {len(groups)} trials ended by the time limit and are in the model with the limit "
            "as their time: differences are rather under- than overstated (see the analysis of targets not reached)."
        )
    if observed.missing:
        remarks.append(
            f"{observed.missing} counted trials have no value of {in_sentence(measure.name)} and are not in it."
        )
    level = 1.0 - data.alpha
    doubt = CONFOUNDED if not design_matrix(observed, data).view_alone else TOO_FEW if "period" in left_out else ""
    terms = []
    reference = next(each.name for each in data.conditions if any(t.condition == each.key for t in observed.trials))
    for at, column in enumerate(columns.columns, start=1):
        effect, p = fit.estimate(at, level), fit.p(at)
        terms.append(
            Term(
                column,
                effect,
                p,
                float(fit.dof[at]),
                _reading(column, effect, p, measure, reference=reference, alone=not doubt),
            )
        )
    return MixedModel(
        measure, tuple(terms), fit.sd_participant, fit.sd_residual, **common, doubt=doubt, remarks=tuple(remarks)
    )


def _reading(column: Column, effect: Estimate, p: float, measure: Measure, *, reference: str, alone: bool) -> str:
    if column.kind == "view":
        return comparison_reading(effect, measure, subject=column.level, reference=reference, conclude=alone)
    subject = {
        "period": f"In period {column.level}, whatever the view",
        "trial": "With each further trial in the same view",
        "sequence": f"In the group with {column.level}",
        "task": f"In the task {column.level}",
    }[column.kind]
    told = f"{subject}, {in_sentence(measure.name)} {verb_of(measure.name)} {change_text(effect.value, measure)}"
    span = f"({range_text(effect, measure)}; {p_text(p)})"
    open_end = "" if effect.excludes_zero else "; no change at all is possible too"
    return f"{told} {span}{open_end}."
