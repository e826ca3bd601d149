"""Medians in place, for compiled loops that must not allocate."""

from numba import njit


@njit(cache=True, nogil=True)
def median_of(values, count):  # type: ignore[no-untyped-def]
    """Return the median of the first `count` values, which are left in another order; 0 of none."""
    if count == 0:
        return 0.0
    middle = count // 2
    upper = smallest_but(values, count, middle)
    if count % 2:
        return upper
    lower = values[0]
    for i in range(1, middle):
        lower = max(lower, values[i])
    return 0.5 * (lower + upper)


@njit(cache=True, nogil=True)
def smallest_but(values, count, wanted):  # type: ignore[no-untyped-def]
    """Return the value that has `wanted` smaller ones among the first `count`, moved to that place (Hoare's find).

    The smaller ones are moved before it.
    """
    first, last = 0, count - 1
    while first < last:
        pivot = values[wanted]
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if j < wanted:
            first = i
        if wanted < i:
            last = j
    return values[wanted]
