"""Surveys, the paper's Table 1, descriptions and flow, from answers and trials to numbers."""

from dataclasses import replace

import numpy as np
import pytest

from cathxr.core.trials import Answer, Participant
from cathxr.study.analysis.analyse import analyse
from cathxr.study.analysis.data import TIME, Condition, Measure, StudyData, SurveyScore
from cathxr.study.analysis.describe import by_person, described
from cathxr.study.analysis.flow import flow
from cathxr.study.analysis.paper_table import PAPER_RATINGS, PAPER_REMARK
from cathxr.study.analysis.survey_table import score_comparisons, score_rows, survey_rows
from cathxr.study.simulate import Effects, Plan, simulated

CONDITIONS = (Condition("2d", "2D view"), Condition("3d", "3D view"))
WHEN = "2026-01-05T09:00:00Z"

# Sums and squared deviations by hand: Q3 and Q4 are both 22 / 6, which the paper prints as 3.6.
TABLE_1 = {
    "q1": (15 / 6, 1.975), "q2": (16 / 6, 1.966), "q3": (22 / 6, 1.633), "q4": (22 / 6, 1.033), "q5": (20 / 6, 1.366),
    "q6": (25 / 6, 0.983), "q7": (25 / 6, 0.408), "q8": (26 / 6, 0.516), "q9": (26 / 6, 0.816), "q10": (16 / 6, 1.633),
}  # fmt: skip


def test_table_1_has_the_right_means_and_sample_deviations() -> None:
    answers = tuple(
        Answer(f"S{person}", "paper", item, "after", WHEN, float(value))
        for item, row in PAPER_RATINGS.items()
        for person, value in enumerate(row, start=1)
    )
    rows = {row.item.item: row for row in survey_rows(answers, ())}
    assert set(rows) == set(TABLE_1)
    for item, (mean, sd) in TABLE_1.items():
        assert rows[item].n == 6
        assert rows[item].mean == pytest.approx(mean)
        assert rows[item].sd == pytest.approx(sd, abs=5e-4)
    assert f"{rows['q3'].mean:.2f}" == f"{rows['q4'].mean:.2f}" == "3.67"
    assert "3.6 " in PAPER_REMARK
    assert "3.67" in PAPER_REMARK


def test_one_answer_has_no_deviation() -> None:
    (row,) = survey_rows((Answer("P01", "own", "q", "after", WHEN, 4.0),), ())
    assert (row.mean, row.sd, row.n) == (4.0, None, 1)


def test_words_are_no_ratings() -> None:
    assert survey_rows((Answer("P01", "own", "q", "after", WHEN, text="good"),), ()) == ()


def test_scores_after_both_views_are_compared_by_who_has_both() -> None:
    values = {"after:2d": (60.0, 70.0, 50.0, 80.0, 65.0, 55.0), "after:3d": (50.0, 55.0, 45.0, 60.0, 40.0, 49.0)}
    scores = [
        SurveyScore("tlx", "Workload", f"P{at:02d}", occasion, value)
        for occasion, row in values.items()
        for at, value in enumerate(row)
    ]
    scores.append(SurveyScore("tlx", "Workload", "P99", "after:2d", 99.0))
    data = StudyData("x", CONDITIONS, (), (), scores=tuple(scores))
    (found,) = score_comparisons(data, (("after:2d", "after:3d"),))
    assert found.n == 6
    assert found.difference == pytest.approx(np.mean(np.subtract(values["after:3d"], values["after:2d"])))
    assert found.test is not None
    assert found.test.p == pytest.approx(2 / 64)
    assert score_rows(tuple(scores))[0].n == 7
    even = [
        replace(each, value=float(at)) for at, each in zip((1, 2, 3, 2, 1, 3), (*scores[:3], *scores[6:9]), strict=True)
    ]
    (same,) = score_comparisons(replace(data, scores=tuple(even)), (("after:2d", "after:3d"),))
    assert "was the same after" in same.reading


def test_descriptions_are_of_what_counts_in_its_own_unit() -> None:
    study = simulated(Plan(practice=1), Effects(), np.random.default_rng(1))
    data = StudyData("x", CONDITIONS, study.participants, study.trials)
    rows = described(data, TIME)
    mine = np.array([each.active_s for each in study.trials if each.condition == "2d" and not each.practice])
    assert rows[0].mean == pytest.approx(mine.mean())
    assert rows[0].sd == pytest.approx(mine.std(ddof=1))
    assert rows[0].geometric == pytest.approx(np.exp(np.log(mine).mean()))
    assert sum(len(each.values) for each in by_person(data, TIME)) == 48


def test_flow_counts_everybody_and_every_trial() -> None:
    study = simulated(Plan(practice=1), Effects(limit_s=100.0), np.random.default_rng(2))
    waiting = Participant("P99", "", "", WHEN)
    trials = (replace(study.trials[1], invalid="wrong task"), *study.trials[:1], *study.trials[2:])
    found = flow(StudyData("x", CONDITIONS, (*study.participants, waiting), trials))
    assert found.participants == 9
    assert found.not_allocated == 1
    assert [arm.allocated for arm in found.arms] == [4, 4]
    assert found.arms[0].name == "2D view, then 3D view"
    assert found.analysed + sum(count for _, count in found.not_counted) == found.trials == len(trials)
    assert found.completed + found.timed_out == found.analysed
    assert dict(found.not_counted)["invalid: wrong task"] == 1


def test_secondary_outcomes_are_one_family_and_the_primary_is_by_itself() -> None:
    study = simulated(Plan(), Effects(), np.random.default_rng(3))
    secondary = (
        Measure("path_length", "Path length", "mm", log=True),
        Measure("sparc", "SPARC", "", "higher"),
        Measure("idle_time", "Idle time", "s", log=True),
    )
    found = analyse(StudyData("x", CONDITIONS, study.participants, study.trials, secondary=secondary))
    view = found.primary.model.view
    assert view is not None
    assert found.primary.holm_p == pytest.approx((view.p,))
    raw = [each.model.view.p for each in found.outcomes[1:] if each.model.view]
    corrected = [each.holm_p[0] for each in found.outcomes[1:]]
    assert min(corrected) == pytest.approx(min(1.0, 3 * min(raw)))
    assert all(c >= p for c, p in zip(corrected, raw, strict=True))
    assert found.power is not None
    assert found.power.smallest_p == pytest.approx(2 / 256)
