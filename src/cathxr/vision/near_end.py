"""A catheter's rounded end where it is expected, and the whole measured midline with it. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.geometry.medians import median_of
from cathxr.vision.midline_kernels import END_FAR, END_RAYS, END_REACH_RAD, set_normals, smooth
from cathxr.vision.near_expected import ALONE, BENT, expect, offset_from
from cathxr.vision.near_kernels import sections_near
from cathxr.vision.raw import (
    EDGE_SHARE,
    END_CHANGE,
    apart,
    dark_edge,
    grey_at,
    light_at,
    light_gain,
    look_inside,
    settled_edge,
)

FOUND, NOTHING = 1, 0
_LEAST_SHARE = 0.75
"""So much of what should be seen must be: else the picture shows something else, and all of it is looked at."""
_LEAST_SECTIONS = 5
_MOST_MISSED = 5
"""Where more sections in a row than this are not where they should be, the tube may run otherwise there."""
_LIGHTEST, _DARKEST = 1.6, 0.6
_MOST_HIDDEN_WIDTHS = 6.0
"""Where a longer part than this lies along another, the whole silhouette says more about both."""
_ROUND_SHARE = 0.12
_ROUND_PX = 0.3
"""An end whose outline is off a circle by more than these, share of the radius and px, is looked at in full."""
_NEAR_SECTIONS = 8
_END_SECTIONS = 12
_OWN_SECTIONS = 5
"""An end is as dark as so many sections next to it, and another part of the tube may have another colour."""
_CIRCLE_ROUNDS = 3
_CAP_REACH_RAD = 1.3
_LEAST_SIGMA_PX = 0.02
"""Sampling and interpolation alone leave about this much, however clean the picture."""
_QUANTUM_PX = 1e-4
"""Measurements are rounded to this, far below their noise, so that recordings stay small and exact."""
_SMOOTH = 4


@njit(cache=True, nogil=True)
def measure(source, count, radius_mm, ratio, plateau, camera, size, work):  # type: ignore[no-untyped-def]
    """Return (code, N, E, sigma px, tip u, tip v, plateau, ratio, sure): the catheter where `work.shape` has it.

    count: of the shape's points; ratio, plateau: how it looked last; camera, size: see `expect`. N points are in the
    curve, curve_normal, curve_sigma and half_width of `work`, tip first, E in its outline; sigma: of a section's middle
    as a rule. sure: the end is beyond doubt. code: FOUND, or NOTHING where too little is seen.
    """
    nothing = (NOTHING, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
    known, tip_u, tip_v, alone = expect(count, radius_mm, ratio, camera, size, work)
    if known < 2:
        return nothing
    set_normals(work.path, known, work.path_normals)
    gain = light_gain(source, work.path, work.path_normals, known, 1.6 * work.widths[0], work.scratch)
    if not _DARKEST < gain < _LIGHTEST:
        return nothing
    lit = (source[0], source[1], source[2], gain)
    total = sections_near(lit, known, plateau, work)
    good, expected, first = 0, 0, -1
    seen = missed = most_missed = 0
    hidden = most_hidden = 0.0
    for i in range(total):
        if work.state[i] > 0:
            hidden = 0.0
        elif i > 0:
            x, y = work.points[i - 1, 0], work.points[i - 1, 1]
            hidden += apart(work.points[i, 0], work.points[i, 1], x, y) / work.width[i]
            most_hidden = max(most_hidden, hidden)
        expected += work.state[i] > 0
        missed += work.state[i] == 1
        if work.state[i] == 2:
            first = i if first < 0 else first
            good += 1
            seen = expected  # the inlet hides the rest
            most_missed, missed = max(most_missed, missed), 0
    if good < _LEAST_SECTIONS or good < _LEAST_SHARE * seen:
        return nothing
    radius = 0.5 * _median(work, total, 1, _END_SECTIONS)
    wide, own, slope = _median(work, total, 1, total), _median(work, total, 2, total), _median(work, total, 3, total)
    end_own = _median(work, total, 2, _OWN_SECTIONS)
    blur = min(max(own / max(slope, 1e-6) / math.sqrt(2.0 * math.pi), 0.3), max(0.5 * radius, 0.3))
    x, y = work.path[0, 0], work.path[0, 1]
    dx, dy = tip_u - x, tip_v - y
    if math.sqrt(dx * dx + dy * dy) < 0.2 * radius:  # it points at the camera: any direction, best away from the tube
        behind = min(3, known - 1)
        dx, dy = x - work.path[behind, 0], y - work.path[behind, 1]
    length = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    dx, dy = dx / length, dy / length
    if first < _NEAR_SECTIONS:  # the nearest sections say how far the end lies to the side of where it was expected
        ox, oy = offset_from(work.path, known, work.points[first, 0], work.points[first, 1])
        x, y = x + ox, y + oy
    x, y, outlined, rms = end_near(lit, x, y, dx, dy, radius, end_own, blur, work.outline)
    points, sigma = _line_with_end(work, total, x, y, dx, dy, radius)
    if points <= _LEAST_SECTIONS:
        return nothing
    for i in range(outlined):
        work.outline[i, 0], work.outline[i, 1] = _rounded(work.outline[i, 0]), _rounded(work.outline[i, 1])
    sure = alone == BENT or (alone == ALONE and 0.0 <= rms < _ROUND_PX + _ROUND_SHARE * radius)
    sure = sure and most_missed <= _MOST_MISSED and most_hidden <= _MOST_HIDDEN_WIDTHS
    ratio *= wide / work.widths[known // 2]
    return (
        FOUND, points, outlined, sigma, _rounded(x + radius * dx), _rounded(y + radius * dy), own, ratio, sure,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _median(work, total, column, most):  # type: ignore[no-untyped-def]
    """Return the median of a column of the first `most` measured sections."""
    count = 0
    for i in range(total):
        if work.state[i] == 2 and count < most:
            work.scratch[count] = work.sections[i, column]
            count += 1
    return median_of(work.scratch, count)


@njit(cache=True, nogil=True)
def end_near(source, x, y, ax, ay, radius, plateau, blur, outline):  # type: ignore[no-untyped-def]
    """Fill `outline` (E, 2); return (u, v, E, rms px): the rounded end of known radius near (x, y), where it should be.

    Rays from the centre find the outline, a circle through its front part the centre, in turn. Rays that go on far are
    left out: they run along the tube. (ax, ay): unit, ahead. rms: of the front part about the circle; negative: there
    is no end there. The light is taken to change evenly over the end.
    """
    pixels = source[0]
    through = 1.0 - EDGE_SHARE * plateau
    begun_x, begun_y = x, y
    tries = 0
    while not grey_at(pixels, x, y, 1e9) <= through * light_at(source, x, y):  # beyond the end: come back on the tube
        x -= 0.5 * radius * ax
        y -= 0.5 * radius * ay
        tries += 1
        if tries > 6:
            return begun_x, begun_y, 0, -1.0
    by_x = (light_at(source, x + radius, y) - light_at(source, x - radius, y)) / (2.0 * radius)
    by_y = (light_at(source, x, y + radius) - light_at(source, x, y - radius)) / (2.0 * radius)
    apparent = radius - blur * blur / (2.0 * radius)
    inside = look_inside(2.0 * radius, math.sqrt(2.0 * math.pi) * blur, END_CHANGE)
    count = 0
    rms = -1.0
    for _ in range(_CIRCLE_ROUNDS):
        count = 0
        front = 0
        jxx = jyy = 1e-3
        jxy = gx = gy = total = 0.0
        bright = through * light_at(source, x, y)
        for i in range(END_RAYS):
            angle = END_REACH_RAD * (2.0 * i / (END_RAYS - 1) - 1.0)
            c, s = math.cos(angle), math.sin(angle)
            dx, dy = c * ax - s * ay, s * ax + c * ay
            tilt = through * (by_x * dx + by_y * dy)
            found = dark_edge(pixels, x, y, dx, dy, END_FAR * radius, bright, tilt)
            if found[0] < 0.0:
                continue
            distance, _ = settled_edge(pixels, x, y, dx, dy, found, inside, plateau, bright / through, tilt / through)
            outline[count, 0] = x + (distance + radius - apparent) * dx
            outline[count, 1] = y + (distance + radius - apparent) * dy
            count += 1
            if abs(angle) < _CAP_REACH_RAD:
                off = distance - apparent
                weight = min(1.0, 0.25 * radius / max(abs(off), 1e-9))
                jxx += weight * dx * dx
                jxy += weight * dx * dy
                jyy += weight * dy * dy
                gx += weight * off * dx
                gy += weight * off * dy
                total += off * off
                front += 1
        if front < 5:
            return begun_x, begun_y, 0, -1.0
        rms = math.sqrt(total / front)
        determinant = max(jxx * jyy - jxy * jxy, 1e-9)
        step_x, step_y = (jyy * gx - jxy * gy) / determinant, (jxx * gy - jxy * gx) / determinant
        step = math.sqrt(step_x * step_x + step_y * step_y)
        if step < 0.02:
            break
        limit = min(1.0, radius / max(step, 1e-9))
        x += limit * step_x
        y += limit * step_y
        if not grey_at(pixels, x, y, 1e9) <= through * light_at(source, x, y):
            return begun_x, begun_y, 0, -1.0
    return x, y, count, rms


@njit(cache=True, nogil=True)
def _line_with_end(work, total, x, y, dx, dy, radius):  # type: ignore[no-untyped-def]
    """Set curve, curve_normal, curve_sigma and half_width of `work`, the end's centre (x, y) first.

    Return (how many, a section's usual sigma). Sections on the rounded end are left out. As `midline.midline_of`.
    """
    curve, normal = work.curve, work.curve_normal
    curve[0, 0], curve[0, 1] = x, y
    normal[0, 0], normal[0, 1] = -dy, dx
    work.half_width[0] = radius
    count = 1
    for i in range(total):
        if work.state[i] != 2:
            continue
        px, py = work.points[i, 0] - x, work.points[i, 1] - y
        if px * dx + py * dy > -0.25 * radius and apart(px, py, 0.0, 0.0) < 2.0 * radius:
            continue
        curve[count] = work.points[i]
        normal[count] = work.normals[i]
        work.half_width[count] = 0.5 * work.sections[i, 1]
        count += 1
    measured = count - 1
    smooth(curve[1:], measured, _SMOOTH, work.moved)
    for i in range(measured):
        residual = 0.0
        for axis in range(2):
            residual += (curve[i + 1, axis] - work.moved[i, axis]) * normal[i + 1, axis]
        work.curve_sigma[i + 1] = residual
        work.scratch[i] = abs(residual)
    sigma = max(_LEAST_SIGMA_PX, 1.4826 * median_of(work.scratch, measured) * 1.25)
    work.curve_sigma[0] = 1.5 * sigma
    for i in range(1, count):
        work.curve_sigma[i] = sigma * math.sqrt(1.0 + (work.curve_sigma[i] / (3.0 * sigma)) ** 2)
    for i in range(count):
        curve[i, 0], curve[i, 1] = _rounded(curve[i, 0]), _rounded(curve[i, 1])
    return count, sigma


@njit(cache=True, nogil=True)
def _rounded(value):  # type: ignore[no-untyped-def]
    return np.rint(value / _QUANTUM_PX) * _QUANTUM_PX
