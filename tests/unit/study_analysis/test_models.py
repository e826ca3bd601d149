"""The mixed model and the AB/BA analysis on simulated studies whose effects are known, and where they must refuse."""

import math
from dataclasses import replace

import numpy as np
import pytest
from statsmodels.regression.linear_model import OLS

from cathxr.core.trials import Outcome
from cathxr.study.analysis.censoring import censoring, success
from cathxr.study.analysis.crossover import cross_over
from cathxr.study.analysis.data import TIME, Condition, Measure, StudyData
from cathxr.study.analysis.learning import learning
from cathxr.study.analysis.mixed import mixed_model
from cathxr.study.analysis.mixed_fit import fit_random_intercept
from cathxr.study.simulate import EVERYBODY_2D_FIRST, Effects, Plan, SimulatedStudy, simulated

CONDITIONS = (Condition("2d", "2D view"), Condition("3d", "3D view"))


def _data(study: SimulatedStudy, **more: object) -> StudyData:
    return StudyData("x", CONDITIONS, study.participants, study.trials, **more)  # type: ignore[arg-type]


def test_ab_ba_recovers_view_and_practice() -> None:
    # 24 people: an estimate's standard error is below 0.05 on the log scale; 4 of them are allowed.
    effects = Effects(view=math.log(0.7), practice=math.log(0.9), sd_trial=0.15)
    model = mixed_model(_data(simulated(Plan(participants=24), effects, np.random.default_rng(1))), TIME)
    assert model.view_alone
    assert model.view is not None
    assert model.view.effect.value == pytest.approx(math.log(0.7), abs=0.1)
    assert model.of_kind("period")[0].effect.value == pytest.approx(3 * math.log(0.9), abs=0.1)
    assert model.of_kind("trial")[0].effect.value == pytest.approx(math.log(0.9), abs=0.06)
    assert (
        "30 % lower" in model.view.reading or "29 % lower" in model.view.reading or "31 % lower" in model.view.reading
    )
    assert model.sd_residual == pytest.approx(0.15, abs=0.03)


def test_few_studies_hold_both_effects_as_often_as_they_say() -> None:
    # 40 studies and 3 effects: 120 intervals, whose misses (6 expected) have a standard deviation of 2.4.
    effects = Effects()
    rng = np.random.default_rng(2)
    misses = 0
    for _ in range(40):
        model = mixed_model(_data(simulated(Plan(), effects, rng)), TIME)
        for kind, truth in (("view", effects.view), ("period", 3 * effects.practice), ("trial", effects.practice)):
            found = model.of_kind(kind)[0].effect
            misses += not found.low <= truth <= found.high
    assert misses <= 6 + 3 * 2.4


def test_2d_first_for_all_confounds_and_is_said() -> None:
    # No view effect at all: what is called the view is the practice of three trials.
    effects = Effects(view=0.0, practice=math.log(0.85), sd_trial=0.1)
    plan = Plan(participants=12, sequences=EVERYBODY_2D_FIRST)
    data = _data(simulated(plan, effects, np.random.default_rng(3)))
    model = mixed_model(data, TIME)
    assert not model.view_alone
    assert model.view is not None
    assert model.view.effect.value == pytest.approx(3 * math.log(0.85), abs=0.1)
    assert "not the view's alone" in model.reading
    assert not model.of_kind("period")
    assert cross_over(data, TIME, reference="2d", subject="3d") is None
    assert "cannot be told from the view" in learning(data, TIME).reading


def test_two_people_are_too_few_and_that_is_what_is_said() -> None:
    data = _data(simulated(Plan(participants=2, trials=1), Effects(), np.random.default_rng(5)))
    model = mixed_model(data, TIME)
    assert not model.view_alone
    assert "too few participants" in model.reading
    assert "same order" not in model.reading


def test_balanced_data_give_the_textbooks_answers() -> None:
    data = _data(simulated(Plan(participants=8), Effects(), np.random.default_rng(4)))
    model, person = mixed_model(data, TIME), cross_over(data, TIME, reference="2d", subject="3d")
    assert model.view is not None
    assert person is not None
    assert model.view.effect.value == pytest.approx(person.view.value, abs=1e-9)  # balanced: both are the same contrast
    assert model.of_kind("period")[0].effect.value == pytest.approx(person.period.value, abs=1e-9)
    assert model.view.dof == 8 * 6 - 8 - 3
    assert model.of_kind("sequence")[0].dof == 8 - 2
    # Balanced random-intercept estimates within people are those with each person's own level.
    people = np.array([[t.participant == p.code for p in data.participants] for t in data.trials], dtype=float)
    columns = [[t.condition == "3d", t.period == 2, t.number] for t in data.trials]
    fixed = OLS([math.log(t.active_s) for t in data.trials], np.column_stack([people, np.array(columns, float)])).fit()
    assert model.view.effect.value == pytest.approx(fixed.params[8], abs=1e-9)
    assert model.sd_residual == pytest.approx(math.sqrt(fixed.scale), rel=1e-3)


