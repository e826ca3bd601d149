"""The roll unit: a base that slides on a rail before the inlet, bearings, the sprung encoder plate, the Nano's tray."""

from collections.abc import Iterator

import build123d as b
import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.frame import BLACK, GREY, STEEL
from cathxr.hardware.cad.gear import HUB_HALF_MM, gear_parts
from cathxr.hardware.cad.part import BOUGHT, PRINTED, Part, Place
from cathxr.hardware.cad.shapes import Solid, block, cut, joined, rod
from cathxr.hardware.gears import centre_mm
from cathxr.hardware.layout import (
    BEARING_HALF_MM,
    BRACKET_GUSSET_MM,
    HUB_MM,
    RAIL_LENGTH_MM,
    RAIL_STACK_MM,
    ROLL_BASE_MM,
    Layout,
)
from cathxr.hardware.panels import rail_screws
from cathxr.hardware.screws import BRACKET_MM, CAP_EAR_MM, CARRIAGE_SUNK_MM, ENCODER_PLATE_MM, LUG_MM, TRAY_TAB_MM

_BEFORE_MM = 105.0
"""From the inlet panel's side of the frame to where the unit is drawn: in the middle of its way."""
_CARRIAGE_MM, _RAIL_HIGH_MM = 5.0, 8.0
_WALL_MM, _WALL_AT_MM = 6.0, 11.0
PLATE_AT_MM = 19.0
_PIVOT_MM = 4.0
_PILOT_MM = 2.6
CAP_HIGH_MM, CAP_WALL_MM, CAP_SCREW_MM, HORN_Y_MM = 0.5 * HUB_MM + 5.0, 3.0, BEARING_HALF_MM - 4.0, -10.0
TRAY_SCREW_X_MM, TRAY_SCREWS_Y_MM = -20.0, (-59.0, -31.0)
BRACKET_SCREWS_MM = (-30.0, 30.0)
BRACKET_DEEP_MM, LEG_HALF_MM = 18.0, 6.0
"""How far bracket and leg reach under the rail's plate: the rail's first and last nuts lie beside them."""


def roll_at(layout: Layout) -> FloatArray:
    """Return where the roll unit is drawn (3,): its own origin is the middle of the catheter gear."""
    return np.array([float(layout.centre[0]) - layout.outer_mm - _BEFORE_MM, 0.0, 0.0])


def roll_places(layout: Layout, rail_plate: Part) -> Iterator[Place]:
    """Yield the roll unit in the middle of its rail, and the rail on the frame. rail_plate: of `sheet_parts`."""
    at = roll_at(layout)
    gears, apart = gear_parts(layout), centre_mm(layout.parameters.gear)
    aside = at + np.array([0.0, apart, 0.0])
    hub, wall = np.array([[HUB_HALF_MM, 0.0, 0.0], [_WALL_AT_MM + 0.5 * _WALL_MM, 0.0, 0.0]])
    yield Place(gears["catheter_gear"], at, group="roll")
    yield Place(gears["encoder_gear"], aside, group="roll")
    yield Place(gears["catheter_lock"], at - hub, group="roll")
    yield Place(gears["catheter_lock"], at + hub, np.diag([-1.0, -1.0, 1.0]), group="roll")
    for part in (
        Part("roll_base", "Base of the roll unit", PRINTED, _base(layout), BLACK),
        Part("encoder_plate", "Encoder plate", PRINTED, _encoder_plate(layout), GREY, (1.0, 0.0, 0.0)),
        Part("encoder", "Rotary encoder", BOUGHT, _encoder(layout), STEEL),
        Part("nano_holder", "Nano holder", PRINTED, _nano_holder(layout), GREY),
    ):
        yield Place(part, at, group="roll")
    cap = Part("bearing_cap", "Bearing cap", PRINTED, _cap(), GREY, (1.0, 0.0, 0.0))
    yield Place(cap, at - wall, group="roll")
    yield Place(cap, at + wall, group="roll")
    yield from _rail(layout, at, rail_plate)


def _base(layout: Layout) -> Solid:
    """Return plate, two bearing walls and the pivot's lug."""
    deck, apart = layout.roll_deck_mm, centre_mm(layout.parameters.gear)
    half, wide = BEARING_HALF_MM, apart + 18.0
    walls = [
        block((sign * _WALL_AT_MM, -half, deck), (sign * (_WALL_AT_MM + _WALL_MM), half, 0.0)) for sign in (-1.0, 1.0)
    ]
    pivot = deck + 5.0
    body = joined(
        block((-32.0, -64.0, deck - ROLL_BASE_MM), (24.0, wide, deck)),
        *walls,
        block((-18.5, apart - 6.0, deck), (-18.5 + LUG_MM, apart + 6.0, pivot + 5.0)),
    )
    tools = [rod((-30.0, 0.0, 0.0), "x", 60.0, HUB_MM + 0.3)]
    for x in (-14.0, 14.0):
        tools += [rod((x, y, -14.0), "z", 15.0, _PILOT_MM) for y in (-CAP_SCREW_MM, CAP_SCREW_MM)]
    tools.append(rod((-19.0, apart, pivot), "x", 8.0, _PIVOT_MM + 0.2))
    # The carriage's four screws are sunk, under the gear; they come in from above, along the walls.
    for x in (-10.0, 10.0):
        for y in (-10.0, 10.0):
            tools += [
                rod((x, y, deck - 10.0), "z", 12.0, 3.4),
                rod((x, y, deck - CARRIAGE_SUNK_MM), "z", CARRIAGE_SUNK_MM - deck, 6.4),
            ]
    tools += [rod((TRAY_SCREW_X_MM, y, deck - 7.0), "z", 8.0, _PILOT_MM) for y in TRAY_SCREWS_Y_MM]
    return cut(body, tools)


