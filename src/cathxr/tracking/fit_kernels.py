"""The fit's hot loop, compiled: Gauss-Newton on the control points, each point touching only a few of them."""

import math

import numpy as np
from numba import njit

from cathxr.geometry.medians import median_of
from cathxr.tracking.band import backward, factorise, forward
from cathxr.tracking.fit_rows import follow, follow_end, seen, set_rows, set_widths, support
from cathxr.tracking.pair_work import BAND
from cathxr.tracking.rim_kernels import follow_rim, set_rim_widths

HUBER = 2.5
MAX_NOISE = 50.0
ROUGH_RADII = 0.25
_STILL_PX = 0.01
"""No measured point's place on the curve moves by more, px: what is left is the square of it, and below every noise."""
_WIDTH_ROUNDS = 2
_SOFT_ROUNDS = 2
_RIM_ROUNDS = 4
_HELD_BACK = 10.0
"""Information, per mm^2, that a step of a fit to rims is none: about 0.3 mm. Where two parts of a catheter lie over
each other little holds the control points, and a step that is free goes anywhere."""
_REDESCENDING = 4.0
"""After the first rounds, outline points more than this many standard deviations off lose their pull."""
_NO_PART_PX = 1e4


@njit(cache=True, nogil=True)
def gauss_newton(  # type: ignore[no-untyped-def]
    spans, cameras, entry, radius, reach, iterations, without, points, outline, work
):
    """Return (solved, rms px, tip gap px) after robust Gauss-Newton on the control points of `work`.

    `control`, `at`, `end_at`, `balls` and `end_off` of `work` are moved or set, and `band` becomes the Cholesky factor
    of the information (3n, 3n) on the control points, point by point. prior (n, 4) of `work`: information on each axis
    of the control points, see `band.factorise`. entry (3, 2): information on the last control point about the origin,
    and on the step to it from the one before about none, for each axis. cameras (V, 21): see `packed`. reach: see
    `follow_end`; negative: the outlines are of whole silhouettes. without: a view whose end's outline has no part, -1
    for none. points, outline: how many of each count.
    """
    size = spans + 3
    control, right = work.control, work.right
    rims = reach < 0.0
    for view in range(len(cameras)):
        work.balls[view] = radius
    for round_ in range(iterations):
        rows, noise = _set_equations(spans, cameras, entry, radius, reach, round_, without, points, outline, work)
        if rims:
            for i in range(3 * size):
                work.band[i, 0] += _HELD_BACK / (noise * noise)
        if not factorise(work.band, 3 * size):
            return False, np.inf, np.inf
        forward(work.band, 3 * size, right)
        backward(work.band, 3 * size, right)
        largest = 0.0
        for i in range(size):
            for axis in range(3):
                control[i, axis] += right[3 * i + axis, 0]
                largest = max(largest, abs(right[3 * i + axis, 0]))
        if not largest < 1e6:
            return False, np.inf, np.inf
        if round_ >= _SOFT_ROUNDS and _largest_move(rows, work) < _STILL_PX:
            break
    if rims:
        # without what held the steps back; and the last one slid control points along the curve, so that outline
        # points belong to other parts of it than before
        _set_equations(spans, cameras, entry, radius, reach, iterations, without, points, outline, work)
        if not factorise(work.band, 3 * size):
            return False, np.inf, np.inf
    rms, gap = _misfit(spans, cameras, points, work)
    _set_end_off(spans, cameras, outline, work)
    return True, rms, gap


@njit(cache=True, nogil=True)
def _set_equations(  # type: ignore[no-untyped-def]
    spans, cameras, entry, radius, reach, round_, without, points, outline, work
):
    """Set the normal equations, `band` and `right` of `work`, of one round's step; return (how many rows, noise).

    noise: how many of their own standard deviations the rows are off, at least 1. See `gauss_newton`.
    """
    follow(spans, cameras, points, work)
    if round_ < _WIDTH_ROUNDS:
        set_widths(spans, cameras, points, radius, work)
    if reach < 0.0:
        if _SOFT_ROUNDS <= round_ < _RIM_ROUNDS:
            set_rim_widths(spans, cameras, points, outline, radius, work)
        follow_rim(spans, cameras, outline, work)
    else:
        follow_end(spans, cameras, outline, reach, work)
    rows, first_end = set_rows(spans, cameras, points, outline, work)
    for i in range(outline):
        if work.end_view[i] == without:
            work.sigmas[first_end + i] = _NO_PART_PX
    for i in range(rows):
        work.scratch[i] = abs(work.residuals[i] / work.sigmas[i])
    noise = min(max(1.0, 1.4826 * median_of(work.scratch, rows)), MAX_NOISE)
    _roughen(cameras, first_end, outline, work)
    _set_prior(spans + 3, entry, work)
    _add_rows(rows, first_end, noise, round_ >= _SOFT_ROUNDS, work)
    return rows, noise


