"""What cannot be built, and why: each rule gives one sentence with what to change. And the figures of the rest."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cathxr.core import ConfigError
from cathxr.hardware.fits import fit_refusals
from cathxr.hardware.gears import SpurGear, centre_mm, degrees_per_count, gear_pair, mesh
from cathxr.hardware.layout import (
    ARM_THICK_MM,
    HUB_MM,
    INLET_SIDE_MM,
    MARKER_RADIUS_MM,
    NOTCH_MM,
    PANEL_REST_MM,
    Layout,
)
from cathxr.hardware.light import Lit, advised_distance_mm, lit
from cathxr.hardware.limits import limit_refusals
from cathxr.hardware.parameters import INLET_SIZES_FR, Parameters

MARGIN_PX = 12.0
"""What a camera must see beyond the ROI: a camera stands a millimetre off its place, and turned a little."""
_BLUR_PX = 2.0
_LEAST_CONTACT = 1.2
_LEAST_WIDTH_PX = 6.0


@dataclass(frozen=True)
class Figures:
    """What a rig is worth, computed: all of it follows from the parameters.

    view_mm: what a camera sees at the ROI's near face, width and height. sharp_mm: nearest and farthest sharp distance.
    play_deg: of the gears, at the catheter: nominal, and at both ends of the centre distance's tolerance.
    """

    outer_mm: float
    lit: Lit
    view_mm: tuple[float, float]
    roi_share: float
    mm_per_px: float
    catheter_px: float
    sharp_mm: tuple[float, float]
    degrees_per_count: float
    play_deg: tuple[float, float, float]
    contact_ratio: float
    segments: int


def figures(layout: Layout) -> Figures:
    """Return what a rig is worth."""
    parameters = layout.parameters
    camera, gear = parameters.camera, parameters.gear
    near = camera.distance_mm - layout.half_mm
    size = np.array([camera.width_px, camera.height_px])
    view = size / layout.focal_px * near
    runs = [mesh(gear, off_mm=off) for off in (0.0, -gear.centre_error_mm, gear.centre_error_mm)]
    return Figures(
        outer_mm=2.0 * layout.outer_mm,
        lit=lit(layout),
        view_mm=(float(view[0]), float(view[1])),
        roi_share=float(2.0 * layout.half_mm / view.min()),
        mm_per_px=camera.distance_mm / layout.focal_px,
        catheter_px=parameters.catheter.diameter_mm * layout.focal_px / camera.distance_mm,
        sharp_mm=_sharp(layout),
        degrees_per_count=degrees_per_count(gear, parameters.encoder),
        play_deg=(runs[0].play_deg, runs[1].play_deg, runs[2].play_deg),
        contact_ratio=min(each.contact_ratio for each in runs),
        segments=layout.segments,
    )


def check(parameters: Parameters) -> Figures:
    """Return what the rig of these parameters is worth.

    Raises:
        ConfigError: it cannot be built, or would not do what it is for; the sentence says why and what to change.
    """
    for sentence in limit_refusals(parameters):
        raise ConfigError(sentence)
    layout = Layout(parameters)
    for rules in (_frame, _printing, _roll, fit_refusals):
        for sentence in rules(layout):
            raise ConfigError(sentence)
    found = figures(layout)
    for sentence in _optics(layout, found):
        raise ConfigError(sentence)
    return found


def _frame(layout: Layout) -> Iterator[str]:
    parameters = layout.parameters
    frame, panel, magnet = parameters.frame, parameters.panel, parameters.magnet
    wall = parameters.printer.least_wall_mm
    if parameters.catheter.french not in INLET_SIZES_FR:
        yield (
            f"catheter.french: an inlet of {parameters.catheter.french}F is not made; choose from "
            f"{INLET_SIZES_FR[0]} to {INLET_SIZES_FR[-1]}."
        )
    rebate = panel.thickness_mm + 0.2
    half = 0.5 * frame.section_mm
    outwards = half - layout.rod_offset_mm - 0.5 * layout.rod_hole_mm - rebate
    if outwards < wall:
        yield (
            f"frame.section_mm: beams of {frame.section_mm:g} mm leave {outwards:.1f} mm between rod and panel, and "
            f"the printer needs {wall:g}; make the beams at least {frame.section_mm + 2.0 * (wall - outwards):.1f} mm "
            "or the rods thinner."
        )
    inwards = half - layout.rod_offset_mm - 0.5 * layout.rod_hole_mm
    if inwards < wall or half + layout.rod_offset_mm - 0.5 * layout.rod_hole_mm < NOTCH_MM:
        yield "frame.rod_mm: the rods' holes break out of the beams; make the rods thinner or the beams thicker."
    if panel.overlap_mm < magnet.diameter_mm + 2.0 * wall or panel.overlap_mm > half:
        yield (
            f"panel.overlap_mm: {panel.overlap_mm:g} mm on the frame do not hold magnets of {magnet.diameter_mm:g} mm "
            f"in beams of {frame.section_mm:g} mm; choose from {magnet.diameter_mm + 2.0 * wall:.1f} to {half:.1f} mm."
        )
    if rebate + magnet.height_mm + wall > half - layout.rod_offset_mm + 0.5 * frame.section_mm:
        yield f"magnet.height_mm: magnets of {magnet.height_mm:g} mm go through the beams; choose flatter ones."
    if layout.cross_core_mm > 2.0 * layout.inner_mm - 4.0:
        yield (
            f"frame.inlet_length_mm: the crosses' middles of {layout.cross_core_mm:.0f} mm do not fit into the frame, "
            f"{2.0 * layout.inner_mm:.0f} mm inside; make the inlet longer, which makes the frame larger."
        )
    body = parameters.camera.board_mm
    room = parameters.camera.distance_mm - layout.outer_mm - parameters.camera.lens_mm - PANEL_REST_MM
    if room < 20.0:
        yield (
            f"camera.distance_mm: at {parameters.camera.distance_mm:g} mm the cameras of {body:g} mm stand in or on "
            f"the frame of {2 * layout.outer_mm:.0f} mm; take them at least "
            f"{parameters.camera.distance_mm + 20.0 - room:.0f} mm away."
        )


def _printing(layout: Layout) -> Iterator[str]:
    parameters = layout.parameters
    bed = sorted(parameters.printer.bed_mm[:2])
    core = layout.cross_core_mm + 1.0
    if core > bed[0]:
        yield (
            f"printer.bed_mm: a cross's middle is {core:.0f} mm square, because its fiducials must not come apart, and "
            f"the bed is {bed[0]:g} mm deep; take a smaller ROI or a larger printer."
        )
    if layout.segments > 3:
        yield f"printer.bed_mm: beams would come in {layout.segments} pieces; take a larger printer."
    if 2.0 * parameters.printer.least_wall_mm > ARM_THICK_MM:
        yield (
            f"printer.least_wall_mm: walls of {parameters.printer.least_wall_mm:g} mm are too thick for the crosses' "
            f"arms of {ARM_THICK_MM:g} mm; take a finer nozzle."
        )


def _roll(layout: Layout) -> Iterator[str]:
    gear, encoder = layout.parameters.gear, layout.parameters.encoder
    fewest = int(np.ceil(2.0 / np.sin(np.deg2rad(gear.pressure_deg)) ** 2))
    if min(gear.catheter_teeth, gear.encoder_teeth) < fewest:
        yield (
            f"gear: {min(gear.catheter_teeth, gear.encoder_teeth)} teeth would be undercut at "
            f"{gear.pressure_deg:g} degrees; take at least {fewest}."
        )
    least = 0.5 * (encoder.body_mm + HUB_MM) + 2.0
    if centre_mm(gear) < least:
        yield (
            f"gear: the centres are {centre_mm(gear):.1f} mm apart, and the encoder of {encoder.body_mm:g} mm would "
            f"touch the catheter gear's hub; take more teeth or a larger module, for at least {least:.1f} mm."
        )
    tight, loose = (mesh(gear, off_mm=sign * gear.centre_error_mm) for sign in (-1.0, 1.0))
    if tight.play_deg <= 0 or tight.clearance_mm <= 0:
        yield (
            f"gear: with centres {gear.centre_error_mm:g} mm too near the gears jam (play {tight.play_deg:.2f} "
            f"degrees, {tight.clearance_mm:.2f} mm to the roots); take more off the teeth (thinning_mm)."
        )
    if loose.contact_ratio < _LEAST_CONTACT:
        yield (
            f"gear: with centres {gear.centre_error_mm:g} mm too far apart {loose.contact_ratio:.2f} teeth are in "
            f"contact on average, and the gears need {_LEAST_CONTACT}; take more teeth or a larger module."
        )
    if _bore_wall(layout, gear_pair(gear)[1]) < layout.parameters.printer.least_wall_mm:
        yield (
            f"gear: the encoder's shaft of {encoder.shaft_mm:g} mm leaves no wall in its gear of "
            f"{gear.encoder_teeth} teeth; take more teeth or a larger module."
        )


def _bore_wall(layout: Layout, gear: SpurGear) -> float:
    return gear.root_mm - 0.5 * layout.parameters.encoder.shaft_mm


def _optics(layout: Layout, found: Figures) -> Iterator[str]:
    parameters = layout.parameters
    camera = parameters.camera
    size = min(camera.width_px, camera.height_px)
    near = camera.distance_mm - layout.half_mm
    needed = 2.0 * (layout.half_mm + MARKER_RADIUS_MM) / near * layout.focal_px + 2.0 * MARGIN_PX
    if needed > size:
        yield (
            f"camera: the picture is {size} px high and the ROI of {2 * layout.half_mm:g} mm needs {needed:.0f}; take "
            f"a lens of at most {camera.focal_mm * size / needed:.2f} mm or stand farther away."
        )
    if found.lit.of_places < parameters.light.least_share:
        least = advised_distance_mm(layout)
        away = f"take the cameras to about {least:.0f} mm, " if np.isfinite(least) else ""
        yield (
            f"light: only {100 * found.lit.of_places:.1f} % of the view rays through the ROI end on the lit diffuser, "
            f"and {100 * parameters.light.least_share:g} % must; {away}make the inlet longer, which "
            "makes the frame larger, or take a smaller ROI."
        )
    if found.catheter_px < _LEAST_WIDTH_PX:
        yield (
            f"camera: the catheter is {found.catheter_px:.1f} px wide in the picture, and the tracker needs "
            f"{_LEAST_WIDTH_PX:g}; come nearer, or take a longer lens or finer pixels."
        )
    least_sharp, most_sharp = found.sharp_mm
    far = camera.distance_mm + layout.half_mm
    if least_sharp > near or most_sharp < far:
        yield (
            f"camera: the lens is sharp from {least_sharp:.0f} to {most_sharp:.0f} mm at f/{camera.f_number:g}, and "
            f"the ROI lies from {near:.0f} to {far:.0f} mm; stop it down."
        )
    if 2.0 * layout.inner_mm < INLET_SIDE_MM + 60.0:
        yield "roi.side_mm: the frame has no room for the inlet; take a larger ROI."


def _sharp(layout: Layout) -> tuple[float, float]:
    """Return between which distances a point blurs to at most two pixels: the usual thin-lens formula."""
    camera = layout.parameters.camera
    blur_mm = _BLUR_PX * camera.pixel_um * 1e-3
    hyperfocal = camera.focal_mm**2 / (camera.f_number * blur_mm)
    distance = camera.distance_mm
    far = hyperfocal * distance / (hyperfocal - distance) if hyperfocal > distance else float("inf")
    return hyperfocal * distance / (hyperfocal + distance), far