def test_no_difference_between_people_is_an_ordinary_regression() -> None:
    rng = np.random.default_rng(5)
    y = rng.normal(0.0, 1.0, 24)
    groups = [f"P{i // 4}" for i in range(24)]
    y -= 0.999 * np.repeat(y.reshape(6, 4).mean(axis=1), 4)
    matrix = np.column_stack([np.ones(24), np.tile([-0.5, 0.5], 12)])
    fit = fit_random_intercept(y, matrix, groups=groups, within=[False, True])
    assert fit is not None
    assert not fit.grouped
    assert fit.coefficients == pytest.approx(OLS(y, matrix).fit().params)
    assert fit_random_intercept(y[:3], matrix[:3], groups=groups[:3], within=[False, True]) is None


def test_what_cannot_be_modelled_says_why() -> None:
    study = simulated(Plan(participants=1), Effects(), np.random.default_rng(6))
    assert "at least two participants" in mixed_model(_data(study), TIME).why
    one_view = simulated(
        Plan(participants=4, conditions=("2d",), sequences=(("2d",),)), Effects(), np.random.default_rng(7)
    )
    assert mixed_model(_data(one_view), TIME).why
    none = Measure("absent", "Absent")
    assert mixed_model(_data(simulated(Plan(), Effects(), np.random.default_rng(8))), none).why


def test_trials_that_must_not_count_do_not() -> None:
    study = simulated(Plan(practice=2), Effects(), np.random.default_rng(9))
    bad = [replace(each, id=f"{each.id}-x", active_s=9999.0, invalid="a cable came loose") for each in study.trials[:3]]
    ended = replace(study.trials[-1], id="y", active_s=1.0, outcome=Outcome.ABORTED)
    with_bad = SimulatedStudy(study.participants, (*study.trials, *bad, ended))
    assert mixed_model(_data(with_bad), TIME) == mixed_model(_data(study), TIME)


def test_limit_censors_and_the_cox_model_takes_account_of_it() -> None:
    # A limit near the median of the slower view: medians and success shares follow from the simulated times.
    effects = Effects(view=math.log(0.75), practice=0.0, sd_trial=0.3, sd_person=0.2, limit_s=120.0)
    data = _data(simulated(Plan(participants=30), effects, np.random.default_rng(10)))
    found = censoring(data)
    slow, fast = found.views
    assert found.censored == sum(each.outcome is Outcome.TIMED_OUT for each in data.trials) > 20
    assert slow.share.value == pytest.approx(0.5, abs=0.16)  # 90 trials, people alike: three standard errors
    assert fast.share.value > slow.share.high
    assert fast.median_s == pytest.approx(90.0, rel=0.14)  # 1.25 x 0.36 / sqrt(90) is its standard error: three
    assert len(slow.censored_s) == slow.trials - slow.completed
    assert found.hazards
    assert found.hazards[0].log_ratio.low > 0.0
    assert "longer than the limit" in found.reading
    model = mixed_model(data, TIME)
    assert model.view is not None
    assert model.view.effect.value > math.log(0.75)  # understated, as the remark says
    assert any("time limit" in each for each in model.remarks)


def test_kaplan_meier_by_hand() -> None:
    study = simulated(Plan(participants=2), Effects(), np.random.default_rng(11))
    times = [(10.0, True), (20.0, True), (25.0, False), (30.0, True), (40.0, False)]
    trials = [
        replace(study.trials[at], active_s=time, outcome=Outcome.COMPLETED if done else Outcome.TIMED_OUT)
        for at, (time, done) in enumerate(times)
    ]
    found = success(trials, "2d")
    assert found.time_s == pytest.approx([0.0, 10.0, 20.0, 30.0])
    assert found.not_yet == pytest.approx([1.0, 0.8, 0.6, 0.3])
    assert found.median_s == 30.0
    assert (found.share.low, found.share.high) == pytest.approx((0.2307, 0.8824), abs=1e-4)  # Wilson 1927, 3 of 5


def test_nothing_cut_needs_no_model() -> None:
    found = censoring(_data(simulated(Plan(), Effects(), np.random.default_rng(12))))
    assert found.censored == 0
    assert found.hazards == ()
    assert "completed within its limit" in found.reading


def test_learning_is_found_when_orders_differ() -> None:
    effects = Effects(view=0.0, practice=math.log(0.9), sd_trial=0.1)
    found = learning(_data(simulated(Plan(participants=16), effects, np.random.default_rng(13))), TIME)
    assert found.per_doubling is not None
    assert found.per_doubling.high < 0.0
    assert [each.n for each in found.places] == [16] * 6
    assert "lower" in found.reading
