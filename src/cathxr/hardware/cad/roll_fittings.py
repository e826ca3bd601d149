"""What is bought for the roll unit and small: its screws and nuts, the spring against play, the Nano."""

from collections.abc import Iterator

import numpy as np

from cathxr.hardware.cad.part import BOUGHT, Part, Place
from cathxr.hardware.cad.roll_unit import (
    BRACKET_SCREWS_MM,
    CAP_HIGH_MM,
    CAP_SCREW_MM,
    HORN_Y_MM,
    PLATE_AT_MM,
    TRAY_SCREW_X_MM,
    TRAY_SCREWS_Y_MM,
    encoder_bolts,
    roll_at,
    spring_hole,
)
from cathxr.hardware.cad.screws import pulled_spring, screw_places
from cathxr.hardware.cad.shapes import Solid, block, joined
from cathxr.hardware.gears import centre_mm
from cathxr.hardware.layout import Layout
from cathxr.hardware.panels import rail_screws
from cathxr.hardware.screws import (
    BRACKET_MM,
    CAP_EAR_MM,
    CARRIAGE_SUNK_MM,
    ENCODER_PLATE_MM,
    RAIL_UNDER_HEAD_MM,
    TRAY_TAB_MM,
    joints,
)

GROUP, SPRING = "roll_screws", "roll_spring"
_SPRING_X_MM = -18.0
"""The spring lies between the encoder plate's face and the cap's."""
_SPRING_MM, _SPRING_WIRE_MM, _HOOK_MM = 5.0, 0.6, 3.0


def roll_fittings(layout: Layout) -> Iterator[Place]:
    """Yield spring, Nano, screws and nuts of the roll unit, where `roll_places` puts it."""
    at = roll_at(layout)
    yield _spring(layout)
    yield Place(Part("nano", "Arduino Nano", BOUGHT, _nano(layout), (0.05, 0.4, 0.5)), at, group="roll")
    yield from _on_the_base(layout)
    yield from _on_the_rail(layout)


def _spring(layout: Layout) -> Place:
    """Return the tension spring from the cap's horn to the encoder plate's ear."""
    first = np.array([_SPRING_X_MM, HORN_Y_MM, CAP_HIGH_MM + 6.0])
    last = np.array([_SPRING_X_MM, *spring_hole(layout)])
    length = float(np.linalg.norm(last - first))
    along, across = (last - first) / length, np.array([1.0, 0.0, 0.0])
    part = pulled_spring(
        "tension_spring", "Tension spring", length, _SPRING_MM, _SPRING_WIRE_MM, hook_mm=_HOOK_MM
    )  # fmt: skip
    return Place(part, roll_at(layout) + first, np.column_stack([across, np.cross(along, across), along]), group=SPRING)


def _nano(layout: Layout) -> Solid:
    """Return the board with its USB socket and processor, as it lies in its tray."""
    low = layout.roll_deck_mm + 4.0
    return joined(
        block((-22.5, -54.0, low), (22.5, -36.0, low + 1.6)),
        block((-24.0, -48.8, low + 1.6), (-15.0, -41.2, low + 5.5)),
        block((-4.0, -48.5, low + 1.6), (3.0, -41.5, low + 2.6)),
    )


def _on_the_base(layout: Layout) -> Iterator[Place]:
    found, at, deck = joints(layout), roll_at(layout), layout.roll_deck_mm
    apart = centre_mm(layout.parameters.gear)
    caps = [(x, y, CAP_EAR_MM) for x in (-14.0, 14.0) for y in (-CAP_SCREW_MM, CAP_SCREW_MM)]
    yield from screw_places(found["cap"], at + np.array(caps), (0.0, 0.0, -1.0), group=GROUP)
    sunk = [(x, y, deck - CARRIAGE_SUNK_MM) for x in (-10.0, 10.0) for y in (-10.0, 10.0)]
    yield from screw_places(found["carriage"], at + np.array(sunk), (0.0, 0.0, -1.0), group=GROUP)
    tray = [(TRAY_SCREW_X_MM, y, deck + TRAY_TAB_MM) for y in TRAY_SCREWS_Y_MM]
    yield from screw_places(found["tray"], at + np.array(tray), (0.0, 0.0, -1.0), group=GROUP)
    bolts = [(-PLATE_AT_MM, y, z) for y, z in encoder_bolts(layout)]
    yield from screw_places(found["encoder"], at + np.array(bolts), (-1.0, 0.0, 0.0), group=GROUP)
    pivot = np.array([[-PLATE_AT_MM - ENCODER_PLATE_MM, apart, deck + 5.0]])
    yield from screw_places(found["pivot"], at + pivot, (1.0, 0.0, 0.0), group=GROUP)


def _on_the_rail(layout: Layout) -> Iterator[Place]:
    found, front = joints(layout), float(layout.centre[0]) - layout.outer_mm
    high = layout.rail_plate_mm + layout.parameters.panel.plate_mm
    up = np.array([0.0, 0.0, 1.0])
    places = rail_screws() * np.array([-1.0, 1.0, 0.0]) + np.array([front, 0.0, 0.0]) + high * up
    yield from screw_places(found["rail"], places[:-4] + RAIL_UNDER_HEAD_MM * up, -up, group=GROUP)
    yield from screw_places(found["rail_end"], places[-4:], -up, group=GROUP)
    beam = [(front - BRACKET_MM, y, layout.bracket_screw_mm) for y in BRACKET_SCREWS_MM]
    yield from screw_places(found["beam"], beam, (1.0, 0.0, 0.0), group=GROUP)
