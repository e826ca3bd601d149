"""From a study's design and what was gathered to what the analysis takes: rules applied, surveys scored."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from cathxr.core.trials import Answer, Participant, TrialRecord
from cathxr.study.analysis.data import TIME, Condition, Measure, StudyData, SurveyItem, SurveyScore
from cathxr.study.design import StudyDesign
from cathxr.study.exclusion import MARKED, judged
from cathxr.study.surveys import Kind, Survey, scores_of

REACHED = Measure("nT", "Targets reached", "", "higher", count=True)
_RATIOS = ("s", "mm", "deg", "mm/s")
"""Units of measures that cannot be negative, so that views are compared by ratios where no trial has a 0."""
_COUNTS = ("misses", "rotation_actions", "translation_actions", "breach_count")
"""Metrics that count something, beside the targets reached."""


def measure_of(
    key: str,
    *,
    name: str,
    unit: str,
    better: Literal["lower", "higher", "neither"],
    trials: Iterable[TrialRecord],
) -> Measure:
    """Return a metric as a measure: a count; or a ratio, where its unit has a true zero and every value is above 0."""
    if key == "t":
        return TIME
    if key == "nT":
        return REACHED
    values = [each.measures[key] for each in trials if key in each.measures]
    if key in _COUNTS:
        return Measure(key, name, unit, better, count=True)
    return Measure(key, name, unit, better, log=unit in _RATIOS and bool(values) and min(values) > 0.0)


def study_data(
    design: StudyDesign,
    *,
    participants: Sequence[Participant],
    trials: Sequence[TrialRecord],
    answers: Sequence[Answer],
    surveys: Mapping[str, Survey],
    measures: Mapping[str, Measure],
    seed: int,
    changes: Sequence[str] = (),
) -> StudyData:
    """Return the study's data. A trial that the design's rules take out is invalid, with the rule as its reason.

    measures: by key, for the design's primary and secondary ones; one that is not there gets its key as its name.
    """
    out = {each.trial.id: each for each in judged(design, trials).excluded if each.rule != MARKED}
    ruled = tuple(
        replace(each, invalid=f"rule {out[each.id].rule}: {out[each.id].reason}") if each.id in out else each
        for each in trials
    )
    asked = {each.survey for each in design.surveys} | {each.survey for each in answers}
    chosen = [surveys[key] for key in surveys if key in asked]
    return StudyData(
        design.title,
        tuple(Condition(each.key, each.name) for each in design.conditions),
        tuple(participants),
        ruled,
        tuple(answers),
        primary=measures.get(design.primary, Measure(design.primary, design.primary, "", "neither")),
        secondary=tuple(measures.get(each, Measure(each, each, "", "neither")) for each in design.secondary),
        items=tuple(item for survey in chosen for item in _items(survey)),
        scores=tuple(score for survey in chosen for score in _scores(survey, answers)),
        rules=tuple(each.sentence for each in design.exclusions),
        changes=tuple(changes),
        seed=seed,
    )


def _items(survey: Survey) -> list[SurveyItem]:
    found = []
    for each in survey.items:
        low, high = (each.minimum, each.maximum) if each.kind is Kind.RATING else (None, None)
        found.append(SurveyItem(survey.key, each.key, each.text, low, high, survey.name))
    return found


def _scores(survey: Survey, answers: Sequence[Answer]) -> list[SurveyScore]:
    named = {each.key: each for each in survey.scores}
    found = []
    for each in scores_of(survey, answers):
        if each.value is not None:
            score = named[each.score]
            better: Literal["lower", "higher", "neither"] = "neither"
            if score.better == "lower":
                better = "lower"
            elif score.better == "higher":
                better = "higher"
            span = f"{score.minimum:g} to {score.maximum:g}"
            ends = (score.minimum, score.maximum)
            found.append(
                SurveyScore(survey.key, score.name, each.participant, each.occasion, each.value, span, better, ends)
            )
    return found
