"""What a number of participants can show: the smallest possible p, and the difference that 80 % of studies would find.

The power of the effect that was found is not given: it is the p value said again (Hoenig and Heisey 2001, Am Stat
55:19).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from statsmodels.stats.power import TTestPower

from cathxr.study.analysis.data import Measure
from cathxr.study.analysis.estimates import change_text, in_sentence, percent
from cathxr.study.analysis.paired import smallest_p, smallest_p_reading


@dataclass(frozen=True)
class Power:
    """n: participants. smallest_p: of the exact paired tests. detectable: the difference on the measure's scale that a

    paired t test finds with probability `power`, given sd_differences, the spread of people's differences; None where n
    is too small for any. more: (participants, detectable) for larger studies with the same spread.
    """

    n: int
    smallest_p: float
    sd_differences: float
    power: float
    detectable: float | None
    more: tuple[tuple[int, float], ...]
    reading: str


def power_of(measure: Measure, *, n: int, sd_differences: float, alpha: float = 0.05, power: float = 0.8) -> Power:
    """Return what n participants can show when their differences have a standard deviation of sd_differences."""
    detectable = detectable_difference(n, sd_differences, alpha=alpha, power=power)
    sizes = sorted({each for each in (6, 8, 12, 16, 24, 32, 48) if each > n})
    more = [(each, detectable_difference(each, sd_differences, alpha=alpha, power=power)) for each in sizes]
    told = smallest_p_reading(n, alpha)
    if detectable is not None and sd_differences > 0.0:
        sign = -1.0 if measure.better == "lower" else 1.0
        told += (
            f" A paired comparison of {n} shows it in {percent(power)} of studies when {in_sentence(measure.name)} is "
            f"truly {change_text(sign * detectable, measure)}, and less often for a smaller difference (t test, if "
            "people's differences spread as they do here)."
        )
    return Power(
        n,
        smallest_p(n),
        sd_differences,
        power,
        detectable,
        tuple((each, value) for each, value in more if value is not None),
        told,
    )


def detectable_difference(n: int, sd: float, *, alpha: float, power: float) -> float | None:
    """Return the true mean difference that a two-sided paired t test of n finds with probability `power`."""
    if n < 3:
        return None
    size = TTestPower().solve_power(effect_size=None, nobs=n, alpha=alpha, power=power, alternative="two-sided")
    return float(np.ravel(size)[0]) * sd


def participants_needed(effect: float, sd: float, *, alpha: float = 0.05, power: float = 0.8) -> int:
    """Return how many participants a paired t test needs to find `effect` with probability `power`, at least 3.

    Raises:
        ValueError: effect or sd is not other than 0.
    """
    if effect == 0.0 or sd <= 0.0:
        raise ValueError(f"effect, sd: expected a difference other than 0 and a positive spread, got {effect}, {sd}")
    n = 3
    while _power(n, abs(effect) / sd, alpha) < power:
        n += 1
    return n


def _power(n: int, size: float, alpha: float) -> float:
    critical = float(stats.t.ppf(1.0 - alpha / 2.0, n - 1))
    shift = size * math.sqrt(n)
    return float(stats.nct.sf(critical, n - 1, shift) + stats.nct.cdf(-critical, n - 1, shift))
