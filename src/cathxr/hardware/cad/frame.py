"""The frame: twelve equal beams, eight corners of two hands, panels, rods, light boxes."""

from collections.abc import Iterator, Mapping

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.part import BOUGHT, CUT, PRINTED, Part, Place
from cathxr.hardware.cad.shapes import Solid, block, cut, mirrored_x, prism, rod
from cathxr.hardware.layout import ARM_GAP_MM, ARM_THICK_MM, NOTCH_MM, Layout
from cathxr.hardware.panels import Panel, panels

BLACK, WHITE, STEEL, GREY = (0.13, 0.13, 0.14), (0.93, 0.93, 0.92), (0.7, 0.71, 0.73), (0.35, 0.36, 0.38)
_PILOT_MM, _PILOT_APART_MM = 3.4, 30.0
_CYCLES = tuple(np.roll(np.eye(3), shift, axis=0) for shift in range(3))
"""Rows: t, v, w of beams along x, z, y, u, v, n of the faces z, y, x: (x, y, z), (z, x, y), (y, z, x)."""


def frame_places(layout: Layout, sheets: Mapping[str, Part]) -> Iterator[Place]:
    """Yield beams, corners, panels, rods and light boxes. sheets: `sheet_parts`."""
    yield from _beams(layout)
    yield from _corners(layout)
    yield from _panels(layout, sheets)
    yield from _rods(layout)
    yield from _light_boxes(layout, sheets["light_wall"])


def beam(layout: Layout) -> Solid:
    """Return a whole beam along x: origin at its middle, on the inner edge; y and z point outwards."""
    parameters = layout.parameters
    section, inner = parameters.frame.section_mm, layout.inner_mm
    rebate, overlap = layout.outer_mm - layout.ledge_mm, parameters.panel.overlap_mm
    magnet = parameters.magnet
    low, high = 0.5 * section - layout.rod_offset_mm, 0.5 * section + layout.rod_offset_mm
    tools = [
        rod((-inner, high, low), "x", 2.0 * inner, layout.rod_hole_mm),
        block((-inner, -1.0, section - rebate), (inner, overlap, section + 1.0)),
        block((-inner, section - rebate, -1.0), (inner, section + 1.0, overlap)),
    ]
    for along in (-0.5 * inner, 0.5 * inner):
        depth = magnet.height_mm + 0.1
        tools.append(rod((along, 0.5 * overlap, section - rebate - depth), "z", depth + 1.0, magnet.diameter_mm + 0.2))
    notch = ARM_GAP_MM + ARM_THICK_MM
    for sign in (-1.0, 1.0):
        edges = sorted((sign * (notch - 0.15), sign * (notch + ARM_THICK_MM + 0.15)))
        tools.append(block((edges[0], -1.0, -1.0), (edges[1], NOTCH_MM, NOTCH_MM)))
        tools.append(rod((sign * _PILOT_APART_MM, high + 1.0, section), "z", -0.5 * section, _PILOT_MM))
    return cut(block((-inner, 0.0, 0.0), (inner, section, section)), tools)


def _beams(layout: Layout) -> Iterator[Place]:
    whole, section = beam(layout), layout.parameters.frame.section_mm
    count, length = layout.segments, layout.beam_mm / layout.segments
    parts = [Part("beam", "Beam", PRINTED, whole, BLACK)]
    if count > 1:
        parts = []
        joints = [-layout.inner_mm + length * index for index in range(1, count)]
        dowels = [rod((at - 8.0, 5.5, 0.58 * section), "x", 16.0, 3.1) for at in joints]
        for index in range(count):
            start = -layout.inner_mm + index * length
            piece = whole & block((start, -1.0, -1.0), (start + length, section + 1.0, section + 1.0))
            title = f"Beam, piece {index + 1} of {count}"
            parts.append(Part(f"beam_{index + 1}", title, PRINTED, cut(piece, dowels), BLACK))
    for cycle in _CYCLES:
        for v, w in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            columns = cycle.T @ np.diag([v * w, v, w])
            origin = layout.centre + layout.inner_mm * (columns[:, 1] + columns[:, 2])
            for part in parts:
                yield Place(part, origin, columns)


def corner(layout: Layout) -> Solid:
    """Return a corner of the right hand: its origin is the frame's inner corner, its axes point outwards."""
    section, overlap = layout.parameters.frame.section_mm, layout.parameters.panel.overlap_mm
    rebate = layout.outer_mm - layout.ledge_mm
    low, high = 0.5 * section - layout.rod_offset_mm, 0.5 * section + layout.rod_offset_mm
    hole, away = layout.rod_hole_mm, section - rebate
    tools = [
        rod((0.0, high, low), "x", section, hole),
        rod((low, 0.0, high), "y", section, hole),
        rod((high, low, 0.0), "z", section, hole),
        block((away, -1.0, -1.0), (section + 1.0, overlap, overlap)),
        block((-1.0, away, -1.0), (overlap, section + 1.0, overlap)),
        block((-1.0, -1.0, away), (overlap, overlap, section + 1.0)),
    ]
    return cut(block((0.0, 0.0, 0.0), (section, section, section)), tools)


