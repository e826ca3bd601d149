"""What is cut from sheets: outlines and holes in the plane, finished size (the kerf is added when they are written)."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.layout import (
    HOLDER_SCREW_MM,
    INLET_SIDE_MM,
    JIG_MAGNET_MM,
    JIG_SIDE_MM,
    RAIL_LENGTH_MM,
    TILT_RADIUS_MM,
    Layout,
)

SCREW_M3_MM = 3.4
_TAB_MM = 20.0


@dataclass(frozen=True, eq=False)
class Panel:
    """One sheet part. outline (N, 2) and cutouts (N, 2) each: closed, mm; circles (M, 3): centre and diameter."""

    key: str
    title: str
    material: str
    thickness_mm: float
    quantity: int
    outline: FloatArray
    circles: FloatArray
    cutouts: tuple[FloatArray, ...] = ()

    @property
    def area_mm2(self) -> float:
        """The part's area."""
        holes = sum(_area(each) for each in self.cutouts) + float((np.pi / 4.0 * self.circles[:, 2] ** 2).sum())
        return _area(self.outline) - holes


def panels(layout: Layout) -> tuple[Panel, ...]:
    """Return every sheet part. Faces of the frame have axes u, v as (x, y), (y, z) and (z, x) for normals z, x, y."""
    panel = layout.parameters.panel
    thin, plate = panel.thickness_mm, panel.plate_mm
    face, base = rectangle(layout.panel_side_mm), rectangle(layout.plate_side_mm)
    magnets, rods = face_magnets(layout), rod_places(layout)
    window = rectangle(2.0 * layout.window_half_mm)
    inlet = np.vstack([magnets, _square(HOLDER_SCREW_MM, SCREW_M3_MM)])
    jig = np.vstack([magnets, _square(JIG_MAGNET_MM, layout.parameters.magnet.diameter_mm)])
    cable = np.array([[0.0, layout.window_half_mm + 8.0, 6.0]])
    slots = tuple(_slots(layout))
    return (
        Panel("diffuser", "Diffuser", "PMMA, opal white, about 50 % transmission", thin, 2, face, magnets),
        Panel("mask", "Mask before a camera", "PMMA, black, matt", thin, 2, face,
              np.vstack([magnets, cable]), (window,)),
        Panel("inlet_panel", "Panel of the inlet", "PMMA, black, matt", thin, 1, face, inlet,
              (rectangle(INLET_SIDE_MM + 0.4),)),
        Panel("end_panel", "Panel of the jig", "PMMA, black, matt", thin, 1, face, jig,
              (rectangle(JIG_SIDE_MM + 0.4),)),
        Panel("camera_plate", "Plate of a camera", "PMMA, black, matt, or aluminium", plate, 2, base,
              np.vstack([rods, _camera_holes(layout)])),
        Panel("led_plate", "Plate of the LEDs", "PMMA, white, or aluminium", plate, 2, base, rods, slots),
        Panel("light_wall", "Wall of a light box", "PMMA, white", thin, 8, _wall(layout), np.empty((0, 3))),
        Panel("rail_plate", "Plate under the rail", "PMMA, black, or aluminium", plate, 1,
              rectangle(RAIL_LENGTH_MM + 20.0, 60.0), _rail_holes()),
    )  # fmt: skip


def rectangle(width: float, height: float | None = None) -> FloatArray:
    """Return a rectangle's corners (4, 2) about the origin, anticlockwise."""
    u, v = 0.5 * width, 0.5 * (width if height is None else height)
    return np.array([[-u, -v], [u, -v], [u, v], [-u, v]])


def face_magnets(layout: Layout) -> FloatArray:
    """Return the magnets of a frame's face (4, 3): u, v, diameter."""
    panel = layout.parameters.panel
    across, along = layout.inner_mm + 0.5 * panel.overlap_mm, 0.5 * layout.inner_mm
    return np.array(
        [[su * along, sv * across, layout.parameters.magnet.diameter_mm] for su in (-1, 1) for sv in (-1, 1)]
    )


def rod_places(layout: Layout) -> FloatArray:
    """Return where rods go through a plate (4, 3): u, v, diameter."""
    return np.array(
        [[su * layout.rod_out_mm, sv * layout.rod_in_mm, layout.rod_hole_mm] for su in (-1, 1) for sv in (-1, 1)]
    )


def tilt_places() -> FloatArray:
    """Return where a camera's three tilting screws are (3, 2)."""
    angle = np.deg2rad([90.0, 210.0, 330.0])
    return TILT_RADIUS_MM * np.column_stack([np.cos(angle), np.sin(angle)])


def rail_screws() -> FloatArray:
    """Return the rail plate's holes (N, 3) along u, outwards from the box, and v, from the middle of its end there."""
    rail = [[12.5 + 25.0 * index + 10.0, 0.0, SCREW_M3_MM] for index in range(int(RAIL_LENGTH_MM // 25.0))]
    ends = [[at, side, SCREW_M3_MM] for at in (12.0, RAIL_LENGTH_MM + 8.0) for side in (-22.0, 22.0)]
    return np.array(rail + ends)


def _rail_holes() -> FloatArray:
    return np.asarray(rail_screws() - np.array([0.5 * RAIL_LENGTH_MM + 10.0, 0.0, 0.0]))


def _camera_holes(layout: Layout) -> FloatArray:
    lens = [[0.0, 0.0, layout.parameters.camera.lens_mm + 6.0]]
    return np.vstack([lens, np.column_stack([tilt_places(), np.full(3, SCREW_M3_MM)])])


def _square(half: float, diameter: float) -> FloatArray:
    return np.array([[su * half, sv * half, diameter] for su in (-1, 1) for sv in (-1, 1)])


def _slots(layout: Layout) -> list[FloatArray]:
    """Return the LED plate's slots for the walls' tabs: two on each side."""
    thick = layout.parameters.panel.thickness_mm
    middle, found = layout.wall_u_mm + 0.5 * thick, []
    for along in (-0.5 * layout.inner_mm, 0.5 * layout.inner_mm):
        for side in (-middle, middle):
            found.append(rectangle(thick + 0.3, _TAB_MM + 0.3) + np.array([side, along]))
            found.append(rectangle(_TAB_MM + 0.3, thick + 0.3) + np.array([along, side]))
    return found


def _wall(layout: Layout) -> FloatArray:
    """Return a light box's wall (12, 2): u along it, v from the frame (0) to the LED plate, with two tabs beyond."""
    half, high = layout.inner_mm - 2.0, layout.parameters.light.gap_mm
    tip, tab = high + layout.parameters.panel.plate_mm, 0.5 * _TAB_MM
    quarter = 0.5 * layout.inner_mm
    right = [[quarter + tab, high], [quarter + tab, tip], [quarter - tab, tip], [quarter - tab, high]]
    left = [[u - 2.0 * quarter, v] for u, v in right]
    return np.array([[-half, 0.0], [half, 0.0], [half, high], *right, *left, [-half, high]])


def _area(outline: FloatArray) -> float:
    x, y = outline.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
