"""Surveys: for each question the ratings, their mean and sample standard deviation, median and range."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from cathxr.core.trials import Answer
from cathxr.study.analysis.data import StudyData, SurveyItem, SurveyScore
from cathxr.study.analysis.estimates import number, p_text
from cathxr.study.analysis.paired import ExactTest, wilcoxon


@dataclass(frozen=True)
class Row:
    """One question on one occasion. sd: the sample's (n − 1), None for one answer. ratings: by participant."""

    item: SurveyItem
    occasion: str
    ratings: tuple[tuple[str, float], ...]
    mean: float
    sd: float | None
    median: float
    low: float
    high: float

    @property
    def n(self) -> int:
        """How many answered."""
        return len(self.ratings)


@dataclass(frozen=True)
class ScoreRow:
    """A scale's scores on one occasion. interval of the mean: Student's, within the scale; None for one answer."""

    survey: str
    scale: str
    occasion: str
    n: int
    mean: float
    sd: float | None
    interval: tuple[float, float] | None
    unit: str


@dataclass(frozen=True)
class ScoreComparison:
    """One scale on two occasions, by those who have both: the exact signed-rank test and its reading."""

    survey: str
    scale: str
    first: str
    second: str
    n: int
    difference: float
    test: ExactTest | None
    reading: str


def survey_rows(answers: tuple[Answer, ...], items: tuple[SurveyItem, ...]) -> tuple[Row, ...]:
    """Return a row for each item and occasion that has ratings, in the order of the items, then of the occasions."""
    known = {(each.survey, each.item): each for each in items}
    for answer in answers:
        known.setdefault((answer.survey, answer.item), SurveyItem(answer.survey, answer.item, answer.item))
    occasions = sorted(dict.fromkeys(each.occasion for each in answers), key=_when)
    given: dict[tuple[str, str, str], list[tuple[str, float]]] = {}
    for each in answers:
        if each.value is not None:
            given.setdefault((each.survey, each.item, each.occasion), []).append((each.participant, float(each.value)))
    return tuple(
        _row(item, occasion, tuple(sorted(given[*key, occasion])))
        for key, item in known.items()
        for occasion in occasions
        if (*key, occasion) in given
    )


def _when(occasion: str) -> tuple[int, str]:
    """Return where an occasion stands in time: before everything, after a view, at the end."""
    return {"before": 0, "after": 1}.get(occasion.partition(":")[0], 2), occasion


def _row(item: SurveyItem, occasion: str, ratings: tuple[tuple[str, float], ...]) -> Row:
    values = np.array([value for _, value in ratings])
    return Row(
        item,
        occasion,
        ratings,
        float(values.mean()),
        float(values.std(ddof=1)) if len(values) > 1 else None,
        float(np.median(values)),
        float(values.min()),
        float(values.max()),
    )


def score_rows(scores: tuple[SurveyScore, ...], *, level: float = 0.95) -> tuple[ScoreRow, ...]:
    """Return a row for each scale and occasion."""
    rows = []
    found_scales = dict.fromkeys((each.survey, each.scale, each.occasion) for each in scores)
    scales = list(dict.fromkeys((survey, scale) for survey, scale, _ in found_scales))
    for survey, scale, occasion in sorted(found_scales, key=lambda each: (scales.index(each[:2]), _when(each[2]))):
        found = [each for each in scores if (each.survey, each.scale, each.occasion) == (survey, scale, occasion)]
        values = np.array([each.value for each in found])
        n, mean = len(values), float(values.mean())
        sd = float(values.std(ddof=1)) if n > 1 else None
        reach = float(stats.t.ppf(0.5 + level / 2.0, n - 1)) * sd / np.sqrt(n) if sd is not None else None
        interval = None if reach is None else (mean - reach, mean + reach)
        ends = found[0].ends
        if interval is not None and ends is not None:
            interval = max(interval[0], ends[0]), min(interval[1], ends[1])
        rows.append(ScoreRow(survey, scale, occasion, n, mean, sd, interval, found[0].unit))
    return tuple(rows)


def score_comparisons(data: StudyData, pairs: tuple[tuple[str, str], ...]) -> tuple[ScoreComparison, ...]:
    """Return each scale's comparison for each pair of occasions (first, second) that it was asked on."""
    found = []
    for survey, scale in dict.fromkeys((each.survey, each.scale) for each in data.scores):
        for first, second in pairs:
            value = {
                (each.participant, each.occasion): each.value
                for each in data.scores
                if (each.survey, each.scale) == (survey, scale)
            }
            both = sorted({code for code, _ in value if (code, first) in value and (code, second) in value})
            if len(both) >= 2:
                d = np.array([value[code, second] - value[code, first] for code in both])
                found.append(_comparison(data, survey, scale, first, second, d))
    return tuple(found)


def _comparison(data: StudyData, survey: str, scale: str, first: str, second: str, d: np.ndarray) -> ScoreComparison:
    test, difference = wilcoxon(d), float(d.mean())
    after, before = data.occasion_of(second), data.occasion_of(first)
    if test is None:
        told = f"{scale}: nobody's score differed between {before} and {after}."
    else:
        way = f"{number(abs(difference))} {'higher' if difference > 0 else 'lower'} {after} than {before} on average"
        if abs(difference) < 1e-9:
            way = f"the same {after} as {before} on average, though not for everyone"
        verdict = "" if test.p <= data.alpha else "; this study does not settle whether they differ"
        told = f"{scale} was {way} ({len(d)} participants, exact signed-rank test, {p_text(test.p)}){verdict}."
    return ScoreComparison(survey, scale, first, second, len(d), difference, test, told)
