"""Roll for people at the handle: where its mark points, and numbers of things."""

import math

import numpy as np

from cathxr.core import FloatArray

_SIDES = (
    ((0.0, -1.0, 0.0), "to the right side"),
    ((0.0, 1.0, 0.0), "to the left side"),
    ((0.0, 0.0, 1.0), "straight up"),
    ((0.0, 0.0, -1.0), "straight down"),
)
_CLOSE = 0.99


def side_of(zero_direction: FloatArray) -> str:
    """Return where mark T points at roll zero, seen from the handle towards the box. zero_direction (3,), in `box`.

    Along the insertion (+x) with +z up, +y is on the left.
    """
    for axis, words in _SIDES:
        if float(np.dot(axis, zero_direction)) > _CLOSE:
            return words
    return "to the side that the rig's zero_direction names"


def clock_angle_rad(zero_direction: FloatArray) -> float:
    """Return where mark T points at roll zero, seen from the handle: clockwise from the right side, rad."""
    _, y, z = zero_direction.tolist()
    return math.atan2(-z, -y) + 0.0


def counted(number: int, noun: str) -> str:
    """Return "no stops", "1 stop", "2 stops"."""
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"


def number(value: float) -> str:
    """Return a value as people write it in rig.toml: 2.0, 1.5, 2400, 1.3333."""
    if value == int(value):
        return f"{value:.1f}" if abs(value) < 100 else f"{value:.0f}"
    return f"{value:.4g}"
