"""The roll unit's gears and the soft locks that hold the catheter. Own frames: the axis is x, teeth at 0."""

import build123d as b
import numpy as np

from cathxr.hardware.cad.frame import WHITE
from cathxr.hardware.cad.part import PRINTED, SOFT, Part
from cathxr.hardware.cad.shapes import Solid, block, cone, cut, joined, mark, prism, rod
from cathxr.hardware.gears import SpurGear, gear_pair
from cathxr.hardware.layout import HUB_MM, SMALL_HUB_MM, Layout

HUB_HALF_MM = 22.0
"""From the catheter gear's middle to its hub's ends."""
SOCKET_MM, SOCKET_OUT_MM, SOCKET_IN_MM = 14.0, 20.0, 15.0
SMALL_HUB_LONG_MM = 18.0
"""From the teeth's middle to the hub's end, short of the encoder's boss."""
_SHAFT_FLAT_MM = 0.5


def gear_parts(layout: Layout) -> dict[str, Part]:
    """Return catheter gear, lock and encoder gear by their keys."""
    first, second = gear_pair(layout.parameters.gear)
    return {
        "catheter_gear": Part(
            "catheter_gear", "Catheter gear", PRINTED, _catheter_gear(layout, first), WHITE, (1.0, 0.0, 0.0),
            "0.1 mm layers, four walls, slowly; supports under the teeth. The T is on the side of the hand.",
        ),
        "catheter_lock": Part(
            "catheter_lock", "Catheter lock", SOFT, _lock(layout), (0.2, 0.45, 0.75), (1.0, 0.0, 0.0),
            "TPU 85A to 95A, full.",
        ),
        "encoder_gear": Part(
            "encoder_gear", "Encoder gear", PRINTED, _encoder_gear(layout, second), WHITE, (-1.0, 0.0, 0.0),
            "0.1 mm layers, four walls, slowly.",
        ),
    }  # fmt: skip


def _toothed(gear: SpurGear, face: float) -> Solid:
    """Return a gear's body along x, its teeth's middle at x = 0, a tooth's middle on the z axis."""
    body = prism(gear.outline(7), face, base=-0.5 * face)
    return b.Rot(0.0, -90.0, 0.0) * body


def _catheter_gear(layout: Layout, gear: SpurGear) -> Solid:
    face = layout.parameters.gear.face_mm
    body = joined(_toothed(gear, face), rod((-HUB_HALF_MM, 0.0, 0.0), "x", 2.0 * HUB_HALF_MM, HUB_MM))
    bore = layout.parameters.catheter.diameter_mm + 1.0
    # The mark is read from the hand's side, at -x, with the T's top outwards at zero roll (-y).
    at = 0.5 * (0.5 * HUB_MM + gear.root_mm)
    letter = b.Pos(-0.5 * face, -at, 0.0) * b.Rot(0.0, -90.0, 180.0) * mark("T", min(7.0, gear.root_mm - 15.0), 0.8)
    tools = [
        rod((-HUB_HALF_MM - 1.0, 0.0, 0.0), "x", 2.0 * HUB_HALF_MM + 2.0, bore),
        cone((-HUB_HALF_MM, 0.0, 0.0), "x", SOCKET_MM, SOCKET_OUT_MM, SOCKET_IN_MM),
        cone((HUB_HALF_MM, 0.0, 0.0), "x", -SOCKET_MM, SOCKET_OUT_MM, SOCKET_IN_MM),
        letter,
    ]
    return cut(body, tools)


def _lock(layout: Layout) -> Solid:
    """Return a cone that is pressed into the hub (from x = 0 to positive x) and closes on the catheter; slit."""
    per_mm = (SOCKET_OUT_MM - SOCKET_IN_MM) / SOCKET_MM
    body = joined(
        cone((0.0, 0.0, 0.0), "x", SOCKET_MM - 1.5, SOCKET_OUT_MM, SOCKET_OUT_MM - per_mm * (SOCKET_MM - 1.5)),
        rod((0.0, 0.0, 0.0), "x", -2.5, HUB_MM - 1.0),
    )
    bore = layout.parameters.catheter.diameter_mm - 0.2
    tools = [
        rod((-3.5, 0.0, 0.0), "x", SOCKET_MM + 4.0, bore),
        block((-3.5, -0.5, 0.0), (SOCKET_MM + 1.0, 0.5, HUB_MM)),
    ]
    return cut(body, tools)


def _encoder_gear(layout: Layout, gear: SpurGear) -> Solid:
    face, shaft = layout.parameters.gear.face_mm, layout.parameters.encoder.shaft_mm
    turned = b.Rot(0.5 * float(np.rad2deg(gear.tooth_rad)), 0.0, 0.0) * _toothed(gear, face)
    long = SMALL_HUB_LONG_MM
    body = joined(turned, rod((-long, 0.0, 0.0), "x", long, SMALL_HUB_MM))
    hole = cut(
        rod((-long - 1.0, 0.0, 0.0), "x", long + face, shaft + 0.15),
        [block((-long - 2.0, -shaft, 0.5 * shaft - _SHAFT_FLAT_MM + 0.1), (face, shaft, shaft))],
    )
    return cut(body, [hole, rod((-long + 5.0, 0.0, 0.0), "z", SMALL_HUB_MM, 2.6)])
