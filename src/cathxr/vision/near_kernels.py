"""Measuring where a catheter is expected: sections across a predicted line. Compiled."""

import math

from numba import njit

from cathxr.vision.midline_kernels import set_normals, smooth
from cathxr.vision.near_expected import spread
from cathxr.vision.near_work import MOST_POINTS
from cathxr.vision.raw import EDGE_SHARE, SIDE_CHANGE, STEP_PX, dark_edge, grey_at, light_at, look_inside, settled_edge

SPACING_PX = 4.0
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


@njit(cache=True, nogil=True)
def sections_near(source, count, plateau, work):  # type: ignore[no-untyped-def]
    """Set points, normals, sections and state of `work` along its path of `count` points, tip first; return how many.

    state: 2 measured, 1 expected but not found, 0 not to be seen there: the tube crosses itself or points at the
    camera. sections: as of `section_near`.
    """
    total, spacing = spread(count, SPACING_PX, MOST_POINTS, work)
    points, normals, sections, width = work.points, work.normals, work.sections, work.width
    set_normals(points, total, normals)
    _set_visible(work, total, spacing)
    for i in range(total):
        work.offsets[i], work.rough[i] = 0.0, 0
        sections[i] = 0.0
    for i in range(0, total, _ROUGH_EVERY):
        if work.state[i] == 0:
            continue
        offset, wide = rough_near(source, points[i, 0], points[i, 1], normals[i, 0], normals[i, 1], width[i], plateau)
        if abs(wide - width[i]) < _WIDTH_OFF * width[i]:
            work.rough[i] = 2
            work.offsets[i] = offset
    _fill_between(work.offsets, work.rough, total)
    for i in range(total):
        work.moved[i, 0] = points[i, 0] + work.offsets[i] * normals[i, 0]
        work.moved[i, 1] = points[i, 1] + work.offsets[i] * normals[i, 1]
    smooth(work.moved, total, max(2, round(0.6 * width[0] / spacing)), points)
    set_normals(points, total, normals)
    for i in range(total):
        if work.state[i] == 0:
            continue
        offset, wide, own, slope = section_near(
            source, points[i, 0], points[i, 1], normals[i, 0], normals[i, 1], width[i]
        )
        if abs(wide - width[i]) < _WIDTH_OFF * width[i]:
            work.state[i] = 2
            sections[i, 0], sections[i, 1], sections[i, 2], sections[i, 3] = offset, wide, own, slope
            points[i, 0] += offset * normals[i, 0]
            points[i, 1] += offset * normals[i, 1]
    return total


@njit(cache=True, nogil=True)
def rough_near(source, x, y, nx, ny, width, plateau):  # type: ignore[no-untyped-def]
    """Return (offset, width) of the tube's section through (x, y), to a part of a pixel; width < 0: no tube there.

    Where (x, y) is not on the tube, it is looked for to both sides, nearest first. As one round of `profiles.cross`.
    """
    pixels = source[0]
    light = light_at(source, x, y)
    limit = (1.0 - EDGE_SHARE * plateau) * light
    start = 0.0
    if grey_at(pixels, x, y, 1e9) > limit:
        for i in range(1, int(0.75 * width / STEP_PX) + 1):
            for side in (-1.0, 1.0):
                offset = side * i * STEP_PX
                if grey_at(pixels, x + offset * nx, y + offset * ny, 1e9) < limit:
                    start = offset
                    break
            if start != 0.0:
                break
        if start == 0.0:
            return 0.0, -1.0
        further = start + math.copysign(min(1.0, 0.2 * width), start)
        if grey_at(pixels, x + further * nx, y + further * ny, 1e9) < limit:
            start = further
    x, y = x + start * nx, y + start * ny
    right, _ = dark_edge(pixels, x, y, nx, ny, 2.0 * width, limit, 0.0)
    if right < 0.0:
        return 0.0, -1.0
    left, _ = dark_edge(pixels, x, y, -nx, -ny, 2.0 * width, limit, 0.0)
    if left < 0.0:
        return 0.0, -1.0
    return start + 0.5 * (right - left), right + left


