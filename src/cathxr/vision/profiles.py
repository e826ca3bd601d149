"""Cross-sections of a tube in a matte: where its two edges are, to a few hundredths of a pixel. Compiled hot loops."""

import math

import numpy as np
from numba import njit, types
from numba.extending import overload

from cathxr.core import FloatArray
from cathxr.vision.raw import (
    EDGE_SHARE,
    SETTLE_PX,
    SIDE_CHANGE,
    RawSource,
    grey_at,
    light_at,
    look_inside,
    own_darkness,
)
from cathxr.vision.segmentation import MatteArray

SAMPLE_PX = 0.5
"""Distance between samples along a profile."""


def sample(source: MatteArray | RawSource, x: float, y: float) -> float:
    """Return the matte at (x, y) by bilinear interpolation; 0 outside."""
    return float(_sample_one(source, x, y))


@overload(sample)
def _sample_overload(source, x, y):  # type: ignore[no-untyped-def]
    if isinstance(source, types.Array):
        return lambda source, x, y: _sample_matte(source, x, y)
    return lambda source, x, y: _sample_raw(source, x, y)


@njit(cache=True, nogil=True)
def _sample_one(source, x, y):  # type: ignore[no-untyped-def]
    return sample(source, x, y)


@njit(cache=True, nogil=True)
def _sample_matte(matte, x, y):  # type: ignore[no-untyped-def]
    height, width = matte.shape
    if not (0.0 <= x <= width - 1.0 and 0.0 <= y <= height - 1.0):
        return 0.0
    column = min(int(x), width - 2)
    row = min(int(y), height - 2)
    fx = x - column
    fy = y - row
    upper = matte[row, column] * (1.0 - fx) + matte[row, column + 1] * fx
    lower = matte[row + 1, column] * (1.0 - fx) + matte[row + 1, column + 1] * fx
    return float(upper * (1.0 - fy) + lower * fy)


@njit(cache=True, nogil=True)
def _sample_raw(source, x, y):  # type: ignore[no-untyped-def]
    grey = grey_at(source[0], x, y, -1.0)
    return 0.0 if grey < 0.0 else 1.0 - grey / light_at(source, x, y)


@njit(cache=True, nogil=True)
def line_samples(matte: MatteArray, start: FloatArray, step: FloatArray, count: int) -> FloatArray:
    """Return the matte (count,) at start (2,), start + step, start + 2 step, ..."""
    result = np.empty(count)
    for i in range(count):
        result[i] = sample(matte, start[0] + i * step[0], start[1] + i * step[1])
    return result


@njit(cache=True, nogil=True)
def line_levels(matte: MatteArray, points: FloatArray) -> FloatArray:
    """Return the matte (N,) at points (N, 2)."""
    result = np.empty(len(points))
    for i in range(len(points)):
        result[i] = sample(matte, points[i, 0], points[i, 1])
    return result


@njit(cache=True, nogil=True)
def edge(
    matte: MatteArray, x: float, y: float, dx: float, dy: float, reach: float, level: float
) -> tuple[float, float]:
    """Return (distance, slope) of the first fall below `level` from (x, y) along the unit (dx, dy); distance < 0: none.

    The start must lie above the level. `slope` is the fall per pixel at the crossing.
    """
    before = sample(matte, x, y)
    count = int(reach / SAMPLE_PX)
    for i in range(1, count + 1):
        distance = i * SAMPLE_PX
        value = sample(matte, x + distance * dx, y + distance * dy)
        if value < level <= before:
            fraction = (before - level) / (before - value)
            return distance - SAMPLE_PX * (1.0 - fraction), (before - value) / SAMPLE_PX
        before = value
    return -1.0, 0.0


@njit(cache=True, nogil=True)
def settled(
    matte: MatteArray,
    x: float,
    y: float,
    dx: float,
    dy: float,
    found: tuple[float, float],
    inside: tuple[float, float, float],
    usual: float,
) -> tuple[float, float]:
    """Return (distance, slope) of an edge that `edge` found: where it is half as dark as inside it.

    As `raw.settled_edge`, of a matte.
    """
    distance, slope = found
    inner, share, most_change = inside
    if distance < inner:
        return distance, slope
    deep = distance - inner
    deeper = deep - inner
    further = sample(matte, x + deeper * dx, y + deeper * dy)
    level = 0.5 * own_darkness(sample(matte, x + deep * dx, y + deep * dy) / share, further, usual, most_change)
    away = max(distance - SETTLE_PX, deep)
    before = sample(matte, x + away * dx, y + away * dy)
    if before < level:
        return distance, slope
    while away < distance + SETTLE_PX:
        away += SAMPLE_PX
        value = sample(matte, x + away * dx, y + away * dy)
        if value < level:
            return away - SAMPLE_PX * (1.0 - (before - level) / (before - value)), (before - value) / SAMPLE_PX
        before = value
    return distance, slope


@njit(cache=True, nogil=True)
def cross(
    matte: MatteArray, x: float, y: float, nx: float, ny: float, width: float, plateau: float
) -> tuple[float, float, float, float]:
    """Return (offset, width, plateau, slope) of the tube's section through (x, y) along the unit normal (nx, ny).

    `width` and `plateau` are what is expected. offset: of the section's middle along the normal. width < 0: no tube
    there; width = 0: something, but wider than twice the tube.
    """
    level = EDGE_SHARE * plateau
    start = 0.0
    best = sample(matte, x, y)
    if best < level:  # look a little to both sides, nearest first
        found = False
        for i in range(1, int(0.75 * width / SAMPLE_PX) + 1):
            for side in (-1.0, 1.0):
                offset = side * i * SAMPLE_PX
                if sample(matte, x + offset * nx, y + offset * ny) > level:
                    start = offset
                    found = True
                    break
            if found:
                break
        if not found:
            return 0.0, -1.0, 0.0, 0.0
        start += math.copysign(min(1.0, 0.2 * width), start)
        if sample(matte, x + start * nx, y + start * ny) < level:
            start -= math.copysign(min(1.0, 0.2 * width), start)
    reach = 2.0 * width
    slope_left = 0.0
    slope_right = 0.0
    left = 0.0
    right = 0.0
    own, at = plateau, start
    for _ in range(2):  # again with this section's own plateau
        right, slope_right = edge(matte, x + start * nx, y + start * ny, nx, ny, reach, level)
        left, slope_left = edge(matte, x + start * nx, y + start * ny, -nx, -ny, reach, level)
        if right < 0.0 or left < 0.0 or right + left > 2.0 * width:
            return 0.0, 0.0, 0.0, 0.0
        middle = start + 0.5 * (right - left)
        own = 0.0
        for i in range(-2, 3):
            offset = middle + 0.1 * i * (right + left)
            own += 0.2 * sample(matte, x + offset * nx, y + offset * ny)
        at, level = start, EDGE_SHARE * own
        start = middle
    x, y, inside = (
        x + at * nx,
        y + at * ny,
        look_inside(right + left, own / max(slope_left, slope_right, 1e-6), SIDE_CHANGE),
    )
    right, slope_right = settled(matte, x, y, nx, ny, (right, slope_right), inside, own)
    left, slope_left = settled(matte, x, y, -nx, -ny, (left, slope_left), inside, own)
    return at + 0.5 * (right - left), right + left, own, 0.5 * (slope_left + slope_right)
