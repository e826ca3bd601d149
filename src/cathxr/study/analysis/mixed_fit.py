"""A linear model with a random intercept for each participant, by statsmodels, with t intervals for few people."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from statsmodels.regression.linear_model import OLS
from statsmodels.regression.mixed_linear_model import MixedLM

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.estimates import Estimate


@dataclass(frozen=True, eq=False)
class Fit:
    """coefficients: (P,), errors: (P,) standard errors, both on y's scale. dof: (P,) of the t distribution of each.

    sd_participant, sd_residual: standard deviations between people and within them. grouped: False where people did not
    differ by more than their trials do, so that the model is an ordinary regression.
    """

    coefficients: FloatArray
    errors: FloatArray
    dof: FloatArray
    sd_participant: float
    sd_residual: float
    grouped: bool

    def estimate(self, at: int, level: float) -> Estimate:
        """Return coefficient `at` with its interval."""
        reach = float(stats.t.ppf(0.5 + level / 2.0, self.dof[at])) * float(self.errors[at])
        value = float(self.coefficients[at])
        return Estimate(value, value - reach, value + reach, level)

    def p(self, at: int) -> float:
        """Return the two-sided p of coefficient `at` being 0."""
        if self.errors[at] == 0.0:
            return 1.0 if self.coefficients[at] == 0.0 else 0.0
        return float(2.0 * stats.t.sf(abs(self.coefficients[at] / self.errors[at]), self.dof[at]))


def fit_random_intercept(
    y: FloatArray, matrix: FloatArray, *, groups: Sequence[str], within: Sequence[bool]
) -> Fit | None:
    """Return the REML fit of y (N,) on matrix (N, P) with an intercept for each of `groups` (N,); None: too few data.

    within: (P,), whether a column varies within people. Standard errors are statsmodels'; its normal distribution is
    replaced by t with between-within degrees of freedom (Schluchter and Elashoff 1990, J Stat Comput Simul 37:69;
    SAS's DDFM=BETWITHIN), without which intervals are too narrow for few participants: columns between people have
    people − columns between, columns within have N − people − columns within.
    """
    inside = np.asarray(within, dtype=bool)
    n_people = len(set(groups))
    between_dof = n_people - int(np.count_nonzero(~inside))
    within_dof = len(y) - n_people - int(np.count_nonzero(inside))
    if within_dof < 1 or between_dof < 1:
        return None
    dof = np.where(inside, within_dof, between_dof).astype(np.float64)
    mixed = _mixed(y, matrix, groups)
    if mixed is not None:
        coefficients, errors, sd_people, sd_rest = mixed
        return Fit(coefficients, errors, dof, sd_people, sd_rest, True)
    plain = OLS(y, matrix).fit()
    return Fit(np.asarray(plain.params), np.asarray(plain.bse), dof, 0.0, float(np.sqrt(plain.scale)), False)


def _mixed(
    y: FloatArray, matrix: FloatArray, groups: Sequence[str]
) -> tuple[FloatArray, FloatArray, float, float] | None:
    """Return coefficients, errors and both standard deviations; None where the one between people is 0.

    Powell's method: the gradient of the likelihood does not exist at 0, and the others fail beside it.
    """
    scale = float(np.std(y)) or 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the boundary, which is told by `grouped`
        try:
            result = MixedLM(y / scale, matrix, groups=np.asarray(groups)).fit(reml=True, method=["powell"])
        except np.linalg.LinAlgError:
            return None
        sd_people = float(np.sqrt(max(float(np.asarray(result.cov_re)[0, 0]), 0.0)))
        sd_rest = float(np.sqrt(float(result.scale)))
        errors = np.asarray(result.bse_fe, dtype=np.float64)
    if not result.converged or sd_people < 1e-3 * sd_rest or not np.isfinite(errors).all():
        return None
    return np.asarray(result.fe_params, dtype=np.float64) * scale, errors * scale, sd_people * scale, sd_rest * scale
