"""The fit's hot loop, compiled: Gauss-Newton on the control points, each point touching only a few of them."""

import math

import numpy as np
from numba import njit

from cathxr.core import FloatArray
from cathxr.geometry.camera_kernels import project_one
from cathxr.tracking.spline import cubic_pieces

HUBER = 2.5
MAX_NOISE = 50.0
ROUGH_RADII = 0.25
_STILL_MM = 4e-3
"""No control point moves by more: what is left is the square of it, and below every noise."""
_WIDTH_ROUNDS = 2
_BAND = 11
"""The lower triangle reaches this far to the left of the diagonal: twelve unknowns meet in one measurement."""
_LONGEST_STEP = 0.03
_NEAR_SAMPLES = 32
_FAR_SAMPLES = 40
_SOFT_ROUNDS = 2
_REDESCENDING = 4.0
"""After the first rounds, outline points more than this many standard deviations off lose their pull."""
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
    row = cameras[view]
    u, v, by_u, by_v, _ = project_one(x, y, z, row[:9].reshape(3, 3), row[9:12], row[12:14], row[14:16], row[16:21])
    return piece, values, (dx, dy, dz), u, v, by_u, by_v


@njit(cache=True, nogil=True)
def support(by_u, by_v, mx, my):  # type: ignore[no-untyped-def]
    """Return how far a ball of 1 mm reaches in the picture along the unit (mx, my), px: its ellipse's support."""
    total = 0.0
    for axis in range(3):
        total += (mx * by_u[axis] + my * by_v[axis]) ** 2
    return math.sqrt(total)


@njit(cache=True, nogil=True)
def follow(spans, control, cameras, at, view, curve, outlined):  # type: ignore[no-untyped-def]
    """Move each measured point's parameter `at` (M,) to the foot of its perpendicular on the projected curve, in place.

    Negative parameters are points without a part in the curve and stay so. The first point of each view is the cap's
    centre, the curve's beginning by definition, unless the view has the end's outline, which says more: `outlined`
    (V,). A point beyond the curve's end is dropped.
    """
    for i in range(len(at)):
        if i == 0 or view[i] != view[i - 1]:
            at[i] = -1.0 if outlined[view[i]] else 0.0
            continue
        if at[i] < 0.0:
            continue
        t = min(max(at[i], 0.0), 1.0)
        _, _, (dx, dy, dz), u, v, by_u, by_v = seen(spans, control, cameras, view[i], t)
        su = by_u[0] * dx + by_u[1] * dy + by_u[2] * dz
        sv = by_v[0] * dx + by_v[1] * dy + by_v[2] * dz
        step = ((curve[i, 0] - u) * su + (curve[i, 1] - v) * sv) / max(su * su + sv * sv, 1e-6)
        moved = max(t + min(max(step, -_LONGEST_STEP), _LONGEST_STEP), 0.0)
        at[i] = -1.0 if moved > 1.001 else min(moved, 1.0)


@njit(cache=True, nogil=True)
def widths(spans, control, cameras, at, view, normal, half, radius):  # type: ignore[no-untyped-def]
    """Return (V,) by what factor each view shows the tube wider than `radius` mm would be; 1 where it is not known."""
    result = np.ones(len(cameras))
    ratios = np.empty(len(at))
    for which in range(len(cameras)):
        count = 0
        for i in range(len(at)):
            if view[i] != which or at[i] < 0.0 or i == 0 or view[i] != view[i - 1]:
                continue
            _, _, _, _, _, by_u, by_v = seen(spans, control, cameras, which, at[i])
            ratios[count] = half[i] / max(radius * support(by_u, by_v, normal[i, 0], normal[i, 1]), 1e-9)
            count += 1
        if count > 4:
            result[which] = min(max(np.median(ratios[:count]), 0.75), 1.3)
    return result


