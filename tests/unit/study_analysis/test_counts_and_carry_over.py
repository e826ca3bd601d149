"""The model for counts and view x period, on simulated studies whose effects are known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cathxr.study.analysis.analyse import analyse
from cathxr.study.analysis.counts import outcome_model
from cathxr.study.analysis.crossover import cross_over
from cathxr.study.analysis.data import TIME, Condition, Measure, StudyData
from cathxr.study.analysis.interaction import interaction
from cathxr.study.simulate import EVERYBODY_2D_FIRST, Effects, Plan, simulated

CONDITIONS = (Condition("2d", "2D view"), Condition("3d", "3D view"))
BREACHES = Measure("breach_count", "Virtual wall breaches", "", "lower", count=True)


def _data(effects: Effects, seed: int, *, people: int = 8, **plan: object) -> StudyData:
    study = simulated(Plan(participants=people, **plan), effects, np.random.default_rng(seed))  # type: ignore[arg-type]
    return StudyData("x", CONDITIONS, study.participants, study.trials)


def _counted(data: StudyData, ratio: float, mean: float, rng: np.random.Generator) -> StudyData:
    """Return the data with breaches that spread more than Poisson's, `ratio` times as many in 3D, people unlike."""
    level = {each.code: mean * math.exp(rng.normal(0.0, 0.5)) for each in data.participants}
    trials = []
    for each in data.trials:
        rate = level[each.participant] * (ratio if each.condition == "3d" else 1.0) * rng.gamma(4.0, 0.25)
        trials.append(replace(each, measures={"breach_count": float(rng.poisson(rate))}))
    return replace(data, trials=tuple(trials))


def test_a_ratio_of_counts_is_found() -> None:
    # 40 people x 3 trials a view, 4 breaches a trial: standard error of the log ratio about 0.09; four are allowed.
    data = _counted(_data(Effects(), 1, people=40), 0.5, 4.0, np.random.default_rng(2))
    model = outcome_model(data, BREACHES)
    assert model.view is not None
    assert model.kind == "counts"
    assert model.view.effect.value == pytest.approx(math.log(0.5), abs=0.36)
    assert model.view.effect.high < 0.0
    assert "fewer than with 2D view" in model.reading
    assert "in favour of 3D view" in model.reading
    # Balanced orders: the ratio is nearly that of the plain means (the period's and the trial's terms hardly move it).
    means = {
        key: np.mean([each.measures["breach_count"] for each in data.trials if each.condition == key])
        for key in ("2d", "3d")
    }
    assert model.view.effect.value == pytest.approx(math.log(means["3d"] / means["2d"]), abs=0.1)


def test_eight_people_are_not_told_of_differences_that_are_not_there() -> None:
    # 100 studies without an effect: at 5 %, 5 +- 2.2 (binomial); the plain robust error with normal quantiles has 14.
    rng, wrong, held = np.random.default_rng(3), 0, 0
    base = _data(Effects(), 4)
    for _ in range(100):
        view = outcome_model(_counted(base, 1.0, 2.0, rng), BREACHES).view
        assert view is not None
        assert view.dof == 8 - 4
        wrong += view.p <= 0.05
        held += view.effect.low <= 0.0 <= view.effect.high
    assert wrong <= 5 + 2 * 2.2
    assert held >= 95 - 2 * 2.2


def test_no_ratio_where_a_view_has_none_and_the_exact_test_is_there() -> None:
    data = _counted(_data(Effects(), 5), 0.0, 3.0, np.random.default_rng(6))
    found = analyse(replace(data, secondary=(BREACHES,))).outcomes[1]
    assert "none at all with 3D view" in found.model.reading
    assert found.holm_p == ()
    assert found.comparisons[0].wilcoxon is not None
    assert found.comparisons[0].wilcoxon.p == pytest.approx(2 / 2**8)


def test_counts_that_are_none_or_all_alike() -> None:
    data = _data(Effects(), 7)
    alike = replace(data, trials=tuple(replace(each, measures={"breach_count": 2.0}) for each in data.trials))
    assert "the same number, 2" in outcome_model(alike, BREACHES).why
    halves = replace(data, trials=tuple(replace(each, measures={"breach_count": 0.5}) for each in data.trials))
    with pytest.raises(ValueError, match="whole numbers"):
        outcome_model(halves, BREACHES)
    few = _counted(_data(Effects(), 8, people=3), 0.5, 4.0, np.random.default_rng(9))
    assert not outcome_model(few, BREACHES).view_alone


def test_a_carry_over_is_found_and_told() -> None:
    # Every trial after 2D takes 0.6 times as long. 60 people whose sums over both periods spread by 0.29 (twice 0.1,
    # and noise): the standard error of the change is 0.074.
    left = math.log(0.6)
    data = _data(Effects(carry_over=left, sd_person=0.1), 10, people=60)
    found = interaction(data, TIME)
    assert found is not None
    assert found.change.value == pytest.approx(left, abs=4 * 0.074)
    assert found.change.high < 0.0
    assert found.first.low <= math.log(0.75) <= found.first.high  # the first period is free of it
    assert "(carry-over)" in found.reading
    assert "only the first period" in found.reading


def test_view_by_period_is_the_carry_over_of_the_textbook() -> None:
    data = _data(Effects(), 11)
    found, person = interaction(data, TIME), cross_over(data, TIME, reference="2d", subject="3d")
    assert found is not None
    assert person is not None
    assert found.change.value == pytest.approx(person.carry_over.value, abs=1e-6)
    assert found.p == pytest.approx(person.carry_over_p, abs=1e-5)
    assert found.dof == 6.0
    assert found.second.value - found.first.value == pytest.approx(found.change.value, abs=1e-6)
    assert "not ruled out" in found.reading


def test_where_there_is_no_view_by_period() -> None:
    assert interaction(_data(Effects(), 12, sequences=EVERYBODY_2D_FIRST), TIME) is None
    assert interaction(_data(Effects(), 13, people=3), TIME) is None