@njit(cache=True, nogil=True)
def section_near(source, x, y, nx, ny, width):  # type: ignore[no-untyped-def]
    """Return (offset, width, plateau, slope) of a section whose middle is known to a quarter of its width.

    offset: of the section's middle along the normal; plateau: mean darkness on it; slope: fall of darkness per pixel at
    its edges. Only the two edges and five samples between them are looked at. The light is taken to change evenly
    across the section. width < 0: no tube there.
    """
    pixels = source[0]
    half = 0.7 * width
    lower = light_at(source, x - half * nx, y - half * ny)
    upper = light_at(source, x + half * nx, y + half * ny)
    middle, change = 0.5 * (lower + upper), (upper - lower) / (2.0 * half)
    own = 0.0
    for i in range(-2, 3):
        offset = 0.1 * i * width
        behind = middle + offset * change
        own += 0.2 * (1.0 - grey_at(pixels, x + offset * nx, y + offset * ny, behind) / behind)
    through = 1.0 - EDGE_SHARE * own
    inner = 0.22 * width
    right, fall_right = _edge_near(pixels, x, y, nx, ny, (width, inner, through), middle, change)
    if right < 0.0:
        return 0.0, -1.0, 0.0, 0.0
    left, fall_left = _edge_near(pixels, x, y, -nx, -ny, (width, inner, through), middle, -change)
    if left < 0.0:
        return 0.0, -1.0, 0.0, 0.0
    inside = look_inside(width, own * middle / max(fall_left, fall_right, 1e-3), SIDE_CHANGE)
    right, fall_right = settled_edge(pixels, x, y, nx, ny, (right, fall_right), inside, own, middle, change)
    left, fall_left = settled_edge(pixels, x, y, -nx, -ny, (left, fall_left), inside, own, middle, -change)
    return 0.5 * (right - left), right + left, own, 0.5 * (fall_left + fall_right) / middle


@njit(cache=True, nogil=True)
def _edge_near(pixels, x, y, nx, ny, shape, light, change):  # type: ignore[no-untyped-def]
    """Return (distance, fall) of the tube's edge from its middle (x, y) along the unit (nx, ny); distance < 0: none.

    shape: (width, where the search begins, the share of the light that an edge is looked for at). light + change times
    the distance: the back-light.
    """
    width, inner, through = shape
    limit = through * (light + inner * change)
    distance, fall = dark_edge(pixels, x + inner * nx, y + inner * ny, nx, ny, 0.7 * width, limit, through * change)
    return (distance + inner, fall) if distance >= 0.0 else (-1.0, 0.0)


@njit(cache=True, nogil=True)
def _set_visible(work, count, spacing):  # type: ignore[no-untyped-def]
    """Set `state` of `work`: 1 where a section can be measured, 0 where the tube is in its own way."""
    points, width, state = work.points, work.width, work.state
    reach = max(1, round(0.5 * width[0] / spacing))
    stride = max(1, int(0.5 * width[0] / spacing))
    for i in range(count):
        state[i] = 0
        if work.share[i] < _LEAST_LENGTH_SHARE:
            continue
        before, after = max(i - reach, 0), min(i + reach, count - 1)
        if before < i < after:
            ax, ay = points[i, 0] - points[before, 0], points[i, 1] - points[before, 1]
            bx, by = points[after, 0] - points[i, 0], points[after, 1] - points[i, 1]
            if abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by)) > 2.0 * _SHARPEST:
                continue
        apart = round(_APART_WIDTHS * width[i] / spacing)
        touching = (_TOUCHING_WIDTHS * width[i]) ** 2
        clear = True
        for j in range(0, count, stride):
            dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
            if dx * dx + dy * dy < touching and abs(i - j) > apart:
                clear = False
                break
        if clear:
            state[i] = 1


@njit(cache=True, nogil=True)
def _fill_between(offsets, state, count):  # type: ignore[no-untyped-def]
    """Fill offsets (N,) between measured ones by straight lines, before the first and after the last by these."""
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
