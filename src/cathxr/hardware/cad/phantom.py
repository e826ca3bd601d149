"""The accuracy phantom: a sleeve on the inlet block, two struts, a plate, and a staircase with open holes."""

from cathxr.hardware.cad.frame import WHITE
from cathxr.hardware.cad.part import PHANTOM, PRINTED, Part, Place
from cathxr.hardware.cad.shapes import Solid, block, cut, joined
from cathxr.hardware.holes import DEPTH_MM, Step, plate_x_mm, steps
from cathxr.hardware.layout import INLET_SIDE_MM, Layout

_PLATE_MM, _SLEEVE_WALL_MM = 6.0, 5.0
_SLEEVE_PLAY_MM = 0.15
_REACH_MM, _STRUT_MM = 42.0, 10.0


def phantom_place(layout: Layout) -> Place:
    """Return the phantom in its place on the inlet."""
    part = Part(
        "phantom", "Accuracy phantom", PRINTED, _phantom(layout), WHITE, (-1.0, 0.0, 0.0),
        "White; 0.15 mm layers, supports under the sleeve. It is pushed over the inlet block, flush with it.",
    )  # fmt: skip
    return Place(part, setup=PHANTOM, group="phantom")


def _phantom(layout: Layout) -> Solid:
    plate, holes = plate_x_mm(layout), steps(layout)
    back = plate + _PLATE_MM
    inside = 0.5 * INLET_SIDE_MM + _SLEEVE_PLAY_MM
    outside, far = inside + _SLEEVE_WALL_MM, _REACH_MM + _STRUT_MM
    half = 0.5 * _STRUT_MM
    # From both cameras' sight everything but the steps is behind or below: +y and -z.
    body = joined(
        block((plate, -_REACH_MM, -far), (back, far, _REACH_MM)),
        block((-26.0, -outside, -outside), (0.0, outside, outside)),
        block((-26.0, inside, -half), (-12.0, far, half)),
        block((-26.0, _REACH_MM, -half), (back, far, half)),
        block((-26.0, -half, -far), (-12.0, half, -inside)),
        block((-26.0, -half, -far), (back, half, -_REACH_MM)),
        *(_column(each, back) for each in holes),
    )
    tools = [block((-27.0, -inside, -inside), (1.0, inside, inside))]
    tools += [_opening(each, layout.parameters.catheter.diameter_mm) for each in holes]
    return cut(body, tools)


def _column(step: Step, back: float) -> Solid:
    half = 0.5 * step.side_mm
    return block((step.x_mm - DEPTH_MM, step.y_mm - half, step.z_mm - half), (back, step.y_mm + half, step.z_mm + half))


def _opening(step: Step, diameter_mm: float) -> Solid:
    """Return what is taken out for a seat: the tip touches the bottom, the wall at +y and the wall at -z."""
    radius, reach = 0.5 * diameter_mm, 0.5 * step.side_mm + 0.01
    return block(
        (step.x_mm - DEPTH_MM - 1.0, step.y_mm - reach, step.z_mm - radius),
        (step.x_mm, step.y_mm + radius, step.z_mm + reach),
    )
