"""Measuring where a catheter is expected: sections across a predicted line and the outline of its end. Compiled."""

import math

import numpy as np
from numba import njit

from cathxr.vision.midline_kernels import END_FAR, END_RAYS, END_REACH_RAD, normals_of, smoothed
from cathxr.vision.profiles import cross, edge, sample

SPACING_PX = 4.0
MOST_POINTS = 110
_LEAST_LENGTH_SHARE = 0.15
"""Where the tube is more foreshortened than this its silhouette is not made by the sections there."""
_ROUGH_EVERY = 2
"""The first round, which finds out how far the prediction is off, needs only some of the sections."""
_WIDTH_OFF = 0.3
"""A section whose width is off by more than this share is not the tube alone."""
_APART_WIDTHS = 3.0
_TOUCHING_WIDTHS = 1.3
"""What is farther along the tube than the first and nearer in the picture than the second hides its edges."""
_SHARPEST = 0.8
"""Sections are no sections where the projected line turns by more than this, rad, within one radius."""
_CIRCLE_ROUNDS = 3
_CAP_REACH_RAD = 1.3


@njit(cache=True, nogil=True)
def sections_near(source, path, widths, shares, plateau):  # type: ignore[no-untyped-def]
    """Return (points (N, 2), normals (N, 2), sections (N, 4), state (N,)) measured along a predicted line, tip first.

    path (K, 2) px; widths (K,) px, of the tube as expected there; shares (K,): of its length that the picture shows, 1
    where it lies across the line of sight. state: 2 measured, 1 expected but not found, 0 not to
    be seen there: the tube crosses itself or points at the camera.
    """
    points, width, share, spacing = _spread(path, widths, shares)
    count = len(points)
    normals = normals_of(points)
    state = _visible(points, width, share, spacing)
    sections = np.zeros((count, 4))
    offsets = np.zeros(count)
    rough = np.zeros(count, dtype=np.int64)
    for i in range(0, count, _ROUGH_EVERY):
        if state[i] == 0:
            continue
        sections[i] = cross(source, points[i, 0], points[i, 1], normals[i, 0], normals[i, 1], width[i], plateau)
        if abs(sections[i, 1] - width[i]) < _WIDTH_OFF * width[i]:
            rough[i] = 2
            offsets[i] = sections[i, 0]
    _filled(offsets, rough)
    for i in range(count):
        points[i, 0] += offsets[i] * normals[i, 0]
        points[i, 1] += offsets[i] * normals[i, 1]
    points = smoothed(points, max(2, round(0.6 * width[0] / spacing)))
    normals = normals_of(points)
    for i in range(count):
        if state[i] == 0:
            continue
        sections[i] = section_near(source, points[i, 0], points[i, 1], normals[i, 0], normals[i, 1], width[i])
        if abs(sections[i, 1] - width[i]) < _WIDTH_OFF * width[i]:
            state[i] = 2
            points[i, 0] += sections[i, 0] * normals[i, 0]
            points[i, 1] += sections[i, 0] * normals[i, 1]
    return points, normals, sections, state


@njit(cache=True, nogil=True)
def _spread(path, widths, shares):  # type: ignore[no-untyped-def]
    """Return (points, widths, shares, spacing px) evenly along a line (K, 2), with what belongs to them."""
    along = np.zeros(len(path))
    for i in range(1, len(path)):
        along[i] = along[i - 1] + math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    count = int(min(max(along[-1] / SPACING_PX, 6.0), float(MOST_POINTS)))
    spacing = max(along[-1] / (count - 1), 1e-3)
    points, width, share = np.empty((count, 2)), np.empty(count), np.empty(count)
    j = 0
    for i in range(count):
        while j < len(path) - 2 and along[j + 1] < spacing * i:
            j += 1
        part = min(max((spacing * i - along[j]) / max(along[j + 1] - along[j], 1e-9), 0.0), 1.0)
        for axis in range(2):
            points[i, axis] = path[j, axis] + part * (path[j + 1, axis] - path[j, axis])
        width[i] = widths[j] + part * (widths[j + 1] - widths[j])
        share[i] = shares[j] + part * (shares[j + 1] - shares[j])
    return points, width, share, spacing


@njit(cache=True, nogil=True)
def section_near(source, x, y, nx, ny, width):  # type: ignore[no-untyped-def]
    """Return (offset, width, plateau, slope) of a section whose middle is known to a quarter of its width.

    As `profiles.cross`, but only the two edges and five samples between them are looked at. width < 0: no tube there.
    """
    own = 0.0
    for i in range(-2, 3):
        offset = 0.1 * i * width
        own += 0.2 * sample(source, x + offset * nx, y + offset * ny)
    level = 0.5 * own
    inner = 0.22 * width
    right, slope_right = edge(source, x + inner * nx, y + inner * ny, nx, ny, 0.7 * width, level)
    left, slope_left = edge(source, x - inner * nx, y - inner * ny, -nx, -ny, 0.7 * width, level)
    if right < 0.0 or left < 0.0:
        return 0.0, -1.0, 0.0, 0.0
    return 0.5 * (right - left), right + left + 2.0 * inner, own, 0.5 * (slope_left + slope_right)


