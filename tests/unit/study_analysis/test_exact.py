"""Exact tests against enumeration and SciPy, Holm against its definition, effect sizes against their duals."""

from itertools import combinations, product

import numpy as np
import pytest
from scipy import stats

from cathxr.study.analysis.crossover import cross_over
from cathxr.study.analysis.data import TIME, Condition, Measure, StudyData
from cathxr.study.analysis.effect import effect_sizes, hodges_lehmann, standardised
from cathxr.study.analysis.multiple import holm
from cathxr.study.analysis.paired import permutation, smallest_p, smallest_p_reading, wilcoxon
from cathxr.study.analysis.power import detectable_difference, participants_needed, power_of
from cathxr.study.simulate import Effects, Plan, simulated

SAMPLES = [
    np.array([1.2, -0.4, 2.2, 0.9, 3.1, 0.3]),
    np.array([1.0, 1.0, -1.0, 2.0, 2.0, 3.0, -4.0]),  # ties
    np.array([0.0, 1.5, -0.5, 2.5, 0.0, 1.5]),  # zeros and a tie
    np.array([-3.0, -1.0, -2.0, -4.0, -5.0]),
]


def _wilcoxon_by_hand(d: np.ndarray) -> float:
    moved = d[d != 0.0]
    ranks = stats.rankdata(np.abs(moved))
    middle = ranks.sum() / 2.0
    seen = abs(ranks[moved > 0].sum() - middle)
    sums = np.array([np.dot(ranks, signs) for signs in product((0.0, 1.0), repeat=len(moved))])
    return float(np.mean(np.abs(sums - middle) >= seen - 1e-9))


def _permutation_by_hand(d: np.ndarray) -> float:
    means = np.array([np.dot(d, signs) for signs in product((-1.0, 1.0), repeat=len(d))])
    return float(np.mean(np.abs(means) >= abs(d.sum()) - 1e-9))


@pytest.mark.parametrize("d", SAMPLES)
def test_wilcoxon_is_the_enumerated_one(d: np.ndarray) -> None:
    found = wilcoxon(d)
    assert found is not None
    assert found.exact
    assert found.p == pytest.approx(_wilcoxon_by_hand(d))


def test_wilcoxon_without_ties_is_the_enumerated_one_too() -> None:
    rng = np.random.default_rng(1)
    for n in (5, 8, 12, 15):
        d = rng.normal(0.4, 1.0, n)
        found = wilcoxon(d)
        assert found is not None
        assert found.p == pytest.approx(_wilcoxon_by_hand(d))


def test_wilcoxon_says_when_it_is_an_approximation() -> None:
    d = np.repeat([1.0, 2.0, -1.0, 3.0, 1.5], 4)
    found = wilcoxon(d)
    assert found is not None
    assert not found.exact


@pytest.mark.parametrize("d", SAMPLES)
def test_permutation_is_the_enumerated_one(d: np.ndarray) -> None:
    found = permutation(d, rng=np.random.default_rng(0))
    assert found is not None
    assert found.exact
    assert found.p == pytest.approx(_permutation_by_hand(d))


def test_nothing_moved_gives_no_test() -> None:
    assert wilcoxon(np.zeros(6)) is None
    assert permutation(np.zeros(6), rng=np.random.default_rng(0)) is None


def test_one_that_moved_can_show_nothing() -> None:
    d = np.array([0.0, 0.0, 3.0])
    for found in (wilcoxon(d), permutation(d, rng=np.random.default_rng(0))):
        assert found is not None
        assert (found.p, found.smallest_p, found.n) == (1.0, 1.0, 1)