def _cap() -> Solid:
    """Return half a bearing, closed above, with a horn for the spring."""
    half, top = BEARING_HALF_MM, CAP_HIGH_MM
    x = 0.5 * _WALL_MM
    body = joined(
        block((-x, -half, 0.0), (x, half, CAP_EAR_MM)),
        block((-x, -0.5 * HUB_MM - CAP_WALL_MM, 0.0), (x, 0.5 * HUB_MM + CAP_WALL_MM, top)),
        block((-x, HORN_Y_MM - 4.0, top - 2.0), (x, HORN_Y_MM + 4.0, top + 10.0)),
    )
    tools = [
        rod((-10.0, 0.0, 0.0), "x", 20.0, HUB_MM + 0.3),
        rod((-10.0, HORN_Y_MM, CAP_HIGH_MM + 6.0), "x", 20.0, 2.4),
    ]
    tools += [rod((0.0, y, -1.0), "z", 12.0, 3.4) for y in (-CAP_SCREW_MM, CAP_SCREW_MM)]
    return cut(body, tools)


def _encoder_plate(layout: Layout) -> Solid:
    """Return the plate that carries the encoder; it swings on the pivot below and a spring pulls its top inwards."""
    encoder, deck = layout.parameters.encoder, layout.roll_deck_mm
    apart, pivot = centre_mm(layout.parameters.gear), layout.roll_deck_mm + 5.0
    half, low, high = 0.5 * encoder.body_mm + 2.0, -PLATE_AT_MM - ENCODER_PLATE_MM, -PLATE_AT_MM
    edge = max(apart - half, 0.5 * HUB_MM + 1.5)
    top = 0.5 * encoder.body_mm + 8.0
    body = joined(
        block((low, edge, -0.5 * encoder.body_mm + 2.0), (high, apart + half, 0.5 * encoder.body_mm + 2.0)),
        block((low, apart - 7.0, deck + 0.6), (high, apart + 7.0, 0.0)),
        block((low, edge, 0.0), (high, edge + 10.0, top)),
    )
    tools = [
        rod((low - 1.0, apart, 0.0), "x", ENCODER_PLATE_MM + 2.0, encoder.boss_mm + 0.4),
        rod((low - 1.0, apart, pivot), "x", ENCODER_PLATE_MM + 2.0, _PIVOT_MM + 0.2),
        rod((low - 1.0, *spring_hole(layout)), "x", ENCODER_PLATE_MM + 2.0, 2.4),
    ]
    tools += [rod((low - 1.0, y, z), "x", ENCODER_PLATE_MM + 2.0, 3.4) for y, z in encoder_bolts(layout)]
    return cut(body, tools)


def encoder_bolts(layout: Layout) -> list[tuple[float, float]]:
    """Return y and z of the encoder's three screws: turned so that their heads pass the bearing's wall."""
    angles, half = np.deg2rad([0.0, 120.0, 240.0]), 0.5 * layout.parameters.encoder.bolt_circle_mm
    apart = centre_mm(layout.parameters.gear)
    return [(apart + half * float(np.cos(each)), half * float(np.sin(each))) for each in angles]


def spring_hole(layout: Layout) -> tuple[float, float]:
    """Return y and z of the hole for the spring in the encoder plate's ear."""
    apart, half = centre_mm(layout.parameters.gear), 0.5 * layout.parameters.encoder.body_mm + 2.0
    return max(apart - half, 0.5 * HUB_MM + 1.5) + 5.0, half + 2.0


def _encoder(layout: Layout) -> Solid:
    encoder, apart = layout.parameters.encoder, centre_mm(layout.parameters.gear)
    face = -PLATE_AT_MM - ENCODER_PLATE_MM
    body = rod((face, apart, 0.0), "x", -encoder.body_length_mm, encoder.body_mm)
    boss = rod((face, apart, 0.0), "x", ENCODER_PLATE_MM, encoder.boss_mm)
    shaft = cut(
        rod((face, apart, 0.0), "x", ENCODER_PLATE_MM + 13.0, encoder.shaft_mm),
        [
            block(
                (face + ENCODER_PLATE_MM, apart - 5.0, 0.5 * encoder.shaft_mm - 0.5),
                (0.0, apart + 5.0, encoder.shaft_mm),
            )
        ],
    )
    return joined(body, boss, shaft)


