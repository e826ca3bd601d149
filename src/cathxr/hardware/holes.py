"""The accuracy phantom: where its holes are, and why there. A staircase on a plate, open towards both cameras.

A tip in a hole must be seen from above and from the front, or a tracker cannot see what is measured. So each hole is
open on the sides of both cameras: what stays is its bottom and the walls at +y and -z, and the tip is pushed into that
corner. Every step towards a camera lies farther in (x grows with z - y), and what carries the steps is behind them.
"""

from dataclasses import dataclass

import numpy as np

from cathxr.core.phantom import Hole, Phantom
from cathxr.hardware.layout import Layout

STEP_MM = 20.0
"""Side of a step, and the distance of neighbouring holes in y and z."""
DEPTH_MM = 4.0
"""How far the tip goes into a hole."""
_NEAR_MM = 48.0
_PLATE = ((-34.0, 0.0), (0.0, 34.0), (-24.0, 24.0))
_STD_MM = 0.1
"""What a well-printed part may be off, along each axis: measure yours and correct phantom.toml."""


@dataclass(frozen=True)
class Step:
    """One hole with what carries it. x_mm, y_mm, z_mm: the seated tip's most distal point; side_mm: of its square."""

    name: str
    x_mm: float
    y_mm: float
    z_mm: float
    side_mm: float
    region: str


def plate_x_mm(layout: Layout) -> float:
    """Return where the plate's face is."""
    return min(108.0, layout.parameters.roi.side_mm - 10.0)


def steps(layout: Layout) -> tuple[Step, ...]:
    """Return the holes in the order in which they are visited: the stairs' from the inlet on, then the plate's."""
    plate = plate_x_mm(layout)
    far = plate - 8.0
    slope = (far - _NEAR_MM) / (4.0 * STEP_MM)
    places = [(y, z) for y in (STEP_MM, 0.0, -STEP_MM) for z in (-STEP_MM, 0.0, STEP_MM)]
    found = [(_NEAR_MM + slope * (z - y + 2.0 * STEP_MM), y, z, STEP_MM, "stairs") for y, z in places]
    found.sort(key=lambda each: each[0])
    found += [(plate, y, z, 12.0, "plate") for y, z in _PLATE]
    return tuple(Step(str(index + 1), *each) for index, each in enumerate(found))


def nominal_phantom(layout: Layout) -> Phantom:
    """Return the phantom as drawn, for phantom.toml."""
    holes = tuple(
        Hole(each.name, np.array([round(each.x_mm, 3), each.y_mm, each.z_mm]), each.region) for each in steps(layout)
    )
    name = f"{layout.parameters.name}: plate and stairs"
    return Phantom(name, holes, _STD_MM, layout.parameters.catheter.diameter_mm)
