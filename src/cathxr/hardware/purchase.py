"""What is bought, by specification: whatever meets it will do. Quantities follow from the parameters."""

from dataclasses import dataclass

import numpy as np

from cathxr.hardware.layout import RAIL_LENGTH_MM, Layout
from cathxr.hardware.panels import panels

DENSITY_G_CM3 = {"printed": 1.27, "soft": 1.21, "cut": 1.19}
"""PETG, TPU and PMMA, as their makers state them."""


@dataclass(frozen=True)
class Bought:
    """One line of the shopping list."""

    item: str
    quantity: float
    unit: str
    specification: str


def shopping_list(layout: Layout) -> tuple[Bought, ...]:
    """Return everything that is neither printed nor cut."""
    return (*_optics(layout), *_light(layout), *_frame(layout), *_roll(layout))


def strip_rows(layout: Layout) -> int:
    """Return how many rows of LEDs there are in one light box."""
    return int(np.floor(2.0 * layout.wall_u_mm / layout.parameters.light.pitch_mm))


def strip_m(layout: Layout) -> float:
    """Return the length of LED strip in one light box."""
    return strip_rows(layout) * 2.0 * layout.inner_mm * 1e-3


def front_strip_m(layout: Layout) -> float:
    """Return the length of LED strip around the windows of both masks."""
    return 8.0 * 2.0 * layout.window_half_mm * 1e-3


def supply_watt(layout: Layout) -> float:
    """Return what the supply must be able to give, with a third to spare."""
    watt = layout.parameters.light.watt_per_m * (2.0 * strip_m(layout) + front_strip_m(layout))
    return float(np.ceil(1.3 * watt / 5.0) * 5.0)


NOT_DRAWN = (
    "LED strips of the front light", "springs", "washers", "screws and their nuts", "magnets", "glue", "cables",
    "supply and dimmers", "the Nano with its resistors",
)  # fmt: skip
"""What is bought and does not stand in the assembly."""


def _optics(layout: Layout) -> list[Bought]:
    camera = layout.parameters.camera
    sensor = f"{camera.width_px * camera.pixel_um / 1000:.2f} x {camera.height_px * camera.pixel_um / 1000:.2f} mm used"
    return [
        Bought("Camera", 2, "piece", f"USB, global shutter, colour, at least {camera.width_px} x {camera.height_px} at "
               f"{camera.rate_hz:g} pictures/s, pixels of {camera.pixel_um:g} um ({sensor}), manual exposure and gain, "
               f"board {camera.board_mm:g} x {camera.board_mm:g} mm with M2 holes {camera.board_hole_mm:g} mm apart, "
               "S-mount (M12); each on a USB port of its own"),
        Bought("Lens", 2, "piece", f"M12 x 0.5, {camera.focal_mm:g} mm, f/{camera.f_number:g} or slower, made for the "
               f"sensor's size, with a locking ring, at most {camera.lens_mm:g} mm across"),
        Bought("USB cable", 2, "piece", "for the cameras, at most 3 m, screened"),
    ]  # fmt: skip


def _light(layout: Layout) -> list[Bought]:
    light = layout.parameters.light
    back, front = 2.0 * strip_m(layout), front_strip_m(layout)
    return [
        Bought("LED strip, back light", round(back, 2), "m", "24 V, white 5000 to 6500 K, CRI 90, "
               f"{light.watt_per_m:g} W/m, at least 120 LEDs/m; rows {light.pitch_mm:g} mm apart on both LED plates"),
        Bought("LED strip, front light", round(front, 2), "m", "the same, around the windows inside both masks; on a "
               "switch of its own"),
        Bought("Power supply", 1, "piece", f"24 V DC, at least {supply_watt(layout):.0f} W, CE marked, "
               "with a barrel connector"),
        Bought("LED dimmer", 2, "piece", "24 V, constant current or PWM above 20 kHz: a slower one makes pictures "
               "flicker; one for the back, one for the front light"),
    ]  # fmt: skip


