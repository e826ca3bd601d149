"""What the fit's least squares is made of: where each measured point is on the curve, and its row. Compiled."""

import math

from numba import njit

from cathxr.geometry.camera_kernels import project_row
from cathxr.geometry.medians import median_of
from cathxr.tracking.pair_work import SAMPLES
from cathxr.tracking.spline import cubic_pieces

_LONGEST_STEP = 0.03
_NEAR_SAMPLES = 32
_BEYOND_PX = 2.0
_LOOSE_WIDTH = 3.0
"""A section whose half width is off by more than this many standard deviations has one edge that is not the tube's."""


@njit(cache=True, nogil=True)
def seen(spans, control, cameras, view, t):  # type: ignore[no-untyped-def]
    """Return (first control point, basis values, velocity, u, v, derivatives of u, of v) of the curve at `t` in a view.

    cameras (V, 21): see `packed`. velocity: derivative of the curve by `t`.
    """
    piece, values, slopes = cubic_pieces(spans, t)
    x = y = z = dx = dy = dz = 0.0
    for k in range(4):
        x += values[k] * control[piece + k, 0]
        y += values[k] * control[piece + k, 1]
        z += values[k] * control[piece + k, 2]
        dx += slopes[k] * control[piece + k, 0]
        dy += slopes[k] * control[piece + k, 1]
        dz += slopes[k] * control[piece + k, 2]
    u, v, by_u, by_v, _ = project_row(x, y, z, cameras[view])
    return piece, values, (dx, dy, dz), u, v, by_u, by_v


@njit(cache=True, nogil=True)
def support(by_u, by_v, mx, my):  # type: ignore[no-untyped-def]
    """Return how far a ball of 1 mm reaches in the picture along the unit (mx, my), px: its ellipse's support."""
    total = 0.0
    for axis in range(3):
        total += (mx * by_u[axis] + my * by_v[axis]) ** 2
    return math.sqrt(total)


@njit(cache=True, nogil=True)
def follow(spans, cameras, points, work):  # type: ignore[no-untyped-def]
    """Move each measured point's parameter `at` to the foot of its perpendicular on the projected curve.

    Negative parameters are points without a part in the curve and stay so. The first point of each view is the cap's
    centre, the curve's beginning by definition, unless the view has the end's outline, which says more. A point beyond
    the curve's end is dropped.
    """
    at, view, curve = work.at, work.of_view, work.curve
    for i in range(points):
        if i == 0 or view[i] != view[i - 1]:
            at[i] = -1.0 if work.outlined[view[i]] else 0.0
            continue
        if at[i] < 0.0:
            continue
        t = min(max(at[i], 0.0), 1.0)
        _, _, (dx, dy, dz), u, v, by_u, by_v = seen(spans, work.control, cameras, view[i], t)
        su = by_u[0] * dx + by_u[1] * dy + by_u[2] * dz
        sv = by_v[0] * dx + by_v[1] * dy + by_v[2] * dz
        step = ((curve[i, 0] - u) * su + (curve[i, 1] - v) * sv) / max(su * su + sv * sv, 1e-6)
        moved = max(t + min(max(step, -_LONGEST_STEP), _LONGEST_STEP), 0.0)
        at[i] = -1.0 if moved > 1.001 else min(moved, 1.0)


@njit(cache=True, nogil=True)
def set_widths(spans, cameras, points, radius, work):  # type: ignore[no-untyped-def]
    """Set `balls`: by what each view shows of the tube's width, mm; `radius` where it shows too little."""
    at, view, normal = work.at, work.of_view, work.normal
    for which in range(len(cameras)):
        count = 0
        for i in range(points):
            if view[i] != which or at[i] < 0.0 or i == 0 or view[i] != view[i - 1]:
                continue
            _, _, _, _, _, by_u, by_v = seen(spans, work.control, cameras, which, at[i])
            work.scratch[count] = work.half[i] / max(radius * support(by_u, by_v, normal[i, 0], normal[i, 1]), 1e-9)
            count += 1
        work.balls[which] = radius
        if count > 4:
            work.balls[which] *= min(max(median_of(work.scratch, count), 0.75), 1.3)