@njit(cache=True, nogil=True)
def follow_end(spans, control, cameras, end_at, end_view, end, reach, balls):  # type: ignore[no-untyped-def]
    """Set each outline point's parameter `end_at` (E,) to that of the ball which makes the outline there.

    The silhouette is the union of the balls' discs: a point of its outline is nearest to the disc that it belongs to,
    whichever part of the catheter that is. reach: how much of the parameter, from the tip on, is sampled finely.
    balls (V,): radius of the balls, mm, as each view shows them.
    """
    total = _NEAR_SAMPLES + _FAR_SAMPLES
    discs = np.empty((total, 3))
    last = -1
    for i in range(len(end_at)):
        if end_view[i] != last:
            last = end_view[i]
            for k in range(total):
                t = _sample_at(k, reach)
                _, _, _, u, v, by_u, by_v = seen(spans, control, cameras, last, t)
                size = math.sqrt(0.5 * (support(by_u, by_v, 1.0, 0.0) ** 2 + support(by_u, by_v, 0.0, 1.0) ** 2))
                discs[k, 0], discs[k, 1], discs[k, 2] = u, v, balls[last] * size
        best = 0
        least = np.inf
        for k in range(total):
            gap = _gap(discs, k, end[i])
            if gap < least:
                least = gap
                best = k
        t = _sample_at(best, reach)
        if 0 < best < _NEAR_SAMPLES - 1:
            before, after = _gap(discs, best - 1, end[i]), _gap(discs, best + 1, end[i])
            bend = before - 2.0 * least + after
            if bend > 1e-12:
                t += (t - _sample_at(best - 1, reach)) * min(max(0.5 * (before - after) / bend, -0.5), 0.5)
        end_at[i] = t


@njit(cache=True, nogil=True)
def _sample_at(k, reach):  # type: ignore[no-untyped-def]
    if k < _NEAR_SAMPLES:
        return reach * k / _NEAR_SAMPLES
    return reach + (1.0 - reach) * (k - _NEAR_SAMPLES) / _FAR_SAMPLES


@njit(cache=True, nogil=True)
def _gap(discs, k, point):  # type: ignore[no-untyped-def]
    """Return how far outside of a disc a point lies, px."""
    return math.hypot(point[0] - discs[k, 0], point[1] - discs[k, 1]) - discs[k, 2]


@njit(cache=True, nogil=True)
def rows_of(  # type: ignore[no-untyped-def]
    spans,
    control,
    cameras,
    at,
    view,
    curve,
    normal,
    sigma,
    half,
    end_at,
    end_view,
    end,
    end_sigma,
    balls,
    tip_along,
    tip_sigma,
    outlined,
):
    """Return (piece, weights of the 12 unknowns, residual px, sigma px) of every row, and the first row of an outline.

    One row a midline point, along its normal; one an outline point, away from its ball's centre; and one a view without
    an outline, of the cap's centre along the catheter.
    """
    capacity = len(at) + len(end_at) + len(tip_sigma)
    pieces = np.empty(capacity, dtype=np.int64)
    design = np.empty((capacity, 12))
    residuals = np.empty(capacity)
    sigmas = np.empty(capacity)
    count = 0
    for i in range(len(at)):
        if at[i] < 0.0:
            continue
        piece, values, _, seen_u, seen_v, by_u, by_v = seen(spans, control, cameras, view[i], at[i])
        first = i == 0 or view[i] != view[i - 1]
        if at[i] <= 0.0 and not first and math.hypot(curve[i, 0] - seen_u, curve[i, 1] - seen_v) > _BEYOND_PX:
            continue  # beyond the tip: something else that the trace went on along
        for which in range(2 if first else 1):
            if which == 0:
                u, v, spread = normal[i, 0], normal[i, 1], sigma[i]
            else:
                u, v, spread = tip_along[view[i], 0], tip_along[view[i], 1], tip_sigma[view[i]]
            _fill(design, count, values, by_u, by_v, u, v)
            pieces[count] = piece
            residuals[count] = u * (curve[i, 0] - seen_u) + v * (curve[i, 1] - seen_v)
            sigmas[count] = spread
            if not first:
                wider = half[i] - balls[view[i]] * support(by_u, by_v, u, v)
                if abs(wider) > _LOOSE_WIDTH * spread:
                    residuals[count], sigmas[count] = _one_edge(residuals[count], wider, spread)
            count += 1
    first_end = count
    for i in range(len(end_at)):
        piece, values, _, seen_u, seen_v, by_u, by_v = seen(spans, control, cameras, end_view[i], end_at[i])
        du, dv = end[i, 0] - seen_u, end[i, 1] - seen_v
        distance = math.hypot(du, dv)
        u, v = (du / distance, dv / distance) if distance > 1e-3 else (1.0, 0.0)
        _fill(design, count, values, by_u, by_v, u, v)
        pieces[count] = piece
        residuals[count] = distance - balls[end_view[i]] * support(by_u, by_v, u, v)
        sigmas[count] = end_sigma[i]
        count += 1
    return pieces[:count], design[:count], residuals[:count], sigmas[:count], first_end