def _frame(layout: Layout) -> list[Bought]:
    parameters = layout.parameters
    size, magnet = parameters.frame.rod_mm, parameters.magnet
    face = 6 * 4
    jig = 4
    dowels = 12 * (layout.segments - 1)
    found = [
        Bought(f"Threaded rod M{size:g}", 8, "piece", f"{layout.long_rod_mm:.0f} mm long, steel, zinc plated"),
        Bought(f"Threaded rod M{size:g}", 4, "piece", f"{layout.short_rod_mm:.0f} mm long, steel, zinc plated"),
        Bought(f"Nut M{size:g} with washer", 8 * 4 + 4 * 2, "piece", "ISO 4032 and ISO 7089"),
        Bought("Magnet", 2 * face + 2 * jig + 6, "piece", f"neodymium N42, {magnet.diameter_mm:g} x "
               f"{magnet.height_mm:g} mm: {face} in beams, {face} in panels, {2 * jig} for the jig, 6 for one inlet; "
               "3 more for each further inlet"),
        Bought("Ball", 8, "piece", "6.0 mm, plastic, matt, two each of red, green, blue, yellow, drilled 1.5 mm to the "
               "middle"),
        Bought("Dowel pin", 8, "piece", "1.5 x 8 mm, ISO 8734"),
        Bought("Screw M3 x 10", 24, "piece", "ISO 4762, self-tapping into printed holes of 2.6 mm or with nuts"),
        Bought("Screw M3 x 25 with spring and nut", 6, "piece", "spring 5 mm wide, 12 mm long, about 1 N/mm: tilts the "
               "cameras"),
        Bought("Screw M2 x 6", 8, "piece", "for the camera boards"),
        Bought("Screw M4 x 12", 2, "piece", "bracket of the rail"),
        Bought("Glue", 1, "piece", "cyanoacrylate or epoxy, for magnets and balls; acrylic cement for the light boxes"),
    ]  # fmt: skip
    if dowels:
        found.append(Bought("Dowel pin", dowels, "piece", "3 x 16 mm, ISO 8734: joints of the beams"))
    return found


def _roll(layout: Layout) -> list[Bought]:
    encoder = layout.parameters.encoder
    return [
        Bought("Rotary encoder", 1, "piece", f"incremental, {encoder.pulses} pulses a turn, channels A and B, 5 V, "
               f"body {encoder.body_mm:g} mm, boss {encoder.boss_mm:g} mm, shaft {encoder.shaft_mm:g} mm with a flat, "
               f"three M3 holes on {encoder.bolt_circle_mm:g} mm (as LPD3806-{encoder.pulses}BM; measure yours)"),
        Bought("Arduino Nano", 1, "piece", "ATmega328P, 5 V, 16 MHz, or a clone; 45 x 18 mm"),
        Bought("Resistor", 2, "piece", "4.7 kOhm: only for an open-collector encoder"),
        Bought("USB cable", 1, "piece", "data cable for the Nano"),
        Bought("Linear rail with carriage", 1, "piece", f"MGN12 of {RAIL_LENGTH_MM:.0f} mm, carriage MGN12H"),
        Bought("Tension spring", 1, "piece", "about 30 mm long, 5 mm wide, 0.1 to 0.2 N/mm: takes the gears' play out"),
        Bought("Screw M4 x 20 with lock nut", 1, "piece", "the encoder plate's pivot"),
        Bought("Screw M3 x 12", 24, "piece", "ISO 4762: rail, carriage, caps, encoder, holder"),
        Bought("Grub screw M3 x 5", 1, "piece", "encoder gear"),
    ]  # fmt: skip


def sheet_list(layout: Layout) -> tuple[Bought, ...]:
    """Return the sheets to order, by material and thickness, with their parts' area."""
    areas: dict[tuple[str, float], float] = {}
    for each in panels(layout):
        key = (each.material, each.thickness_mm)
        areas[key] = areas.get(key, 0.0) + each.quantity * each.area_mm2 * 1e-6
    return tuple(
        Bought(f"Sheet, {thick:g} mm", round(area, 3), "m2", material) for (material, thick), area in areas.items()
    )


__all__ = [
    "DENSITY_G_CM3",
    "NOT_DRAWN",
    "Bought",
    "front_strip_m",
    "sheet_list",
    "shopping_list",
    "strip_m",
    "strip_rows",
    "supply_watt",
]
