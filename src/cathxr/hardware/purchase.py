"""What is bought, by specification: whatever meets it will do. Quantities follow from the parameters."""

from dataclasses import dataclass

import numpy as np

from cathxr.hardware.layout import RAIL_LENGTH_MM, Layout
from cathxr.hardware.panels import panels
from cathxr.hardware.screws import joints, screw_lines

DENSITY_G_CM3 = {"printed": 1.27, "soft": 1.21, "cut": 1.19}
"""PETG, TPU and PMMA, as their makers state them."""


@dataclass(frozen=True)
class Bought:
    """One line of the shopping list. mass_g: about, of one unit; None where made parts bear it, or it is nothing."""

    item: str
    quantity: float
    unit: str
    specification: str
    mass_g: float | None = None


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
    "washers", "magnets", "the encoder gear's grub screw", "dowel pins of beams in pieces", "glue", "cable ties",
    "cables and their plugs", "supply and dimmers", "resistors",
)  # fmt: skip
"""What is bought and does not stand in the assembly."""
_STEEL, _NEODYMIUM, _PLASTIC = 7.85e-3, 7.5e-3, 1.2e-3
"""g/mm3, as usual tables have them."""


def _optics(layout: Layout) -> list[Bought]:
    camera = layout.parameters.camera
    sensor = f"{camera.width_px * camera.pixel_um / 1000:.2f} x {camera.height_px * camera.pixel_um / 1000:.2f} mm used"
    return [
        Bought("Camera", 2, "piece", f"USB, global shutter, colour, at least {camera.width_px} x {camera.height_px} at "
               f"{camera.rate_hz:g} pictures/s, pixels of {camera.pixel_um:g} um ({sensor}), manual exposure and gain, "
               f"board {camera.board_mm:g} x {camera.board_mm:g} mm with M2 holes {camera.board_hole_mm:g} mm apart, "
               "S-mount (M12); each on a USB port of its own", 22.0),
        Bought("Lens", 2, "piece", f"M12 x 0.5, {camera.focal_mm:g} mm, f/{camera.f_number:g} or slower, made for the "
               f"sensor's size, with a locking ring, at most {camera.lens_mm:g} mm across", 6.0),
        Bought("USB cable", 2, "piece", "for the cameras, at most 3 m, screened", 90.0),
    ]  # fmt: skip


def _light(layout: Layout) -> list[Bought]:
    light = layout.parameters.light
    back, front = 2.0 * strip_m(layout), front_strip_m(layout)
    return [
        Bought("LED strip, back light", round(back, 2), "m", "24 V, white 5000 to 6500 K, CRI 90, "
               f"{light.watt_per_m:g} W/m, at least 120 LEDs/m; {strip_rows(layout)} rows of "
               f"{2.0 * layout.inner_mm:.0f} mm, {light.pitch_mm:g} mm apart, on each LED plate", 25.0),
        Bought("LED strip, front light", round(front, 2), "m", "the same, around the windows inside both masks: 8 of "
               f"{2.0 * layout.window_half_mm:.0f} mm; on a switch of its own", 25.0),
        Bought("Power supply", 1, "piece", f"24 V DC, at least {supply_watt(layout):.0f} W, CE marked, "
               "with a barrel connector", 400.0),
        Bought("LED dimmer", 2, "piece", "24 V, constant current or PWM above 20 kHz: a slower one makes pictures "
               "flicker; one for the back, one for the front light", 40.0),
        Bought("Wire", 6, "m", "two cores of 0.5 mm2, from supply to dimmers and strips", 25.0),
    ]  # fmt: skip


