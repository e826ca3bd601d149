"""How well a fitted curve agrees with what each view shows, and how sure its tip is. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.tracking.fit_kernels import ROUGH_RADII
from cathxr.tracking.spline import cubic_pieces

INSIDE_SHARE = 0.1
MOST_EXCESS = 16.0
BLUNT_RADII = 0.2
"""Real catheters' ends are blunter, or slimmer than the shaft, by about this: an outline so far off is still theirs."""


@njit(cache=True, nogil=True)
def agreement(line, curve, half, off, sigma, caps, tolerance):  # type: ignore[no-untyped-def]
    """Return (radius, added, away, inside, share, on_cap, excess) of one view.

    line (K, 2) px: the fitted curve, tip first; curve (N, 2) px and half (N,): the measured midline; off, sigma, caps
    (E,): see `CurveFit`. radius: median of half. added: length, px, of midline that the fitted tube does not explain,
    the inlet's end apart. away: of the fitted cap's centre from the midline. inside: how far, at the tenth worst place,
    the outline lies outside the tube at least. share: of the outline that is the tube's, allowing for a blunt end.
    on_cap: how many of its points lie on the rounded end to `tolerance` px and three sigma. excess: mean square of off
    / sigma, outliers limited.
    """
    radius = float(np.median(half))
    shown = np.zeros(len(curve), dtype=np.bool_)
    away = np.inf
    last = -1
    for i in range(len(curve)):
        least = np.inf
        for j in range(len(line) - 1):
            least = min(least, _squared(curve[i], line[j], line[j + 1]))
        if least < radius * radius:
            shown[i] = True
            last = i
        if i > 0:
            away = min(away, _squared(line[0], curve[i - 1], curve[i]))
    added = np.inf if last < 0 else 0.0
    for i in range(1, last):
        if not shown[i]:
            added += math.hypot(curve[i, 0] - curve[i - 1, 0], curve[i, 1] - curve[i - 1, 1])
    count = len(off)
    if count == 0:
        return radius, added, math.sqrt(away), 0.0, 1.0, 0, 1.0
    fitting = 0
    on_cap = 0
    excess = 0.0
    outside = np.empty(count)
    spread = min(1.4826 * float(np.median(np.abs(off))), ROUGH_RADII * radius)  # as the fit takes it
    for i in range(count):
        outside[i] = off[i] + 3.0 * sigma[i]
        excess += min((off[i] / max(sigma[i], spread, 1e-9)) ** 2, MOST_EXCESS)
        if abs(off[i]) < 3.0 * sigma[i] + tolerance + BLUNT_RADII * radius:
            fitting += 1
        if abs(off[i]) < 3.0 * sigma[i] + tolerance:
            on_cap += caps[i]
    outside.sort()
    inside = outside[int(INSIDE_SHARE * (count - 1))]
    return radius, added, math.sqrt(away), inside, fitting / count, on_cap, excess / count


@njit(cache=True, nogil=True)
def _squared(point, first, second):  # type: ignore[no-untyped-def]
    """Return the squared distance of a point from the straight line between two others."""
    dx, dy = second[0] - first[0], second[1] - first[1]
    px, py = point[0] - first[0], point[1] - first[1]
    share = min(max((px * dx + py * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
    return (px - share * dx) ** 2 + (py - share * dy) ** 2


@njit(cache=True, nogil=True)
def tip_variance(spans, control, information, radius):  # type: ignore[no-untyped-def]
    """Return the trace (mm^2) of the covariance of the tip, `radius` mm beyond the curve's beginning."""
    _, values, slopes = cubic_pieces(spans, 0.0)
    velocity = np.zeros(3)
    for k in range(4):
        for axis in range(3):
            velocity[axis] += slopes[k] * control[k, axis]
    speed = math.sqrt((velocity**2).sum())
    if not 1e-6 < speed < 1e12:
        return np.inf
    tangent = velocity / speed
    gain = np.zeros((len(information), 3))
    for k in range(4):
        for row in range(3):
            for axis in range(3):
                turn = (1.0 if row == axis else 0.0) - tangent[row] * tangent[axis]
                same = values[k] if row == axis else 0.0
                gain[3 * k + axis, row] = same - slopes[k] * radius / speed * turn
    return float((gain * np.linalg.solve(information, gain)).sum())