def test_six_people_give_at_best_0_031_and_it_is_said() -> None:
    best = wilcoxon(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    assert best is not None
    assert best.p == pytest.approx(2.0 / 64.0)
    assert best.smallest_p == pytest.approx(0.03125)
    told = smallest_p_reading(6, 0.05)
    assert "6 participants" in told
    assert "0.031" in told
    assert "every single participant" in told
    assert "cannot reach 0.05" in smallest_p_reading(5, 0.05)
    assert smallest_p(1) == 1.0


def test_holm_is_its_definition() -> None:
    # Sorted 0.01, 0.02, 0.03, 0.04: times 4, 3, 2, 1, never falling.
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx((0.06, 0.04, 0.06, 0.06))
    assert holm([0.5, 0.9]) == pytest.approx((1.0, 1.0))
    assert holm([]) == ()


def test_hodges_lehmann_holds_what_the_exact_test_does_not_reject() -> None:
    rng = np.random.default_rng(2)
    for n in (6, 7, 9, 12):
        d = rng.normal(0.5, 1.0, n)
        found = hodges_lehmann(d)
        assert found is not None
        assert stats.wilcoxon(d - (found.low + 1e-6), method="exact").pvalue > 0.05
        assert stats.wilcoxon(d - (found.low - 1e-6), method="exact").pvalue <= 0.05
        assert stats.wilcoxon(d - (found.high - 1e-6), method="exact").pvalue > 0.05
        assert stats.wilcoxon(d - (found.high + 1e-6), method="exact").pvalue <= 0.05
    assert hodges_lehmann(np.arange(1.0, 6.0)) is None


def test_standardised_interval_is_the_noncentral_ones() -> None:
    d = np.random.default_rng(3).normal(0.8, 1.0, 10)
    found = standardised(d)
    assert found is not None
    t = d.mean() / d.std(ddof=1) * np.sqrt(10)
    correction = found.value / (t / np.sqrt(10))
    assert correction == pytest.approx(1.0 - 3.0 / (4.0 * 9.0 - 1.0), abs=2e-3)  # Hedges' own approximation
    for end, share in ((found.low, 0.975), (found.high, 0.025)):
        assert stats.nct.cdf(t, 9, end / correction * np.sqrt(10)) == pytest.approx(share, abs=1e-5)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    # 400 samples: a share of 0.95 has a standard error of 0.011; three of them are allowed.
    rng = np.random.default_rng(4)
    hits = np.zeros(3)
    for _ in range(400):
        found = effect_sizes(rng.normal(0.6, 1.0, 9))
        assert found is not None
        assert found.middle is not None
        assert found.standardised is not None
        unbiased = found.standardised.value / 1.0
        hits += [
            found.mean.low <= 0.6 <= found.mean.high,
            found.middle.low <= 0.6 <= found.middle.high,
            found.standardised.low <= 0.6 * _hedges(9) <= found.standardised.high,
        ]
        assert np.isfinite(unbiased)
    assert hits[0] / 400 == pytest.approx(0.95, abs=0.033)
    assert 0.95 - 0.033 <= hits[1] / 400 <= 1.0  # the exact interval's level is at least 95 %
    assert hits[2] / 400 == pytest.approx(0.95, abs=0.033)


def _hedges(n: int) -> float:
    return 1.0 - 3.0 / (4.0 * (n - 1) - 1.0)


def test_rank_sum_of_period_differences_is_the_enumerated_one() -> None:
    study = simulated(Plan(participants=7), Effects(), np.random.default_rng(5))
    conditions = (Condition("2d", "2D"), Condition("3d", "3D"))
    found = cross_over(StudyData("x", conditions, study.participants, study.trials), TIME, reference="2d", subject="3d")
    assert found is not None
    steps, first = [], []
    for person in study.participants:
        values = {
            key: np.mean(
                [np.log(t.active_s) for t in study.trials if (t.participant, t.condition) == (person.code, key)]
            )
            for key in ("2d", "3d")
        }
        order = person.sequence.split(">")
        steps.append(values[order[1]] - values[order[0]])
        first.append(order[0] == "2d")
    ranks = stats.rankdata(steps)
    middle = sum(first) * (len(ranks) + 1) / 2.0
    seen = abs(ranks[np.array(first)].sum() - middle)
    sums = np.array([sum(each) for each in combinations(ranks, sum(first))])
    assert found.exact.p == pytest.approx(np.mean(np.abs(sums - middle) >= seen - 1e-9))
    assert found.exact.smallest_p == pytest.approx(2.0 / 35.0)
    two_half = stats.ttest_ind(np.array(steps)[first], np.array(steps)[~np.array(first)])
    assert found.view_p == pytest.approx(two_half.pvalue)


def test_power_is_that_of_simulated_studies() -> None:
    found = detectable_difference(8, 0.4, alpha=0.05, power=0.8)
    assert found is not None
    draws = np.random.default_rng(6).normal(found, 0.4, (4000, 8))
    share = np.mean(stats.ttest_1samp(draws, 0.0, axis=1).pvalue < 0.05)
    assert share == pytest.approx(0.8, abs=0.02)  # three standard errors
    assert participants_needed(found, 0.4) == 8
    assert detectable_difference(2, 0.4, alpha=0.05, power=0.8) is None
    with pytest.raises(ValueError, match="other than 0"):
        participants_needed(0.0, 0.4)
    assert "0.031" in power_of(Measure("t", "Time", "s", log=True), n=6, sd_differences=0.3).reading
