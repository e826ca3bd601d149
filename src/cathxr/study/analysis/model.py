"""What a fitted model of an outcome says: its terms with intervals and readings, and what a reader must know."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.design_matrix import Column, DesignMatrix, design_matrix
from cathxr.study.analysis.estimates import (
    Estimate,
    change_text,
    comparison_reading,
    in_sentence,
    p_text,
    range_text,
    verb_of,
)
from cathxr.study.analysis.mixed_fit import Fit
from cathxr.study.analysis.observations import Observations

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


@dataclass(frozen=True)
class Term:
    """One fixed effect with its interval, p and degrees of freedom, on the measure's scale, and its plain reading."""

    column: Column
    effect: Estimate
    p: float
    dof: float
    reading: str


@dataclass(frozen=True)
class Model:
    """The fitted model. kind: "mixed", see `mixed.py`, or "counts", see `counts.py`.

    measure: with the scale that the effects are on; of counts that is the logarithm. doubt: why the view cannot be told
    from period and practice here, and then holds both; "" else. sd_participant, sd_residual: on the measure's scale;
    None for counts. censored: how many of the trials the time limit cut; they are in the model with the limit as their
    time. remarks: what a reader must know; why: why there is no model, then no terms.
    """

    kind: Literal["mixed", "counts"]
    measure: Measure
    terms: tuple[Term, ...]
    participants: int
    trials: int
    censored: int
    missing: int
    doubt: str
    remarks: tuple[str, ...]
    sd_participant: float | None = None
    sd_residual: float | None = None
    why: str = ""

    def of_kind(self, kind: str) -> tuple[Term, ...]:
        """Return the terms of a kind, such as "view"."""
        return tuple(each for each in self.terms if each.column.kind == kind)

    @property
    def name(self) -> str:
        """What the model is called within a text."""
        return "mixed model" if self.kind == "mixed" else "model for counts"

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


def without_model(kind: Literal["mixed", "counts"], observed: Observations, measure: Measure, why: str) -> Model:
    """Return that there is no model of these observations, and why."""
    return Model(kind, measure, (), *_sizes(observed), doubt=TOO_FEW, remarks=(), why=why)


def told_model(
    kind: Literal["mixed", "counts"],
    observed: Observations,
    data: StudyData,
    *,
    measure: Measure,
    columns: DesignMatrix,
    fit: Fit,
    left_out: Sequence[str],
    remarks: Sequence[str],
) -> Model:
    """Return the model that was fitted to the observations, told in words. left_out: kinds of terms, for want of data.

    Where sequence is left out by the kind of model, and not for want of data, it is not in `left_out`.
    """
    told: list[str] = []
    if left_out:
        told.append(f"Too few participants or trials to estimate {', '.join(left_out)}: left out of this model.")
    if columns.dropped:
        told.append(f"Cannot be told from the terms before: {', '.join(columns.dropped)}.")
    told += remarks
    if observed.missing:
        told.append(
            f"{observed.missing} counted trials have no value of {in_sentence(measure.name)} and are not in it."
        )
    level = 1.0 - data.alpha
    doubt = CONFOUNDED if not design_matrix(observed, data).view_alone else TOO_FEW if "period" in left_out else ""
    reference = next(each.name for each in data.conditions if any(t.condition == each.key for t in observed.trials))
    terms = []
    for at, column in enumerate(columns.columns, start=1):
        effect, p = fit.estimate(at, level), fit.p(at)
        reading = _reading(column, effect, p, measure, reference=reference, alone=not doubt)
        terms.append(Term(column, effect, p, float(fit.dof[at]), reading))
    spreads = (fit.sd_participant, fit.sd_residual) if kind == "mixed" else (None, None)
    return Model(kind, measure, tuple(terms), *_sizes(observed), doubt, tuple(told), *spreads)


def _sizes(observed: Observations) -> tuple[int, int, int, int]:
    """Return how many participants and trials there are, how many were cut, and how many have no value."""
    cut = int(np.count_nonzero(observed.censored))
    return len(observed.participants), len(observed.trials), cut, observed.missing


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