@njit(cache=True, nogil=True)
def follow_end(spans, cameras, outline, reach, work):  # type: ignore[no-untyped-def]
    """Set each outline point's parameter `end_at` to that of the ball which makes the outline there.

    The silhouette is the union of the balls' discs: a point of its outline is nearest to the disc that it belongs to,
    whichever part of the catheter that is. reach: how much of the parameter, from the tip on, is sampled finely.
    """
    end, discs, gaps = work.end, work.discs, work.scratch
    last = -1
    for i in range(outline):
        if work.end_view[i] != last:
            last = work.end_view[i]
            for k in range(SAMPLES):
                _, _, _, u, v, by_u, by_v = seen(spans, work.control, cameras, last, _sample_at(k, reach))
                squared = 0.0
                for axis in range(3):
                    squared += by_u[axis] * by_u[axis] + by_v[axis] * by_v[axis]
                discs[k, 0], discs[k, 1], discs[k, 2] = u, v, work.balls[last] * math.sqrt(0.5 * squared)
        x, y = end[i, 0], end[i, 1]
        for k in range(SAMPLES):
            gaps[k] = math.sqrt((x - discs[k, 0]) ** 2 + (y - discs[k, 1]) ** 2) - discs[k, 2]
        best = 0
        for k in range(1, SAMPLES):
            if gaps[k] < gaps[best]:
                best = k
        t = _sample_at(best, reach)
        if 0 < best < _NEAR_SAMPLES - 1:
            bend = gaps[best - 1] - 2.0 * gaps[best] + gaps[best + 1]
            if bend > 1e-12:
                share = min(max(0.5 * (gaps[best - 1] - gaps[best + 1]) / bend, -0.5), 0.5)
                t += (t - _sample_at(best - 1, reach)) * share
        work.end_at[i] = t


@njit(cache=True, nogil=True)
def _sample_at(k, reach):  # type: ignore[no-untyped-def]
    if k < _NEAR_SAMPLES:
        return reach * k / _NEAR_SAMPLES
    return reach + (1.0 - reach) * (k - _NEAR_SAMPLES) / (SAMPLES - _NEAR_SAMPLES)


@njit(cache=True, nogil=True)
def set_rows(spans, cameras, points, outline, work):  # type: ignore[no-untyped-def]
    """Set pieces, design, residuals px and sigmas px of `work`; return (how many rows, the first row of an outline).

    One row a midline point, along its normal; one an outline point, away from its ball's centre; and one a view without
    an outline, of the cap's centre along the catheter.
    """
    at, view, curve, normal = work.at, work.of_view, work.curve, work.normal
    count = 0
    for i in range(points):
        if at[i] < 0.0:
            continue
        which = view[i]
        piece, values, _, seen_u, seen_v, by_u, by_v = seen(spans, work.control, cameras, which, at[i])
        du, dv = curve[i, 0] - seen_u, curve[i, 1] - seen_v
        first = i == 0 or which != view[i - 1]
        if at[i] <= 0.0 and not first and math.sqrt(du * du + dv * dv) > _BEYOND_PX:
            continue  # beyond the tip: something else that the trace went on along
        u, v = normal[i, 0], normal[i, 1]
        residual, spread = u * du + v * dv, work.sigma[i]
        if not first:
            wider = work.half[i] - work.balls[which] * support(by_u, by_v, u, v)
            if abs(wider) > _LOOSE_WIDTH * spread:
                residual, spread = one_edge(residual, wider, spread)
        _fill(work, count, piece, values, by_u, by_v, u, v, residual, spread)
        count += 1
        if first:
            u, v = work.along[which, 0], work.along[which, 1]
            _fill(work, count, piece, values, by_u, by_v, u, v, u * du + v * dv, work.along_sigma[which])
            count += 1
    first_end = count
    for i in range(outline):
        which = work.end_view[i]
        piece, values, _, seen_u, seen_v, by_u, by_v = seen(spans, work.control, cameras, which, work.end_at[i])
        du, dv = work.end[i, 0] - seen_u, work.end[i, 1] - seen_v
        distance = math.sqrt(du * du + dv * dv)
        u, v = (du / distance, dv / distance) if distance > 1e-3 else (1.0, 0.0)
        residual = distance - work.balls[which] * support(by_u, by_v, u, v)
        _fill(work, count, piece, values, by_u, by_v, u, v, residual, work.end_sigma[i])
        count += 1
    return count, first_end


@njit(cache=True, nogil=True)
def _fill(work, row, piece, values, by_u, by_v, u, v, residual, spread):  # type: ignore[no-untyped-def]
    """Set a row: how the picture's point along (u, v) moves with the four control points, and what was measured."""
    for axis in range(3):
        slope = u * by_u[axis] + v * by_v[axis]
        for k in range(4):
            work.design[row, 3 * k + axis] = values[k] * slope
    work.pieces[row], work.residuals[row], work.sigmas[row] = piece, residual, spread


@njit(cache=True, nogil=True)
def one_edge(residual, wider, spread):  # type: ignore[no-untyped-def]
    """Return (residual, sigma) of a section that is too wide or narrow: by one edge alone where that fits better."""
    best, own = residual, math.sqrt(spread * spread + 0.0625 * wider * wider)
    for side in (-1.0, 1.0):
        other = residual + side * wider
        if abs(other) < abs(best):
            best, own = other, 2.0 * spread
    return best, own
