"""Several outcomes at once: Holm's correction, by statsmodels."""

from collections.abc import Sequence

from statsmodels.stats.multitest import multipletests


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Return the p values corrected by Holm's step-down procedure, in the same order.

    Source: Holm 1979, Scand J Stat 6:65. Each stays valid however the outcomes depend on one another.
    """
    if not p_values:
        return ()
    return tuple(float(each) for each in multipletests(list(p_values), method="holm")[1])