@njit(cache=True, nogil=True)
def _visible(points, width, share, spacing):  # type: ignore[no-untyped-def]
    """Return state (N,): 1 where a section can be measured, 0 where the tube is in its own way."""
    count = len(points)
    state = np.ones(count, dtype=np.int64)
    reach = max(1, round(0.5 * width[0] / spacing))
    stride = max(1, int(0.5 * width[0] / spacing))
    for i in range(count):
        if share[i] < _LEAST_LENGTH_SHARE:
            state[i] = 0
            continue
        before, after = max(i - reach, 0), min(i + reach, count - 1)
        ax, ay = points[i, 0] - points[before, 0], points[i, 1] - points[before, 1]
        bx, by = points[after, 0] - points[i, 0], points[after, 1] - points[i, 1]
        if before < i < after and abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by)) > 2.0 * _SHARPEST:
            state[i] = 0
            continue
        apart = round(_APART_WIDTHS * width[i] / spacing)
        touching = (_TOUCHING_WIDTHS * width[i]) ** 2
        for j in range(0, count, stride):
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            if dx * dx + dy * dy < touching and abs(i - j) > apart:
                state[i] = 0
                break
    return state


@njit(cache=True, nogil=True)
def _filled(offsets, state):  # type: ignore[no-untyped-def]
    """Fill offsets (N,) between measured ones by straight lines, before the first and after the last by these."""
    count = len(offsets)
    last = -1
    for i in range(count):
        if state[i] != 2:
            continue
        for j in range(last + 1, i):
            share = 1.0 if last < 0 else (j - last) / (i - last)
            offsets[j] = offsets[i] if last < 0 else offsets[last] + share * (offsets[i] - offsets[last])
        last = i
    for j in range(last + 1, count):
        offsets[j] = offsets[last] if last >= 0 else 0.0


@njit(cache=True, nogil=True)
def end_near(source, centre, direction, radius, plateau, blur):  # type: ignore[no-untyped-def]
    """Return (centre (2,), outline (M, 2), rms px): the rounded end of known radius near where it is expected.

    Rays from the centre find the outline, a circle through its front part the centre, in turn. Rays that go on far are
    left out: they run along the tube. rms: of the front part about the circle; negative: there is no end there.
    """
    x, y = centre[0], centre[1]
    level = 0.5 * plateau
    tries = 0
    while sample(source, x, y) < level:  # beyond the end: come back along the tube
        x -= 0.5 * radius * direction[0]
        y -= 0.5 * radius * direction[1]
        tries += 1
        if tries > 6:
            return centre, np.empty((0, 2)), -1.0
    outline = np.empty((END_RAYS, 2))
    apparent = radius - blur * blur / (2.0 * radius)
    count = 0
    rms = -1.0
    for _ in range(_CIRCLE_ROUNDS):
        count = 0
        front = 0
        jxx = jxy = jyy = 1e-3
        jxy = 0.0
        gx = gy = 0.0
        total = 0.0
        for i in range(END_RAYS):
            angle = END_REACH_RAD * (2.0 * i / (END_RAYS - 1) - 1.0)
            c, s = math.cos(angle), math.sin(angle)
            dx = c * direction[0] - s * direction[1]
            dy = s * direction[0] + c * direction[1]
            distance, _ = edge(source, x, y, dx, dy, END_FAR * radius, level)
            if distance < 0.0:
                continue
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
            return centre, outline[:0].copy(), -1.0
        rms = math.sqrt(total / front)
        determinant = max(jxx * jyy - jxy * jxy, 1e-9)
        step_x, step_y = (jyy * gx - jxy * gy) / determinant, (jxx * gy - jxy * gx) / determinant
        if math.hypot(step_x, step_y) < 0.02:
            break
        limit = min(1.0, radius / max(math.hypot(step_x, step_y), 1e-9))
        x += limit * step_x
        y += limit * step_y
        if sample(source, x, y) < level:
            return centre, outline[:0].copy(), -1.0
    return np.array([x, y]), outline[:count].copy(), rms


@njit(cache=True, nogil=True)
def medians(values):  # type: ignore[no-untyped-def]
    """Return the medians (M,) of the columns of (N, M)."""
    result = np.empty(values.shape[1])
    for k in range(values.shape[1]):
        result[k] = np.median(np.ascontiguousarray(values[:, k]))
    return result
