"""Looking at a back-lit picture as it is: grey values and the back-light behind them, where they are asked for."""

import math

import numpy as np
from numba import njit, types
from numba.extending import overload

from cathxr.core import PixelArray
from cathxr.geometry.medians import median_of
from cathxr.vision.segmentation import MatteArray

STEP_PX = 0.5
"""Distance between samples where an edge is looked for."""

EDGE_SHARE = 0.43
"""An edge is looked for at this share of a tube's usual darkness first: one side may be lit, see `settled_edge`."""
SETTLE_PX = 1.25
"""How far from there an edge may lie."""
SIDE_CHANGE, END_CHANGE = 0.15, 0.0
"""A lit side gets brighter up to its edge; of a round end less is known, for its rays run along the tube too."""
_ALIKE = 0.06
"""A sample that differs from the usual darkness by no more than this share of it differs by noise."""
_INNER_PX, _INNER_RAMPS, _INNER_WIDTHS = 0.85, 0.65, 0.35

RawSource = tuple[PixelArray, MatteArray, float, float]
"""A back-lit picture as it is, the back-light at reduced size, pixels for each of its own, and the light's gain since.

Where a matte is asked for, this serves too: the matte is worked out where it is looked at and nowhere else.
"""


@njit(cache=True, nogil=True)
def light_at(source, x, y):  # type: ignore[no-untyped-def]
    """Return the back-light at a picture's pixel (x, y), at least 1."""
    _, light, step, gain = source
    rows, columns = light.shape
    across = min(max((x - 0.5 * (step - 1.0)) / step, 0.0), columns - 1.001)
    down = min(max((y - 0.5 * (step - 1.0)) / step, 0.0), rows - 1.001)
    column, row = int(across), int(down)
    fx, fy = across - column, down - row
    left, upper = np.uintp(column), np.uintp(row)
    right, lower = np.uintp(column + 1), np.uintp(row + 1)
    above = light[upper, left] * (1.0 - fx) + light[upper, right] * fx
    below = light[lower, left] * (1.0 - fx) + light[lower, right] * fx
    return max(gain * (above * (1.0 - fy) + below * fy), 1.0)


def grey_at(pixels: PixelArray, x: float, y: float, outside: float) -> float:
    """Return the grey level at (x, y) by bilinear interpolation, `outside` beyond the picture."""
    return float(_grey_one(pixels, x, y, outside))


@overload(grey_at)
def _grey_overload(pixels, x, y, outside):  # type: ignore[no-untyped-def]
    if isinstance(pixels, types.Array) and pixels.ndim == 3:
        return lambda pixels, x, y, outside: _coloured(pixels, x, y, outside)
    return lambda pixels, x, y, outside: _plain(pixels, x, y, outside)


@njit(cache=True, nogil=True)
def _grey_one(pixels, x, y, outside):  # type: ignore[no-untyped-def]
    return grey_at(pixels, x, y, outside)


@njit(cache=True, nogil=True)
def _plain(pixels, x, y, outside):  # type: ignore[no-untyped-def]
    height, width = pixels.shape
    if not (0.0 <= x <= width - 1.0 and 0.0 <= y <= height - 1.0):
        return outside
    column, row = min(int(x), width - 2), min(int(y), height - 2)
    fx, fy = x - column, y - row
    # indices without a sign need no look at whether they count from the end
    left, upper = np.uintp(column), np.uintp(row)
    right, lower = np.uintp(column + 1), np.uintp(row + 1)
    above = pixels[upper, left] * (1.0 - fx) + pixels[upper, right] * fx
    below = pixels[lower, left] * (1.0 - fx) + pixels[lower, right] * fx
    return above + (below - above) * fy


@njit(cache=True, nogil=True)
def _coloured(pixels, x, y, outside):  # type: ignore[no-untyped-def]
    height, width = pixels.shape[0], pixels.shape[1]
    if not (0.0 <= x <= width - 1.0 and 0.0 <= y <= height - 1.0):
        return outside
    column, row = min(int(x), width - 2), min(int(y), height - 2)
    fx, fy = x - column, y - row
    left, upper = np.uintp(column), np.uintp(row)
    right, lower = np.uintp(column + 1), np.uintp(row + 1)
    above = _weighted(pixels, upper, left) * (1.0 - fx) + _weighted(pixels, upper, right) * fx
    below = _weighted(pixels, lower, left) * (1.0 - fx) + _weighted(pixels, lower, right) * fx
    return (above + (below - above) * fy) / 16384.0


@njit(cache=True, nogil=True)
def _weighted(pixels, row, column):  # type: ignore[no-untyped-def]
    """Return 16384 times a pixel without its colour, weighted as OpenCV does: whole numbers are quick."""
    return (
        1868 * np.int32(pixels[row, column, 0])
        + 9617 * np.int32(pixels[row, column, 1])
        + 4899 * np.int32(pixels[row, column, 2])
    )