@njit(cache=True, nogil=True)
def _set_prior(size, entry, work):  # type: ignore[no-untyped-def]
    """Set band and right side to what is known without any picture."""
    control, prior, band, right = work.control, work.prior, work.band, work.right
    for i in range(3 * size):
        right[i, 0] = 0.0
        for d in range(BAND):
            band[i, d] = 0.0
    for i in range(size):
        for d in range(min(i, 3) + 1):
            value = prior[i, d]
            for axis in range(3):
                band[3 * i + axis, 3 * d] = value
                right[3 * i + axis, 0] -= value * control[i - d, axis]
                if d > 0:
                    right[3 * (i - d) + axis, 0] -= value * control[i, axis]
    for axis in range(3):
        last, other = 3 * (size - 1) + axis, 3 * (size - 2) + axis
        here, step_here = control[size - 1, axis], control[size - 1, axis] - control[size - 2, axis]
        band[last, 0] += entry[axis, 0] + entry[axis, 1]
        band[other, 0] += entry[axis, 1]
        band[last, 3] -= entry[axis, 1]
        right[last, 0] -= entry[axis, 0] * here + entry[axis, 1] * step_here
        right[other, 0] += entry[axis, 1] * step_here


@njit(cache=True, nogil=True)
def _add_rows(rows, first_end, noise, soft, work):  # type: ignore[no-untyped-def]
    """Add the weighted rows to the normal equations. soft: what lies off the end is no noise and must not pull."""
    band, right, design = work.band, work.right, work.design
    for i in range(rows):
        spread = work.sigmas[i] * noise
        scaled = max(abs(work.residuals[i]) / spread, 1e-12)
        weight = min(1.0, HUBER / scaled) / (spread * spread)
        if soft and i >= first_end:
            weight *= min(1.0, (_REDESCENDING / scaled) ** 2)
        start = 3 * work.pieces[i]
        for a in range(BAND):
            part = weight * design[i, a]
            right[start + a, 0] += part * work.residuals[i]
            for b in range(a + 1):
                band[start + a, a - b] += part * design[i, b]


@njit(cache=True, nogil=True)
def _largest_move(rows, work):  # type: ignore[no-untyped-def]
    """Return by how much the last step moves a row's place on the curve at most, px.

    Control points also slide along the curve, which moves nothing that can be seen and never ends.
    """
    largest = 0.0
    for i in range(rows):
        start = 3 * work.pieces[i]
        move = 0.0
        for a in range(BAND):
            move += work.design[i, a] * work.right[start + a, 0]
        largest = max(largest, abs(move))
    return largest


@njit(cache=True, nogil=True)
def _roughen(cameras, first_end, outline, work):  # type: ignore[no-untyped-def]
    """Raise the sigmas of a view's outline, in place, where most of it is off: a real end is no perfect ball.

    Up to a quarter of the radius; what is off by more is not the end.
    """
    for which in range(len(cameras)):
        start = 0
        while start < outline and work.end_view[start] != which:
            start += 1
        stop = start
        while stop < outline and work.end_view[stop] == which:
            stop += 1
        if stop - start < 3:
            continue
        _, _, _, _, _, by_u, by_v = seen(1, work.control, cameras, which, 0.0)
        most = ROUGH_RADII * work.balls[which] * support(by_u, by_v, 1.0, 0.0)
        for i in range(start, stop):
            work.scratch[i - start] = abs(work.residuals[first_end + i])
        spread = 1.4826 * median_of(work.scratch, stop - start)
        for i in range(first_end + start, first_end + stop):
            work.sigmas[i] = min(max(work.sigmas[i], spread), max(most, work.sigmas[i]))


@njit(cache=True, nogil=True)
def _misfit(spans, cameras, points, work):  # type: ignore[no-untyped-def]
    """Return (rms px along the normals, largest distance px of a cap's centre that takes part from the projected)."""
    total = 0.0
    count = 0
    gap = 0.0
    for i in range(points):
        if work.at[i] < 0.0:
            continue
        _, _, _, u, v, _, _ = seen(spans, work.control, cameras, work.of_view[i], work.at[i])
        du, dv = work.curve[i, 0] - u, work.curve[i, 1] - v
        total += (du * work.normal[i, 0] + dv * work.normal[i, 1]) ** 2
        count += 1
        if i == 0 or work.of_view[i] != work.of_view[i - 1]:
            gap = max(gap, math.sqrt(du * du + dv * dv))
    return math.sqrt(total / max(count, 1)), gap


@njit(cache=True, nogil=True)
def _set_end_off(spans, cameras, outline, work):  # type: ignore[no-untyped-def]
    """Set how far, px, each point of the ends' outlines lies outside the silhouette of the fitted tube."""
    for i in range(outline):
        view = work.end_view[i]
        _, _, _, u, v, by_u, by_v = seen(spans, work.control, cameras, view, work.end_at[i])
        du, dv = work.end[i, 0] - u, work.end[i, 1] - v
        distance = max(math.sqrt(du * du + dv * dv), 1e-9)
        work.end_off[i] = distance - work.balls[view] * support(by_u, by_v, du / distance, dv / distance)