def _corners(layout: Layout) -> Iterator[Place]:
    right = corner(layout)
    hands = {
        1: Part("corner_right", "Corner, right hand", PRINTED, right, BLACK),
        -1: Part("corner_left", "Corner, left hand", PRINTED, mirrored_x(right), BLACK),
    }
    for signs in np.stack(np.meshgrid(*[(-1, 1)] * 3, indexing="ij"), axis=-1).reshape(8, 3):
        hand = int(signs.prod())
        turn = np.diag(signs.astype(np.float64)) @ np.diag([float(hand), 1.0, 1.0])
        yield Place(hands[hand], layout.centre + layout.inner_mm * signs, turn)


def panel_solid(panel: Panel) -> Solid:
    """Return a sheet part from z = 0 to its thickness."""
    tools = [rod((u, v, -1.0), "z", panel.thickness_mm + 2.0, diameter) for u, v, diameter in panel.circles.tolist()]
    tools += [prism(each, panel.thickness_mm + 2.0, base=-1.0) for each in panel.cutouts]
    return cut(prism(panel.outline, panel.thickness_mm), tools)


def sheet_parts(layout: Layout) -> dict[str, Part]:
    """Return every sheet part by its key."""
    colours = {"diffuser": WHITE, "led_plate": WHITE, "light_wall": WHITE}
    return {
        each.key: Part(each.key, each.title, CUT, panel_solid(each), colours.get(each.key, BLACK))
        for each in panels(layout)
    }


def face_columns(axis: str, sign: float) -> FloatArray:
    """Return the axes u, v, n of a face's panel; n points outwards, u turns with it: a rotation."""
    u, v, n = _CYCLES[("z", "y", "x").index(axis)]
    return np.column_stack([sign * u, v, sign * n])


def _panels(layout: Layout, sheets: Mapping[str, Part]) -> Iterator[Place]:
    where = (
        ("diffuser", "z", -1.0), ("diffuser", "y", 1.0), ("mask", "z", 1.0), ("mask", "y", -1.0),
        ("inlet_panel", "x", -1.0), ("end_panel", "x", 1.0),
    )  # fmt: skip
    for key, axis, sign in where:
        columns = face_columns(axis, sign)
        group = "light" if key == "diffuser" else "panels"
        yield Place(sheets[key], layout.centre + layout.ledge_mm * columns[:, 2], columns, group=group)
    for axis, sign in (("z", 1.0), ("y", -1.0)):
        columns = face_columns(axis, sign)
        yield Place(sheets["camera_plate"], layout.centre + layout.camera_panel_mm * columns[:, 2], columns,
                    group="camera")  # fmt: skip
        columns = face_columns(axis, -sign)
        yield Place(sheets["led_plate"], layout.centre + layout.led_mm * columns[:, 2], columns, group="light")


def _rods(layout: Layout) -> Iterator[Place]:
    size = layout.parameters.frame.rod_mm
    long, short = layout.long_rod_mm, layout.short_rod_mm
    behind = layout.led_mm + layout.parameters.panel.plate_mm + 10.0
    parts = {
        "long": Part("rod_long", f"Threaded rod M{size:g} x {long:.0f}", BOUGHT,
                     rod((0, 0, 0), "z", long, size), STEEL),
        "short": Part("rod_short", f"Threaded rod M{size:g} x {short:.0f}", BOUGHT,
                      rod((0, 0, 0), "z", short, size), STEEL),
    }  # fmt: skip
    for axis, sign in (("z", 1.0), ("y", -1.0), ("x", 1.0)):
        columns = face_columns(axis, sign)
        kind, start = ("short", 0.5 * short) if axis == "x" else ("long", behind)
        for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            origin = layout.centre - start * columns[:, 2]
            origin = origin + u * layout.rod_out_mm * columns[:, 0] + v * layout.rod_in_mm * columns[:, 1]
            yield Place(parts[kind], origin, columns, group="rods")


def _light_boxes(layout: Layout, wall: Part) -> Iterator[Place]:
    parameters = layout.parameters
    gap, hole = parameters.light.gap_mm, layout.rod_hole_mm
    tube = cut(rod((0, 0, 0), "z", gap, 12.0), [rod((0, 0, -1.0), "z", gap + 2.0, hole)])
    spacer = Part("spacer", "Spacer of a light box", PRINTED, tube, WHITE)
    nut = 2.0 * parameters.frame.rod_mm + 1.0
    cup = cut(rod((0, 0, 0), "z", -16.0, nut + 11.0), [rod((0, 0, 1.0), "z", -14.0, nut)])
    foot = Part("foot", "Foot", PRINTED, cup, BLACK, (0.0, 0.0, 1.0), "Or in TPU, which keeps the table's shocks away.")
    for axis, sign in (("z", -1.0), ("y", 1.0)):
        columns = face_columns(axis, sign)
        start = layout.centre + layout.outer_mm * columns[:, 2]
        for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            aside = u * layout.rod_out_mm * columns[:, 0] + v * layout.rod_in_mm * columns[:, 1]
            yield Place(spacer, start + aside, columns, group="light")
            if axis == "z":
                below = layout.led_mm + parameters.panel.plate_mm
                yield Place(foot, layout.centre + aside + below * columns[:, 2], columns @ np.diag([1.0, -1.0, -1.0]),
                            group="light")  # fmt: skip
        for turn in range(4):
            # A wall's own x runs along it, its y away from the frame, its z outwards across it.
            angle = 0.5 * np.pi * turn
            out = np.cos(angle) * columns[:, 0] + np.sin(angle) * columns[:, 1]
            own = np.column_stack([np.cross(columns[:, 2], out), columns[:, 2], out])
            yield Place(wall, start + layout.wall_u_mm * out, own, group="light")
