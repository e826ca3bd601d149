"""Where bought and made parts must fit each other: camera and carrier, magnets, light, gears and encoder, the rail."""

from collections.abc import Iterator

import numpy as np

from cathxr.hardware.gears import centre_mm, degrees_per_count, gear_pair, tip_width_mm
from cathxr.hardware.layout import (
    BEARING_HALF_MM,
    BRACKET_GUSSET_MM,
    HUB_MM,
    INSERT_FLANGE_MM,
    SMALL_HUB_MM,
    TILT_RADIUS_MM,
    Layout,
)
from cathxr.hardware.light import MOST_RIPPLE, row_ripple
from cathxr.hardware.parameters import Parameters

LONGEST_ROD_MM = 1000.0
STRIP_WIDE_MM, STRIP_HIGH_MM, STRIP_ASIDE_MM = 10.0, 2.2, 12.0
"""An LED strip, and from a mask's window to the strips of the front light: a cable's hole lies between."""
_M3_NUT_MM, _STANDOFF_MM = 3.2, 2.3
_GRUB_WALL_MM, _BOLT_MM = 2.0, 1.7
_COARSEST_DEG, _FASTEST_HZ, _TURNS_HZ = 0.5, 50_000.0, 3.0
_LETTER_ROOM_MM = 5.0


def fit_refusals(layout: Layout) -> Iterator[str]:
    """Yield a sentence for each of two parts that do not go together, with what to change."""
    yield from _camera(layout.parameters)
    yield from _box(layout)
    yield from _gears(layout)
    yield from _encoder(layout)


def _camera(parameters: Parameters) -> Iterator[str]:
    camera, wall = parameters.camera, parameters.printer.least_wall_mm
    room = float(np.sqrt(2.0)) * (TILT_RADIUS_MM - _M3_NUT_MM)
    if camera.board_mm > room:
        yield (
            f"camera.board_mm: a board of {camera.board_mm:g} mm touches the carrier's three screws; take one of at "
            f"most {room:.1f} mm."
        )
    if camera.board_hole_mm > camera.board_mm - 3.0:
        yield (
            f"camera.board_hole_mm: holes {camera.board_hole_mm:g} mm apart do not lie in a board of "
            f"{camera.board_mm:g} mm; measure yours."
        )
    least = 2.0 * (camera.board_hole_mm / np.sqrt(2.0) - _STANDOFF_MM - wall) - 8.0
    if camera.lens_mm > least:
        yield (
            f"camera.lens_mm: a lens of {camera.lens_mm:g} mm leaves no room for the board's stand-offs, "
            f"{camera.board_hole_mm:g} mm apart; take one of at most {least:.1f} mm."
        )


def _box(layout: Layout) -> Iterator[str]:
    parameters = layout.parameters
    wall, light = parameters.printer.least_wall_mm, parameters.light
    if layout.long_rod_mm > LONGEST_ROD_MM:
        yield (
            f"camera.distance_mm: the rods that carry the cameras would be {layout.long_rod_mm:.0f} mm long, and they "
            f"are sold up to {LONGEST_ROD_MM:.0f} mm; come nearer with a shorter lens, or take a smaller ROI."
        )
    highest = INSERT_FLANGE_MM - wall - 0.1
    if parameters.magnet.height_mm > highest:
        yield (
            f"magnet.height_mm: magnets of {parameters.magnet.height_mm:g} mm go through the inlet's flange of "
            f"{INSERT_FLANGE_MM:g} mm; take ones of at most {highest:.1f} mm."
        )
    ripple = row_ripple(layout)
    if ripple > MOST_RIPPLE:
        yield (
            f"light.pitch_mm: rows of LEDs {light.pitch_mm:g} mm apart and {light.gap_mm:g} mm behind the diffuser "
            f"show as stripes of {100 * ripple:.0f} %, and {100 * MOST_RIPPLE:.0f} % may be; set the rows closer or "
            "take a larger gap_mm."
        )
    if layout.window_half_mm + STRIP_ASIDE_MM + STRIP_WIDE_MM > layout.inner_mm:
        yield (
            "frame.inlet_length_mm: the front light does not fit between the masks' windows and the beams; make the "
            "inlet longer, which makes the frame larger, or take the cameras farther away."
        )