def _frame(layout: Layout) -> list[Bought]:
    parameters = layout.parameters
    size, magnet = parameters.frame.rod_mm, parameters.magnet
    face = 6 * 4
    jig = 4
    dowels = 12 * (layout.segments - 1)
    # A thread's area is that of its pitch circle, 0.62 of the square of its size for M4 to M12.
    per_mm = 0.62 * size**2 * _STEEL
    found = [
        Bought(f"Threaded rod M{size:g}", 8, "piece", f"{layout.long_rod_mm:.0f} mm long, steel, zinc plated",
               layout.long_rod_mm * per_mm),
        Bought(f"Threaded rod M{size:g}", 4, "piece", f"{layout.short_rod_mm:.0f} mm long, steel, zinc plated",
               layout.short_rod_mm * per_mm),
        Bought(f"Nut M{size:g} with washer", 8 * 4 + 4 * 2, "piece", "ISO 4032 and ISO 7089", 3.5 * (size / 6.0) ** 3),
        Bought("Magnet", 2 * face + 2 * jig + 6, "piece", f"neodymium N42, {magnet.diameter_mm:g} x "
               f"{magnet.height_mm:g} mm: {face} in beams, {face} in panels, {2 * jig} for the jig, 6 for one inlet; "
               "3 more for each further inlet", _rod_g(magnet.diameter_mm, magnet.height_mm, _NEODYMIUM)),
        Bought("Ball", 8, "piece", "6.0 mm, plastic, matt, two each of red, green, blue, yellow, drilled 1.5 mm to the "
               "middle", np.pi / 6.0 * 6.0**3 * _PLASTIC),
        Bought("Dowel pin", 8, "piece", "1.5 x 8 mm, ISO 8734", _rod_g(1.5, 8.0, _STEEL)),
        Bought("Pressure spring", 6, "piece", "5 mm wide, inside at least 3.2, 12 mm long, about 1 N/mm: between "
               "camera plate and carrier", 0.4),
        Bought("Glue", 1, "piece", "cyanoacrylate or epoxy, for magnets and balls; acrylic cement for the light boxes"),
        Bought("Cable tie", 6, "piece", "2.5 x 100 mm: two for each camera's cable, two for the Nano", 0.3),
        *_screws(layout),
    ]  # fmt: skip
    if dowels:
        found.append(Bought("Dowel pin", dowels, "piece", "3 x 16 mm, ISO 8734: joints of the beams",
                            _rod_g(3.0, 16.0, _STEEL)))  # fmt: skip
    return found


def _screws(layout: Layout) -> list[Bought]:
    """Return every screw and nut below the rods' size, with where they go."""
    found = []
    for name, pieces, where in screw_lines(joints(layout).values()):
        kind, _, size = name.partition(" M")
        if kind == "Screw":
            across, long = (float(each) for each in size.split(" x "))
            mass = _rod_g(1.83 * across, across, _STEEL) + _rod_g(0.87 * across, long, _STEEL)
            norm = "ISO 4762"
        else:
            mass = 0.0141 * float(size) ** 3 * (1.6 if kind == "Lock nut" else 1.0)
            norm = "ISO 10511" if kind == "Lock nut" else "ISO 4032"
        found.append(Bought(name, pieces, "piece", f"{norm}: {where}", mass))
    return found


def _roll(layout: Layout) -> list[Bought]:
    encoder = layout.parameters.encoder
    return [
        Bought("Rotary encoder", 1, "piece", f"incremental, {encoder.pulses} pulses a turn, channels A and B, 5 V, "
               f"body {encoder.body_mm:g} mm, boss {encoder.boss_mm:g} mm, shaft {encoder.shaft_mm:g} mm with a flat, "
               f"three M3 holes on {encoder.bolt_circle_mm:g} mm (as LPD3806-{encoder.pulses}BM; measure yours)",
               180.0),
        Bought("Arduino Nano", 1, "piece", "ATmega328P, 5 V, 16 MHz, or a clone; 45 x 18 mm", 7.0),
        Bought("Resistor", 2, "piece", "4.7 kOhm: only for an open-collector encoder", 0.2),
        Bought("USB cable", 1, "piece", "data cable for the Nano", 40.0),
        # 0.65 kg/m of rail and 54 g of carriage, as makers state for this size.
        Bought("Linear rail with carriage", 1, "piece", f"MGN12 of {RAIL_LENGTH_MM:.0f} mm, carriage MGN12H",
               0.65 * RAIL_LENGTH_MM + 54.0),
        Bought("Tension spring", 1, "piece", "about 30 mm between its hooks, 5 mm wide, 0.1 to 0.2 N/mm: takes the "
               "gears' play out", 1.0),
        Bought("Grub screw M3 x 5", 1, "piece", "ISO 4026: encoder gear", 0.2),
    ]  # fmt: skip


def _rod_g(diameter_mm: float, length_mm: float, g_mm3: float) -> float:
    return float(np.pi / 4.0 * diameter_mm**2 * length_mm * g_mm3)


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