@njit(cache=True, nogil=True)
def dark_edge(pixels, x, y, dx, dy, reach, bright, slope):  # type: ignore[no-untyped-def]
    """Return (distance, fall) of where it first gets bright from (x, y) along the unit (dx, dy); distance < 0: nowhere.

    Bright is `bright` + `slope` times the distance, grey levels. fall: of darkness per pixel there. As `profiles.edge`
    with the matte's level, for a light that changes evenly on the way. The start must be dark.
    """
    before = bright - grey_at(pixels, x, y, 1e9)
    count = int(reach / STEP_PX)
    for i in range(1, count + 1):
        distance = i * STEP_PX
        limit = bright + slope * distance
        dark = limit - grey_at(pixels, x + distance * dx, y + distance * dy, 1e9)
        if dark < 0.0 <= before:
            if dark < -1e6:  # beyond the picture
                return -1.0, 0.0
            return distance - STEP_PX * (1.0 - before / (before - dark)), (before - dark) / STEP_PX
        before = dark
    return -1.0, 0.0


@njit(cache=True, nogil=True)
def look_inside(width, ramp, most_change):  # type: ignore[no-untyped-def]
    """Return (px, share, most_change): how far inside its edge a tube's darkness is looked at, and what of it is there.

    px: beyond the blur, if that is before the middle. share: of the darkness, that the blur leaves there. most_change:
    by what share of itself it may change on from there to the edge, see `SIDE_CHANGE`, `END_CHANGE`. ramp: how long an
    edge of its usual darkness takes to fall, px, by the steeper of its edges, for the other may be lit: sqrt(2 pi)
    times a Gaussian blur.
    """
    ramp = max(ramp, 1e-6)  # where there is no tube, what is seen may be brighter than the light
    px = min(_INNER_PX + _INNER_RAMPS * ramp, _INNER_WIDTHS * width)
    return px, 0.5 + 0.5 * math.erf(math.sqrt(math.pi) * px / ramp), most_change


@njit(cache=True, nogil=True)
def own_darkness(seen, further, usual, most_change):  # type: ignore[no-untyped-def]
    """Return the darkness at an edge: the usual one, which has less noise, unless what is seen near it differs.

    seen: inside the edge; further: as far again from it. What changes there goes on changing up to the edge.
    """
    most_change *= max(seen, 0.0)
    share = abs(seen - usual) / max(_ALIKE * usual, 1e-9) - 1.0
    at_edge = seen + min(max(seen - further, -most_change), most_change)
    return usual + min(max(share, 0.0), 1.0) * (at_edge - usual)


@njit(cache=True, nogil=True)
def settled_edge(pixels, x, y, dx, dy, found, inside, usual, light, slope):  # type: ignore[no-untyped-def]
    """Return (distance, fall) of an edge that `dark_edge` found: where it is half as dark as the tube inside it.

    A tube that something lights from one side is less dark there, and half of its usual darkness lies too far in.
    found: what was found, and what is returned where there is no such edge. inside: as of `look_inside`; usual: the
    tube's usual darkness. light + slope times the distance: the back-light itself.
    """
    distance, fall = found
    inner, share, most_change = inside
    if distance < inner:
        return distance, fall
    deep = distance - inner
    behind = light + slope * deep
    seen = 1.0 - grey_at(pixels, x + deep * dx, y + deep * dy, behind) / behind
    deeper = deep - inner
    behind = light + slope * deeper
    further = 1.0 - grey_at(pixels, x + deeper * dx, y + deeper * dy, behind) / behind
    half = 1.0 - 0.5 * own_darkness(seen / share, further, usual, most_change)
    away = max(distance - SETTLE_PX, deep)
    before = half * (light + slope * away) - grey_at(pixels, x + away * dx, y + away * dy, 1e9)
    if before < 0.0:
        return distance, fall
    while away < distance + SETTLE_PX:
        away += STEP_PX
        dark = half * (light + slope * away) - grey_at(pixels, x + away * dx, y + away * dy, 1e9)
        if dark < 0.0:
            if dark < -1e6:
                break
            return away - STEP_PX * (1.0 - before / (before - dark)), (before - dark) / STEP_PX
        before = dark
    return distance, fall


@njit(cache=True, nogil=True)
def light_gain(source, points, normals, count, away, levels):  # type: ignore[no-untyped-def]
    """Return the median of picture / back-light beside a line: at `count` points (N, 2) plus and minus `away` px.

    The source's own gain counts as 1; 0 where nothing is seen. levels (2 N,): room for what is seen.
    """
    seen = 0
    for i in range(count):
        for side in (-1.0, 1.0):
            x, y = points[i, 0] + side * away * normals[i, 0], points[i, 1] + side * away * normals[i, 1]
            value = grey_at(source[0], x, y, -1.0)
            if value >= 0.0:
                levels[seen] = value / light_at(source, x, y)
                seen += 1
    return median_of(levels, seen)


@njit(cache=True, nogil=True)
def apart(ax, ay, bx, by):  # type: ignore[no-untyped-def]
    """Return the distance of two points; `math.hypot` guards against sizes that no picture has."""
    return math.sqrt((ax - bx) * (ax - bx) + (ay - by) * (ay - by))