def _gears(layout: Layout) -> Iterator[str]:
    gear = layout.parameters.gear
    first, second = gear_pair(gear)
    thin = min(tip_width_mm(first), tip_width_mm(second))
    least = max(0.25 * gear.module_mm, 0.5 * layout.parameters.printer.least_wall_mm)
    if thin < least:
        yield (
            f"gear.thinning_mm: the teeth would be {thin:.2f} mm wide at their tips, and {least:.2f} mm must be; take "
            "less off them, a larger module, or a smaller pressure angle."
        )
    root = 0.5 * HUB_MM + _LETTER_ROOM_MM
    if first.root_mm < root:
        yield (
            f"gear: the catheter gear of {gear.catheter_teeth} teeth is {first.root_mm:.1f} mm in radius at its roots, "
            f"and beside its hub the T mark needs {root:g}; take more teeth or a larger module."
        )
    side, bed = 2.0 * first.tip_mm, min(layout.parameters.printer.bed_mm[:2])
    deep = 64.0 + centre_mm(gear) + 18.0
    if max(side, deep) > bed:
        yield (
            f"gear: gears {centre_mm(gear):.0f} mm apart need a base of {max(side, deep):.0f} mm, and the bed is "
            f"{bed:g} mm; take fewer teeth or a smaller module."
        )
    if layout.rail_plate_mm - BRACKET_GUSSET_MM < layout.bracket_screw_mm + 5.0:
        yield (
            f"gear: with gears and an encoder of this size the rail lies {-layout.rail_plate_mm:.0f} mm below the "
            "inlet, too near to the lower beam that carries it; take fewer teeth, a smaller module or encoder, or a "
            "larger frame."
        )


def _encoder(layout: Layout) -> Iterator[str]:
    parameters = layout.parameters
    encoder, gear = parameters.encoder, parameters.gear
    if not encoder.shaft_mm < encoder.boss_mm < encoder.bolt_circle_mm - 2.0 * _BOLT_MM:
        yield (
            f"encoder: shaft {encoder.shaft_mm:g}, boss {encoder.boss_mm:g} and bolt circle {encoder.bolt_circle_mm:g} "
            "mm do not lie within each other; measure yours."
        )
    if encoder.bolt_circle_mm > encoder.body_mm - 2.0 * _BOLT_MM:
        yield (
            f"encoder.bolt_circle_mm: {encoder.bolt_circle_mm:g} mm does not lie in a body of {encoder.body_mm:g} mm; "
            "measure yours."
        )
    if 0.5 * (SMALL_HUB_MM - encoder.shaft_mm) < _GRUB_WALL_MM:
        yield f"encoder.shaft_mm: {encoder.shaft_mm:g} mm leave no thread for the grub screw in the gear's hub."
    aside = centre_mm(gear) - 0.5 * 0.5 * encoder.bolt_circle_mm - 2.75
    if aside < BEARING_HALF_MM + 0.2:
        yield (
            f"gear: the encoder's screws would touch the bearing's wall with centres {centre_mm(gear):.1f} mm apart; "
            "take more teeth or a larger module."
        )
    step = degrees_per_count(gear, encoder)
    if step > _COARSEST_DEG:
        yield (
            f"encoder.pulses: {encoder.pulses} pulses a turn give {step:.2f} degrees a count, and roll needs "
            f"{_COARSEST_DEG:g} or finer; take an encoder with more pulses or a larger gear ratio."
        )
    edges = 4.0 * encoder.pulses * gear.catheter_teeth / gear.encoder_teeth * _TURNS_HZ
    if edges > _FASTEST_HZ:
        yield (
            f"encoder.pulses: {_TURNS_HZ:g} turns a second of the catheter would give {edges:.0f} edges a second, and "
            f"the board counts {_FASTEST_HZ:.0f}; take fewer pulses or a smaller gear ratio."
        )
