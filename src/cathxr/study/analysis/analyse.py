"""The whole analysis of a study in one call: what the report shows."""

from dataclasses import dataclass

import numpy as np

from cathxr.study.analysis.censoring import Censoring, censoring
from cathxr.study.analysis.counts import outcome_model
from cathxr.study.analysis.crossover import CrossOver, cross_over
from cathxr.study.analysis.data import Condition, Measure, StudyData
from cathxr.study.analysis.describe import Described, described
from cathxr.study.analysis.effect import EffectSizes, effect_sizes
from cathxr.study.analysis.flow import Flow, flow
from cathxr.study.analysis.groups import Groups, groups
from cathxr.study.analysis.interaction import Interaction, interaction
from cathxr.study.analysis.learning import Learning, learning
from cathxr.study.analysis.mixed import mixed_model
from cathxr.study.analysis.model import Model
from cathxr.study.analysis.multiple import holm
from cathxr.study.analysis.paired import Differences, ExactTest, differences, permutation, wilcoxon
from cathxr.study.analysis.power import Power, power_of
from cathxr.study.analysis.survey_table import (
    Row,
    ScoreComparison,
    ScoreRow,
    score_comparisons,
    score_rows,
    survey_rows,
)


@dataclass(frozen=True)
class Comparison:
    """One view against the reference, by participant. cross_over: None where not everybody had one view a period."""

    reference: Condition
    subject: Condition
    differences: Differences
    wilcoxon: ExactTest | None
    permutation: ExactTest | None
    effects: EffectSizes | None
    cross_over: CrossOver | None


@dataclass(frozen=True)
class OutcomeResult:
    """One measure: described, modelled, compared. holm_p: for each of the model's view terms its p, corrected by Holm.

    The primary measure's family is its own views (one p stays as it is); the secondary measures and views are another.
    """

    measure: Measure
    primary: bool
    described: tuple[Described, ...]
    model: Model
    comparisons: tuple[Comparison, ...]
    holm_p: tuple[float, ...]


@dataclass(frozen=True)
class Analysis:
    """Everything that the report shows. uncut: the primary model without trials that the limit cut, if any were.

    groups: None where fewer than two groups have trials that count. interaction: of view and period, of the primary
    measure; None outside AB/BA studies.
    """

    data: StudyData
    flow: Flow
    outcomes: tuple[OutcomeResult, ...]
    uncut: Model | None
    censoring: Censoring
    learning: Learning
    power: Power | None
    survey: tuple[Row, ...]
    scores: tuple[ScoreRow, ...]
    score_comparisons: tuple[ScoreComparison, ...]
    groups: Groups | None
    interaction: Interaction | None

    @property
    def primary(self) -> OutcomeResult:
        """The result that the study was made for."""
        return self.outcomes[0]


def analyse(data: StudyData) -> Analysis:
    """Return the analysis. The primary measure is tested by itself; Holm's correction goes over the secondary ones."""
    rng = np.random.default_rng(data.seed)
    measures = (data.primary, *data.secondary)
    models = [outcome_model(data, each) for each in measures]
    corrected = [*_corrected(models[:1]), *_corrected(models[1:])]
    outcomes = tuple(
        OutcomeResult(
            measure, at == 0, described(data, measure), models[at], _comparisons(data, measure, rng), corrected[at]
        )
        for at, measure in enumerate(measures)
    )
    cut = censoring(data)
    first = outcomes[0].comparisons[0] if outcomes[0].comparisons else None
    power = None
    if first is not None and len(first.differences.d) >= 2:
        spread = float(first.differences.d.std(ddof=1))
        power = power_of(data.primary, n=len(first.differences.d), sd_differences=spread, alpha=data.alpha)
    return Analysis(
        data,
        flow(data),
        outcomes,
        mixed_model(data, data.primary, uncut=True) if cut.censored and data.primary.key == "t" else None,
        cut,
        learning(data, data.primary),
        power,
        survey_rows(data.answers, data.items),
        score_rows(data.scores, level=1.0 - data.alpha),
        score_comparisons(data, _occasion_pairs(data)),
        groups(data),
        interaction(data, data.primary),
    )


def _corrected(family: list[Model]) -> list[tuple[float, ...]]:
    """Return the corrected p of every view term, model by model."""
    left = list(holm([term.p for model in family for term in model.of_kind("view")]))
    return [tuple(left.pop(0) for _ in model.of_kind("view")) for model in family]


def _comparisons(data: StudyData, measure: Measure, rng: np.random.Generator) -> tuple[Comparison, ...]:
    reference = data.conditions[0]
    found = []
    for subject in data.conditions[1:]:
        keys = {"reference": reference.key, "subject": subject.key}
        pairs = differences(data, measure, **keys)
        found.append(
            Comparison(
                reference,
                subject,
                pairs,
                wilcoxon(pairs.d),
                permutation(pairs.d, rng=rng),
                effect_sizes(pairs.d, level=1.0 - data.alpha),
                cross_over(data, measure, **keys),
            )
        )
    return tuple(found)


def _occasion_pairs(data: StudyData) -> tuple[tuple[str, str], ...]:
    """Return the occasions to compare: after the reference view and after each other."""
    reference = data.conditions[0].key
    return tuple((f"after:{reference}", f"after:{each.key}") for each in data.conditions[1:])
