"""The inlet's holder, its inserts from 6F to 14F, and the jig at the far end. Origin and axes are those of `box`."""

from collections.abc import Iterable, Iterator

import build123d as b
import numpy as np

from cathxr.hardware.cad.frame import BLACK, GREY, WHITE
from cathxr.hardware.cad.part import ALWAYS, JIG, PRINTED, Part, Place
from cathxr.hardware.cad.screws import screw_places
from cathxr.hardware.cad.shapes import Solid, block, cone, cut, joined, mark, rod
from cathxr.hardware.layout import (
    HOLDER_FLANGE_MM,
    HOLDER_PLATE_MM,
    HOLDER_SCREW_MM,
    INLET_SIDE_MM,
    INSERT_FLANGE_MM,
    INSERT_MM,
    JIG_MAGNET_MM,
    JIG_SIDE_MM,
    Layout,
    bore_mm,
)
from cathxr.hardware.parameters import INLET_SIZES_FR
from cathxr.hardware.screws import joints

_LEAD_MM = 6.0


def inlet_places(layout: Layout, parts: Iterable[Part]) -> Iterator[Place]:
    """Yield the holder, the insert of the chosen catheter, and the jig. parts: `inlet_parts`."""
    for part in parts:
        if part.key in ("inlet_holder", f"inlet_{layout.parameters.catheter.french}F"):
            yield Place(part, setup=ALWAYS, group="inlet")
    flange = _outside(layout) - HOLDER_PLATE_MM
    heads = [(flange, y, z) for y in (-HOLDER_SCREW_MM, HOLDER_SCREW_MM) for z in (-HOLDER_SCREW_MM, HOLDER_SCREW_MM)]
    yield from screw_places(joints(layout)["holder"], heads, (1.0, 0.0, 0.0), group="inlet")
    yield Place(Part("jig", "Transducer jig", PRINTED, _jig(layout), GREY, (-1.0, 0.0, 0.0)), setup=JIG, group="jig")


def inlet_parts(layout: Layout) -> Iterator[Part]:
    """Yield the holder and every insert, as they stand in the box."""
    yield Part("inlet_holder", "Inlet holder", PRINTED, _holder(layout), BLACK, (1.0, 0.0, 0.0))
    for french in INLET_SIZES_FR:
        solid = _insert(layout, french)
        yield Part(f"inlet_{french}F", f"Inlet {french}F", PRINTED, solid, WHITE, (1.0, 0.0, 0.0),
                   "0.1 mm layers; run a drill of the bore's size through by hand.")  # fmt: skip


def _outside(layout: Layout) -> float:
    """Return x of the inlet panel's outer face."""
    return float(layout.centre[0]) - layout.ledge_mm - layout.parameters.panel.thickness_mm


def _magnet_radius(layout: Layout) -> float:
    """Return the radius of the circle on which the insert's three magnets lie."""
    parameters = layout.parameters
    return 0.5 * (INSERT_MM + 0.3 + parameters.magnet.diameter_mm + 0.2) + parameters.printer.least_wall_mm


def _magnets(layout: Layout, x: float, depth: float) -> list[Solid]:
    """Return three pockets from x on, along x."""
    radius, size = _magnet_radius(layout), layout.parameters.magnet.diameter_mm + 0.2
    angles = np.deg2rad([0.0, 120.0, 240.0])
    return [rod((x, radius * np.cos(each), radius * np.sin(each)), "x", depth, size) for each in angles]


def _holder(layout: Layout) -> Solid:
    back = _outside(layout)
    half, flange = 0.5 * INLET_SIDE_MM, 0.5 * HOLDER_FLANGE_MM
    body = joined(
        block((back, -half, -half), (0.0, half, half)),
        block((back - HOLDER_PLATE_MM, -flange, -flange), (back, flange, flange)),
    )
    depth = layout.parameters.magnet.height_mm + 0.1
    tools = [rod((back - HOLDER_PLATE_MM - 1.0, 0.0, 0.0), "x", -back + HOLDER_PLATE_MM + 2.0, INSERT_MM + 0.3)]
    tools += _magnets(layout, back - HOLDER_PLATE_MM - 1.0, depth + 1.0)
    for y in (-HOLDER_SCREW_MM, HOLDER_SCREW_MM):
        tools += [
            rod((back - HOLDER_PLATE_MM - 1.0, y, z), "x", HOLDER_PLATE_MM + 2.0, 3.4)
            for z in (-HOLDER_SCREW_MM, HOLDER_SCREW_MM)
        ]
    return cut(body, tools)


def _insert(layout: Layout, french: int) -> Solid:
    back = _outside(layout) - HOLDER_PLATE_MM
    bore = bore_mm(french)
    reach = _magnet_radius(layout) + 0.5 * layout.parameters.magnet.diameter_mm + 1.5
    body = joined(
        rod((back, 0.0, 0.0), "x", -back, INSERT_MM),
        rod((back - INSERT_FLANGE_MM, 0.0, 0.0), "x", INSERT_FLANGE_MM, 2.0 * reach),
    )
    outer = back - INSERT_FLANGE_MM
    depth = layout.parameters.magnet.height_mm + 0.1
    text = b.Pos(outer, 0.0, 0.0) * b.Rot(0.0, -90.0, 0.0) * b.Rot(0.0, 0.0, -90.0)
    engraved = text * (b.Pos(0.0, 0.5 * bore + 6.0, 0.0) * mark(f"{french}F", 4.0, 0.6, width=0.8))
    tools = [
        rod((outer - 1.0, 0.0, 0.0), "x", -outer + 2.0, bore),
        cone((outer, 0.0, 0.0), "x", _LEAD_MM, bore + 4.0, bore),
        *_magnets(layout, back - depth, depth + 1.0),
        engraved,
    ]
    return cut(body, tools)


def _jig(layout: Layout) -> Solid:
    """Return the jig: a square tube from the end panel into the ROI, a bore, a slot where the transducer looks."""
    parameters = layout.parameters
    side, panel = 0.5 * JIG_SIDE_MM, float(layout.centre[0]) + layout.ledge_mm + parameters.panel.thickness_mm
    end = parameters.roi.side_mm
    body = joined(
        block((end - 24.0, -side, -side), (panel, side, side)), block((panel, -22.0, -22.0), (panel + 5.0, 22.0, 22.0))
    )
    bore, diameter = layout.bore_mm, parameters.catheter.diameter_mm
    depth = parameters.magnet.height_mm + 0.1
    tools = [
        rod((end - 25.0, 0.0, 0.0), "x", 21.0, bore),
        cone((end - 24.0, 0.0, 0.0), "x", 4.0, bore + 4.0, bore),
        block((end - 25.0, -side - 1.0, -0.5 * diameter), (end - 4.0, 0.0, 0.5 * diameter)),
        block((end + 10.0, -side + 3.0, -side + 3.0), (panel + 6.0, side - 3.0, side - 3.0)),
    ]
    for y in (-JIG_MAGNET_MM, JIG_MAGNET_MM):
        tools += [
            rod((panel - 1.0, y, z), "x", depth + 1.0, parameters.magnet.diameter_mm + 0.2)
            for z in (-JIG_MAGNET_MM, JIG_MAGNET_MM)
        ]
    letter = b.Pos(end - 12.0, 0.0, side) * b.Rot(0.0, 0.0, -90.0) * mark("T", 10.0, 0.8, width=1.6)
    return cut(body, [*tools, letter])
