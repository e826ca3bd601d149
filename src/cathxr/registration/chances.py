"""Tails of distributions. SciPy is imported when one is asked for: it takes a second that no live start waits for."""


def chi_square_beyond(freedom: float, value: float) -> float:
    """Return how likely chi-square of so many degrees of freedom is to exceed a value."""
    from scipy.special import chdtrc

    return float(chdtrc(freedom, value))


def f_beyond(first: float, second: float, value: float) -> float:
    """Return how likely F of so many degrees of freedom is to exceed a value."""
    from scipy.special import fdtrc

    return float(fdtrc(first, second, value))