@njit(cache=True, nogil=True)
def _fill(design, row, values, by_u, by_v, u, v):  # type: ignore[no-untyped-def]
    """Set a row of the design: how the picture's point along (u, v) moves with the four control points."""
    for axis in range(3):
        slope = u * by_u[axis] + v * by_v[axis]
        for k in range(4):
            design[row, 3 * k + axis] = values[k] * slope


@njit(cache=True, nogil=True)
def _one_edge(residual, wider, spread):  # type: ignore[no-untyped-def]
    """Return (residual, sigma) of a section that is too wide or narrow: by one edge alone where that fits better."""
    best, own = residual, math.hypot(spread, 0.25 * wider)
    for each in (residual - wider, residual + wider):
        if abs(each) < abs(best):
            best, own = each, 2.0 * spread
    return best, own


@njit(cache=True, nogil=True)
def gauss_newton(  # type: ignore[no-untyped-def]
    spans,
    control,
    prior,
    entry,
    cameras,
    at,
    view,
    curve,
    normal,
    sigma,
    half,
    end_at,
    end_view,
    end,
    end_sigma,
    tip_along,
    tip_sigma,
    outlined,
    radius,
    reach,
    iterations,
):
    """Return (control points, normal matrix, the balls' radii (V,)) after robust Gauss-Newton.

    `at` and `end_at` are moved in place; the matrix is (3n, 3n). prior (n, n): information on the control points, the
    same for each axis. entry (3, 2): information on the last control point about the origin, and on the step to it from
    the one before about none, for each axis.
    """
    control = control.copy()
    size = len(control)
    matrix = np.empty((3 * size, 3 * size))
    right = np.empty(3 * size)
    noise = 1.0
    balls = np.full(len(cameras), radius)
    for round_ in range(iterations):
        follow(spans, control, cameras, at, view, curve, outlined)
        if round_ < _WIDTH_ROUNDS:
            balls = radius * widths(spans, control, cameras, at, view, normal, half, radius)
        follow_end(spans, control, cameras, end_at, end_view, end, reach, balls)
        pieces, design, residuals, sigmas, first_end = rows_of(
            spans,
            control,
            cameras,
            at,
            view,
            curve,
            normal,
            sigma,
            half,
            end_at,
            end_view,
            end,
            end_sigma,
            balls,
            tip_along,
            tip_sigma,
            outlined,
        )
        noise = min(max(1.0, 1.4826 * np.median(np.abs(residuals / sigmas))), MAX_NOISE)
        _roughen(residuals, sigmas, first_end, end_view, balls, cameras, control)
        matrix[:] = 0.0
        right[:] = 0.0
        for i in range(size):
            for j in range(size):
                if prior[i, j] != 0.0:
                    for axis in range(3):
                        matrix[3 * i + axis, 3 * j + axis] = prior[i, j]
                        right[3 * i + axis] -= prior[i, j] * control[j, axis]
        for axis in range(3):
            last, other = 3 * (size - 1) + axis, 3 * (size - 2) + axis
            here, step_here = control[size - 1, axis], control[size - 1, axis] - control[size - 2, axis]
            matrix[last, last] += entry[axis, 0] + entry[axis, 1]
            matrix[other, other] += entry[axis, 1]
            matrix[last, other] -= entry[axis, 1]
            right[last] -= entry[axis, 0] * here + entry[axis, 1] * step_here
            right[other] += entry[axis, 1] * step_here
        for i in range(len(residuals)):
            scaled = residuals[i] / (sigmas[i] * noise)
            weight = min(1.0, HUBER / max(abs(scaled), 1e-12)) / (sigmas[i] * noise) ** 2
            if round_ >= _SOFT_ROUNDS and i >= first_end:  # what lies at the end is no noise: it must not pull at all
                weight *= min(1.0, (_REDESCENDING / max(abs(scaled), 1e-12)) ** 2)
            start = 3 * pieces[i]
            for a in range(12):
                part = weight * design[i, a]
                right[start + a] += part * residuals[i]
                for b in range(a + 1):
                    matrix[start + a, start + b] += part * design[i, b]
        for i in range(3 * size):
            for j in range(max(0, i - _BAND), i):
                matrix[j, i] = matrix[i, j]
        step = np.linalg.solve(matrix, right)
        largest = 0.0
        for i in range(size):
            for axis in range(3):
                control[i, axis] += step[3 * i + axis]
                largest = max(largest, abs(step[3 * i + axis]))
        if not largest < 1e6 or (largest < _STILL_MM and round_ >= _SOFT_ROUNDS):
            break
    return control, matrix, balls


