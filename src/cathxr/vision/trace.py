"""Follows a tube through a matte from where it enters, section by section. Compiled hot loop."""

import math

import numpy as np
from numba import njit

from cathxr.core import FloatArray
from cathxr.vision.profiles import cross
from cathxr.vision.segmentation import MatteArray

STEP_OF_WIDTH = 0.35
"""Distance from section to section, in tube widths: short enough for a bend of one and a half widths."""
GAP_WIDTHS = 2.5
"""How far a trace goes on straight where the tube cannot be seen (glare, a bubble)."""
WIDE_WIDTHS = 6.0
"""How far a trace goes on where the section is too wide to measure (the tube crosses itself or something dark)."""
_TOO_WIDE = 1.45
_RISE = 0.08


@njit(cache=True, nogil=True)
def trace(
    matte: MatteArray, start: FloatArray, direction: FloatArray, width: float, plateau: float, limit_px: float
) -> tuple[FloatArray, float, float]:
    """Return (sections, width, plateau): points (N, 2) px along the tube from `start`, its typical width and plateau.

    start (2,) px on the tube, direction (2,) unit along it, width px and plateau as expected, limit_px: longest way.
    The sections end with the last one seen.
    """
    step = max(1.0, STEP_OF_WIDTH * width)
    capacity = int(limit_px / step) + 2
    sections = np.empty((capacity, 2))
    count = 0
    last_good = 0
    x, y = start[0], start[1]
    dx, dy = direction[0], direction[1]
    expected = width
    unseen = 0.0
    wide = 0.0
    while count < capacity:
        offset, found_width, found_plateau, _ = cross(matte, x, y, -dy, dx, width, plateau)
        if found_width < 0.0:
            unseen += step
            if unseen > GAP_WIDTHS * width:
                break
        elif found_width == 0.0 or found_width > _TOO_WIDE * width:
            wide += step
            if wide > WIDE_WIDTHS * width:
                break
        else:
            unseen = 0.0
            wide = 0.0
            offset = min(max(offset, -0.6 * width), 0.6 * width)
            x -= offset * dy
            y += offset * dx
            if found_width > 0.8 * width:
                width += _RISE * (found_width - width)
                width = min(max(width, 0.55 * expected), 1.6 * expected)
                plateau += _RISE * (found_plateau - plateau)
            last_good = count + 1
        sections[count, 0] = x
        sections[count, 1] = y
        count += 1
        if last_good == count and count >= 2:
            dx, dy = _heading(sections, count, dx, dy)
        x += step * dx
        y += step * dy
    return sections[:last_good].copy(), width, plateau


@njit(cache=True, nogil=True)
def _heading(sections: FloatArray, count: int, dx: float, dy: float) -> tuple[float, float]:
    """Return the unit direction to the next section: the last chord, turned on by half of its last turn."""
    cx = sections[count - 1, 0] - sections[count - 2, 0]
    cy = sections[count - 1, 1] - sections[count - 2, 1]
    length = math.hypot(cx, cy)
    if length < 1e-6:
        return dx, dy
    cx /= length
    cy /= length
    if cx * dx + cy * dy < 0.3:  # a section that jumps by more than 70 degrees is not the tube going on
        return dx, dy
    if count >= 3:
        bx = sections[count - 2, 0] - sections[count - 3, 0]
        by = sections[count - 2, 1] - sections[count - 3, 1]
        before = math.hypot(bx, by)
        if before > 1e-6:
            turn = math.atan2(bx * cy - by * cx, bx * cx + by * cy)
            turn = min(max(turn, -0.35), 0.35) * 0.5
            c, s = math.cos(turn), math.sin(turn)
            cx, cy = c * cx - s * cy, s * cx + c * cy
    # a part of the old heading damps the noise of single sections
    mx, my = 0.8 * cx + 0.2 * dx, 0.8 * cy + 0.2 * dy
    norm = math.hypot(mx, my)
    return mx / norm, my / norm
