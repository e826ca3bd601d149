"""Per participant: the difference between two views, and exact tests of it that assume no distribution.

Each participant counts once: the mean of their trials in a view (of log values for a ratio), one view minus the other.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.data import Measure, StudyData
from cathxr.study.analysis.observations import Observations, observations

ENUMERATED = 16
"""Up to how many participants every one of the 2^n sign patterns is gone through."""
DRAWN = 99_999
"""How many patterns are drawn by chance beyond that."""


@dataclass(frozen=True, eq=False)
class Differences:
    """One value for each of n participants who have both views. d: (n,) subject minus reference, on its scale.

    only_one: codes of those who have trials in one of both views only, and so are not among them.
    """

    measure: Measure
    reference: str
    subject: str
    participants: tuple[str, ...]
    d: FloatArray
    only_one: tuple[str, ...]


@dataclass(frozen=True)
class ExactTest:
    """A test's p. n: on how many differences it rests; exact: every pattern enumerated; smallest_p: it can ever give.

    statistic: W, the smaller rank sum, or the mean difference on the measure's scale.
    """

    name: str
    statistic: float
    p: float
    n: int
    exact: bool
    smallest_p: float


def differences(data: StudyData, measure: Measure, *, reference: str, subject: str) -> Differences:
    """Return each participant's mean in `subject` minus that in `reference` (keys of conditions)."""
    return differences_of(observations(data, measure), reference=reference, subject=subject)


def differences_of(observed: Observations, *, reference: str, subject: str) -> Differences:
    """Return the differences of these observations."""
    values: dict[str, dict[str, list[float]]] = {}
    for trial, value in zip(observed.trials, observed.y, strict=True):
        if trial.condition in (reference, subject):
            values.setdefault(trial.participant, {}).setdefault(trial.condition, []).append(float(value))
    both = tuple(sorted(code for code, found in values.items() if len(found) == 2))
    d = np.array([np.mean(values[code][subject]) - np.mean(values[code][reference]) for code in both])
    only_one = tuple(sorted(set(values) - set(both)))
    return Differences(observed.measure, reference, subject, both, d.astype(np.float64), only_one)


def wilcoxon(d: FloatArray) -> ExactTest | None:
    """Return the two-sided Wilcoxon signed-rank test of d (n,); None where no difference is other than 0.

    Zeros are dropped (Wilcoxon 1945) and ties get mid-ranks. Exact: by SciPy's distribution over all signs where there
    are no ties, by enumeration of all signs where there are, up to 16 participants; beyond, ties are left to the normal
    approximation, which is then said.
    """
    moved = d[d != 0.0]
    n = len(moved)
    if n == 0:
        return None
    if n == 1:  # both signs are equally far from the middle
        return ExactTest("Wilcoxon signed-rank", 0.0, 1.0, 1, True, smallest_p(1))
    tied = len(np.unique(np.abs(moved))) < n
    method: object = "exact"
    if tied:
        method = stats.PermutationMethod(n_resamples=2**n, batch=2**12) if n <= ENUMERATED else "approx"
    result = stats.wilcoxon(moved, method=method)
    exact = n <= ENUMERATED or not tied
    return ExactTest("Wilcoxon signed-rank", float(result.statistic), float(result.pvalue), n, exact, smallest_p(n))


def permutation(d: FloatArray, *, rng: np.random.Generator) -> ExactTest | None:
    """Return the two-sided paired permutation test of the mean of d (n,): all 2^n signs, or draws beyond 16 people."""
    moved = d[d != 0.0]  # the sign of a zero changes nothing
    n = len(moved)
    if n == 0:
        return None
    if n == 1:
        return ExactTest("Paired permutation", float(d.mean()), 1.0, 1, True, smallest_p(1))
    result = stats.permutation_test(
        (moved,),
        lambda sample, axis: np.mean(sample, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=2**n if n <= ENUMERATED else DRAWN,
        batch=2**12,
        rng=rng,
    )
    smallest = smallest_p(n) if n <= ENUMERATED else 2.0 / (DRAWN + 1)
    return ExactTest("Paired permutation", float(d.mean()), float(result.pvalue), n, n <= ENUMERATED, smallest)


def smallest_p(n: int) -> float:
    """Return the smallest two-sided p that a test over the signs of n differences can give: 2 / 2^n, at most 1."""
    return min(1.0, 2.0 ** (1 - n))


def smallest_p_reading(n: int, alpha: float) -> str:
    """Return in plain words what n participants can show at best."""
    p = smallest_p(n)
    told = f"With {n} participants the smallest two-sided p that the exact paired tests can ever give is {p:.2g}"
    if n <= 10:
        told = f"With {n} participants the smallest two-sided p that the exact paired tests can ever give is {p:.3f}"
    if p > alpha:
        return f"{told}: they cannot reach {alpha:g} whatever the data are."
    others = int(np.floor(alpha * 2.0 ** (n - 1)))
    if others == 1:
        return f"{told}, and only when every single participant changes in the same direction."
    return f"{told}."
