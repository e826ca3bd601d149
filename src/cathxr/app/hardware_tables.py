"""docs/build/figures.md: every figure of the manual, computed from the parameters."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cathxr.app.hardware_params import figure_lines
from cathxr.core import ConfigError
from cathxr.hardware.examples import changed, good_examples, refused_examples
from cathxr.hardware.holes import nominal_phantom
from cathxr.hardware.layout import (
    ARM_GAP_MM,
    CARRIER_MM,
    MARKER_RADIUS_MM,
    PANEL_REST_MM,
    STANDOFF_MM,
    TILT_RADIUS_MM,
    Layout,
    bore_mm,
)
from cathxr.hardware.light import least_distance_mm, lit, row_ripple
from cathxr.hardware.parameters import INLET_SIZES_FR, Parameters, RoiChoice
from cathxr.hardware.purchase import front_strip_m, strip_m, strip_rows, supply_watt
from cathxr.hardware.rules import check

_M3_PITCH_MM = 0.5
_DISTANCES_MM = (260.0, 300.0, 330.0, 400.0)
_BOXES = ((100.0, 40.0), (120.0, 40.0), (120.0, 50.0), (140.0, 40.0))
"""ROI and inlet length, which together make the frame."""
_HEAD = """\
# Figures of the rig

Made by `cathxr hardware manual`; nothing here is written by hand.
"""


def figures_text(layout: Layout) -> str:
    """Return the page for a set of parameters."""
    parts = [_HEAD, _worth(layout), _sizes(layout), _inlets(), _coverage(layout.parameters), _pass(), _refused()]
    return "\n".join(parts)


def _worth(layout: Layout) -> str:
    rows = [f"| {what} | {value} |" for what, value in figure_lines(layout, check(layout.parameters))]
    return _table(f"What {layout.parameters.name!r} is worth", "| | |", "|---|---|", rows)


def _sizes(layout: Layout) -> str:
    return _table("Sizes", "| | |", "|---|---|", [f"| {what} | {value} |" for what, value in _size_lines(layout)])


def _size_lines(layout: Layout) -> Iterator[tuple[str, str]]:
    parameters = layout.parameters
    panel, light, frame = parameters.panel, parameters.light, parameters.frame
    pieces = f", each of {layout.segments} pieces" if layout.segments > 1 else ""
    yield "beams", f"12 of {layout.beam_mm:.0f} x {frame.section_mm:g} x {frame.section_mm:g} mm{pieces}"
    yield "rods and nuts", f"M{frame.rod_mm:g}"
    yield "panels in the frame", f"{layout.panel_side_mm:.1f} mm square, {panel.thickness_mm:g} mm thick"
    yield "plates of cameras and LEDs", f"{layout.plate_side_mm:.1f} mm square, {panel.plate_mm:g} mm thick"
    yield "windows in the masks", f"{2.0 * layout.window_half_mm:.1f} mm square"
    yield "camera plate's height", f"{layout.camera_panel_mm - layout.outer_mm:.1f} mm between frame and plate"
    gap = PANEL_REST_MM - CARRIER_MM - STANDOFF_MM
    # The middle of the triangle's side opposite to a screw is half as far from the camera's axis as the screw.
    tilt = np.rad2deg(_M3_PITCH_MM / (1.5 * TILT_RADIUS_MM))
    yield "camera carrier", f"{gap:g} mm from its plate when level; one turn of a screw tilts it by {tilt:.1f} degrees"
    yield "balls of the crosses", f"{2.0 * MARKER_RADIUS_MM:g} mm; their middles {ARM_GAP_MM:g} mm before the arms"
    yield "laser", f"kerf {panel.kerf_mm:g} mm, half of it on each side"
    yield (
        "LEDs",
        (
            f"{strip_rows(layout)} rows every {light.pitch_mm:g} mm on each LED plate, {strip_m(layout):.2f} m; "
            f"{light.gap_mm:g} mm to the diffuser, where they show as stripes of {100.0 * row_ripple(layout):.1f} %; "
            f"front light {front_strip_m(layout):.2f} m"
        ),
    )
    yield "supply", f"24 V, {supply_watt(layout):.0f} W"
    yield "magnets", f"{parameters.magnet.diameter_mm:g} x {parameters.magnet.height_mm:g} mm"
    holes = nominal_phantom(layout).positions_mm
    yield (
        "phantom",
        (
            f"{len(holes)} seats, x {holes[:, 0].min():.0f} to {holes[:, 0].max():.0f} mm, up to "
            f"{np.hypot(holes[:, 1], holes[:, 2]).max():.0f} mm off the axis"
        ),
    )


def _inlets() -> str:
    rows = [f"| {french}F | {french / 3.0:.2f} | {bore_mm(french):.2f} |" for french in INLET_SIZES_FR]
    return _table("Inlets", "| size | catheter, mm | bore, mm |", "|---|---:|---:|", rows)


def _coverage(parameters: Parameters) -> str:
    rows = []
    for side, inlet in _BOXES:
        base = replace(changed(parameters, frame={"inlet_length_mm": inlet}), roi=RoiChoice(side))
        shares = [lit(Layout(changed(base, camera={"distance_mm": each}))).of_places for each in _DISTANCES_MM]
        told = " | ".join(f"{100.0 * each:.1f} %" for each in shares)
        box = Layout(base)
        rows.append(f"| {side:g} mm | {2.0 * box.outer_mm:.0f} mm | {told} | {least_distance_mm(box):.0f} mm |")
    head = " | ".join(f"{each:g} mm" for each in _DISTANCES_MM)
    return _table(
        "Share of view rays that end on the lit diffuser",
        f"| ROI | frame | {head} | every ray from |", "|---|---" + "|---:" * (len(_DISTANCES_MM) + 1) + "|", rows,
    )  # fmt: skip


def _pass() -> str:
    rows = []
    for parameters in good_examples():
        found, layout = check(parameters), Layout(parameters)
        rows.append(
            f"| {parameters.name} | {parameters.camera.distance_mm:g} mm | {found.outer_mm:.0f} mm | "
            f"{100.0 * found.lit.of_places:.1f} % | {100.0 * found.roi_share:.0f} % | {found.mm_per_px:.3f} | "
            f"{found.catheter_px:.1f} px | {layout.bore_mm:.2f} mm |"
        )
    head = (
        "| rig | camera | frame | rays on the diffuser | ROI in the picture's height | mm a pixel | catheter | bore |"
    )
    return _table("Three rigs that pass every check", head, "|---|---:|---:|---:|---:|---:|---:|---:|", rows)


def _refused() -> str:
    rows = []
    for what, parameters in refused_examples():
        try:
            check(parameters)
        except ConfigError as error:
            rows.append(f"| {what} | {error} |")
    return _table("Three that are refused", "| what was changed | what is said |", "|---|---|", rows)


def _table(title: str, head: str, line: str, rows: list[str]) -> str:
    return "\n".join([f"## {title}", "", head, line, *rows, ""])
