"""From signed distances to the share of each pixel, and of the exposure, that the tube covers. Numba, no GIL.

Per pixel the outline is a straight edge. The share of a square pixel on one side of it is a second difference of
squares; between two instants of the exposure the edge moves evenly, so the mean over that time is one of cubes.
"""

import numpy as np
from numba import njit

_FAR = 1e8
_OUTSIDE_PX = -3.0


@njit(cache=True, nogil=True)
def _positive_power(x: float, power: int) -> float:
    """x^n / n! for x > 0, else 0."""
    if x <= 0.0:
        return 0.0
    return 0.5 * x * x if power == 2 else x * x * x / 6.0


@njit(cache=True, nogil=True)
def covered_share(inside: float, across: float, down: float, power: int) -> float:
    """Return the covered share of a unit pixel whose centre lies `inside` px inside a straight edge (power 2).

    across, down: absolute components of the edge's unit normal. With power 3: that share's integral over `inside`.
    """
    a, b = max(across, 0.02), max(down, 0.02)
    p, m = 0.5 * (a + b), 0.5 * (a - b)
    total = (
        _positive_power(inside + p, power)
        - _positive_power(inside + m, power)
        - _positive_power(inside - m, power)
        + _positive_power(inside - p, power)
    )
    return total / (a * b)


@njit(cache=True, nogil=True)
def add_coverage(first, second, share, window, coverage):  # type: ignore[no-untyped-def]
    """Add to coverage (H, W), times `share`, the pixels' mean cover while the outline goes from one field to the other.

    first, second (H, W, 3): distances and slopes at the start and end, from `distance_field`; window (4,): left, top,
    right, bottom.
    """
    left, top, right, bottom = window
    for row in range(top, bottom):
        for column in range(left, right):
            d0, d1 = first[row, column, 0], second[row, column, 0]
            if d0 > _FAR and d1 > _FAR:
                continue
            # The edge's direction is that of the instant at which it is nearer.
            nearer = first if abs(d0) <= abs(d1) else second
            across, down = nearer[row, column, 1], nearer[row, column, 2]
            steep = max(np.sqrt(across * across + down * down), 1e-9)
            x0 = _OUTSIDE_PX if d0 > _FAR else -d0 / steep
            x1 = _OUTSIDE_PX if d1 > _FAR else -d1 / steep
            if x0 < -1.0 and x1 < -1.0:
                continue
            if x0 > 1.0 and x1 > 1.0:
                coverage[row, column] += share
                continue
            a, b = abs(across) / steep, abs(down) / steep
            if abs(x1 - x0) < 1e-3:
                part = covered_share(0.5 * (x0 + x1), a, b, 2)
            else:
                part = (covered_share(x1, a, b, 3) - covered_share(x0, a, b, 3)) / (x1 - x0)
            coverage[row, column] += share * min(1.0, max(0.0, part))