@njit(cache=True, nogil=True)
def _roughen(residuals, sigmas, first_end, end_view, balls, cameras, control):  # type: ignore[no-untyped-def]
    """Raise the sigmas of a view's outline, in place, where most of it is off: a real end is no perfect ball.

    Up to a quarter of the radius; what is off by more is not the end.
    """
    count = len(end_view)
    for which in range(len(balls)):
        start = 0
        while start < count and end_view[start] != which:
            start += 1
        stop = start
        while stop < count and end_view[stop] == which:
            stop += 1
        if stop - start < 3:
            continue
        first, last = first_end + start, first_end + stop
        row = cameras[which]
        x, y, z = control[0]
        _, _, by_u, by_v, _ = project_one(x, y, z, row[:9].reshape(3, 3), row[9:12], row[12:14], row[14:16], row[16:21])
        most = ROUGH_RADII * balls[which] * support(by_u, by_v, 1.0, 0.0)
        spread = 1.4826 * np.median(np.abs(residuals[first:last]))
        for i in range(first, last):
            sigmas[i] = min(max(sigmas[i], spread), max(most, sigmas[i]))


@njit(cache=True, nogil=True)
def misfit(spans, control, cameras, at, view, curve, normal):  # type: ignore[no-untyped-def]
    """Return (rms px along the normals, largest distance px of a cap's centre that takes part from the projected)."""
    total = 0.0
    count = 0
    gap = 0.0
    for i in range(len(at)):
        if at[i] < 0.0:
            continue
        _, _, _, u, v, _, _ = seen(spans, control, cameras, view[i], at[i])
        du, dv = curve[i, 0] - u, curve[i, 1] - v
        total += (du * normal[i, 0] + dv * normal[i, 1]) ** 2
        count += 1
        if i == 0 or view[i] != view[i - 1]:
            gap = max(gap, math.hypot(du, dv))
    return math.sqrt(total / max(count, 1)), gap


@njit(cache=True, nogil=True)
def end_residuals(spans, control, cameras, end_at, end_view, end, balls):  # type: ignore[no-untyped-def]
    """Return how far (E,), px, each point of the ends' outlines lies outside the silhouette of the fitted tube."""
    result = np.empty(len(end_at))
    for i in range(len(end_at)):
        _, _, _, u, v, by_u, by_v = seen(spans, control, cameras, end_view[i], end_at[i])
        du, dv = end[i, 0] - u, end[i, 1] - v
        distance = max(math.hypot(du, dv), 1e-9)
        result[i] = distance - balls[end_view[i]] * support(by_u, by_v, du / distance, dv / distance)
    return result


def packed(rotation: FloatArray, translation: FloatArray, intrinsics: FloatArray) -> FloatArray:
    """Return one camera's row (21,): rotation (9), translation (3), focal, centre, distortion (9)."""
    return np.concatenate([rotation.reshape(-1), translation, intrinsics])
