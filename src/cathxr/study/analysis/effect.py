"""Effect sizes of paired differences, each with its interval."""

from dataclasses import dataclass

import numpy as np
from scipy import special, stats

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.estimates import Estimate


@dataclass(frozen=True)
class EffectSizes:
    """mean: of the differences, by Student's t. middle: Hodges and Lehmann's, by the signed-rank distribution; None

    where n is too small for an interval of that level. standardised: mean over standard deviation (Cohen's d_z) with
    Hedges' correction; None for two people, and where differences are all alike. same_way: how many of n have the
    mean's sign.
    """

    mean: Estimate
    middle: Estimate | None
    standardised: Estimate | None
    same_way: int
    n: int


def effect_sizes(d: FloatArray, *, level: float = 0.95) -> EffectSizes | None:
    """Return the effect sizes of n paired differences d (n,); None for fewer than two."""
    n = len(d)
    if n < 2:
        return None
    mean = float(d.mean())
    reach = float(stats.t.ppf(0.5 + level / 2.0, n - 1) * d.std(ddof=1) / np.sqrt(n))
    return EffectSizes(
        Estimate(mean, mean - reach, mean + reach, level),
        hodges_lehmann(d, level=level),
        standardised(d, level=level),
        int(np.count_nonzero(np.sign(d) == np.sign(mean))) if mean else 0,
        n,
    )


def hodges_lehmann(d: FloatArray, *, level: float = 0.95) -> Estimate | None:
    """Return the median of all pairwise means of d (n,) with its exact interval; None where n is too small for one.

    The interval holds the shifts that the exact signed-rank test does not reject (Hollander, Wolfe and Chicken 2014,
    Nonparametric Statistical Methods, 3.3): the k-th smallest and largest Walsh average, k from the exact distribution.
    """
    n = len(d)
    i, j = np.triu_indices(n)
    walsh = np.sort((d[i] + d[j]) / 2.0)
    cumulative = np.cumsum(_signed_rank_counts(n)) / 2.0**n
    alpha = 1.0 - level
    k = int(np.searchsorted(cumulative, alpha / 2.0, side="right"))  # the number of W with P(W <= w) <= alpha / 2
    if k < 1:
        return None
    return Estimate(float(np.median(walsh)), float(walsh[k - 1]), float(walsh[len(walsh) - k]), level)


def _signed_rank_counts(n: int) -> FloatArray:
    """Return, for W = 0 … n (n + 1) / 2, how many of the 2^n sign patterns give it."""
    counts = np.ones(1)
    for rank in range(1, n + 1):
        with_rank = np.zeros(len(counts) + rank)
        with_rank[: len(counts)] += counts
        with_rank[rank:] += counts
        counts = with_rank
    return counts


def standardised(d: FloatArray, *, level: float = 0.95) -> Estimate | None:
    """Return d_z = mean / SD of d (n,) times Hedges' correction, with the interval of the noncentral t distribution.

    Source: Cumming and Finch 2001, Educ Psychol Meas 61:532; the correction: Hedges 1981, J Educ Stat 6:107.
    """
    n = len(d)
    sd = float(d.std(ddof=1)) if n > 2 else 0.0
    if sd <= 1e-12 * float(np.abs(d).max(initial=0.0)):
        return None
    dof, t = n - 1, float(d.mean()) / sd * np.sqrt(n)
    tail = (1.0 - level) / 2.0
    low, high = special.nctdtrinc(dof, [1.0 - tail, tail], t) / np.sqrt(n)
    correction = np.exp(special.gammaln(dof / 2) - special.gammaln((dof - 1) / 2)) / np.sqrt(dof / 2)
    value, low, high = (float(each * correction) for each in (t / np.sqrt(n), low, high))
    return Estimate(value, low, high, level)