def _nano_holder(layout: Layout) -> Solid:
    """Return a tray for an Arduino Nano (45 x 18 mm) with posts for a cable tie, on the base's other side."""
    deck = layout.roll_deck_mm
    body = joined(
        block((-26.0, -64.0, deck), (-14.0, -26.0, deck + TRAY_TAB_MM)),
        block((-26.0, -56.0, deck), (24.0, -34.0, deck + 10.0)),
    )
    tools = [
        block((-22.6, -54.2, deck + 4.0), (22.6, -35.8, deck + 11.0)),
        block((-27.0, -51.0, deck + 4.0), (-20.0, -39.0, deck + 11.0)),
        block((-20.0, -51.0, deck + 2.0), (20.0, -39.0, deck + 11.0)),
        block((15.0, -57.0, deck + 3.0), (19.0, -33.0, deck + 6.0)),
    ]
    tools += [rod((TRAY_SCREW_X_MM, y, deck - 1.0), "z", 12.0, 3.4) for y in TRAY_SCREWS_Y_MM]
    return cut(body, tools)


def _rail(layout: Layout, at: FloatArray, rail_plate: Part) -> Iterator[Place]:
    """Yield rail, carriage, the plate under them, its bracket on the frame, and the leg at the far end."""
    front = float(layout.centre[0]) - layout.outer_mm
    plate = layout.parameters.panel.plate_mm
    start, top = front - 10.0, layout.rail_plate_mm + plate
    rail = block((start - RAIL_LENGTH_MM, -6.0, top), (start, 6.0, top + _RAIL_HIGH_MM))
    yield Place(Part("rail", f"Linear rail MGN12, {RAIL_LENGTH_MM:.0f} mm", BOUGHT, rail, STEEL), group="roll")
    high = top + RAIL_STACK_MM
    carriage = block((at[0] - 22.7, -13.5, high - _CARRIAGE_MM), (at[0] + 22.7, 13.5, high))
    yield Place(Part("carriage", "Carriage MGN12H", BOUGHT, carriage, STEEL), group="roll")
    middle = np.array([front - 0.5 * RAIL_LENGTH_MM - 10.0, 0.0, layout.rail_plate_mm])
    yield Place(rail_plate, middle, group="roll")
    bracket = Part("rail_bracket", "Bracket of the rail", PRINTED, _bracket(layout), BLACK, (0.0, 0.0, -1.0))
    yield Place(bracket, np.array([front, 0.0, 0.0]), group="roll")
    floor = -(layout.led_mm + plate + 16.0)
    leg = Part("rail_leg", "Leg of the rail", PRINTED, _leg(layout.rail_plate_mm, floor), BLACK, (0.0, 1.0, 0.0))
    yield Place(leg, np.array([front - RAIL_LENGTH_MM - 8.0, 0.0, 0.0]), group="roll")


def _bracket(layout: Layout) -> Solid:
    """Return the bracket: x = 0 is the frame's outer face; two screws go into the lower beam."""
    plate, beam = layout.rail_plate_mm, layout.bracket_screw_mm
    low = beam - 7.0
    gusset = b.Rot(90.0, 0.0, 0.0) * b.extrude(
        b.make_face(
            b.Polyline(
                (-5.0, plate - 4.0), (4.0 - BRACKET_DEEP_MM, plate - 4.0), (-5.0, plate - BRACKET_GUSSET_MM), close=True
            )
        ),
        amount=6.0,
    )
    body = joined(
        block((-BRACKET_MM, -40.0, low), (0.0, 40.0, plate)),
        block((-BRACKET_DEEP_MM, -40.0, plate - 6.0), (0.0, 40.0, plate)),
        b.Pos(0.0, 33.0, 0.0) * gusset,
        b.Pos(0.0, -27.0, 0.0) * gusset,
    )
    tools = [rod((-BRACKET_MM - 1.0, y, beam), "x", BRACKET_MM + 2.0, 4.4) for y in BRACKET_SCREWS_MM]
    first = rail_screws()[-4:-2]
    tools += [rod((-u, v, plate - 8.0), "z", 10.0, _PILOT_MM) for u, v, _ in first.tolist()]
    return cut(body, tools)


def _leg(top: float, floor: float) -> Solid:
    """Return the leg under the rail's far end: a foot, a web, and a head with two screws."""
    body = joined(
        block((-LEG_HALF_MM, -30.0, top - 6.0), (LEG_HALF_MM, 30.0, top)),
        block((-4.0, -30.0, floor), (4.0, 30.0, top - 5.0)),
        block((-20.0, -30.0, floor), (20.0, 30.0, floor + 5.0)),
    )
    return cut(body, [rod((0.0, v, top - 10.0), "z", 12.0, _PILOT_MM) for v in (-22.0, 22.0)])
