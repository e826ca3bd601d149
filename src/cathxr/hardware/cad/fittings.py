"""Bought small parts that are drawn: nuts on the rods, and the LED strips of the light boxes."""

from collections.abc import Iterator

import numpy as np

from cathxr.hardware.cad.frame import STEEL, face_columns
from cathxr.hardware.cad.part import BOUGHT, Part, Place
from cathxr.hardware.cad.shapes import block, cut, prism, rod
from cathxr.hardware.fits import STRIP_ASIDE_MM, STRIP_HIGH_MM, STRIP_WIDE_MM
from cathxr.hardware.layout import Layout
from cathxr.hardware.purchase import strip_rows

_YELLOW = (0.98, 0.9, 0.45)


def fitting_places(layout: Layout) -> Iterator[Place]:
    """Yield every nut of the frame's rods, and every row of LEDs."""
    yield from _nuts(layout)
    yield from _strips(layout)
    yield from _front_strips(layout)


def _nuts(layout: Layout) -> Iterator[Place]:
    size, plate = layout.parameters.frame.rod_mm, layout.parameters.panel.plate_mm
    height, flats = 0.8 * size, 1.65 * size
    angle = np.deg2rad(30.0 + 60.0 * np.arange(6))
    outline = flats / np.sqrt(3.0) * np.column_stack([np.cos(angle), np.sin(angle)])
    solid = cut(prism(outline, height), [rod((0.0, 0.0, -1.0), "z", height + 2.0, size + 0.1)])
    nut = Part("nut", f"Nut M{size:g}", BOUGHT, solid, STEEL)
    for axis, sign in (("z", 1.0), ("y", -1.0), ("x", 1.0)):
        columns = face_columns(axis, sign)
        low = -layout.outer_mm if axis == "x" else -(layout.led_mm + plate)
        levels = [low - height, layout.outer_mm]
        if axis != "x":
            levels += [layout.camera_panel_mm - height, layout.camera_panel_mm + plate]
        for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            aside = u * layout.rod_out_mm * columns[:, 0] + v * layout.rod_in_mm * columns[:, 1]
            for level in levels:
                yield Place(nut, layout.centre + aside + level * columns[:, 2], columns, group="nuts")


def _strips(layout: Layout) -> Iterator[Place]:
    wide, high = STRIP_WIDE_MM, STRIP_HIGH_MM
    half, pitch = layout.inner_mm, layout.parameters.light.pitch_mm
    rows = strip_rows(layout)
    strip = Part(
        "led_strip", "Row of LEDs", BOUGHT, block((-half, -0.5 * wide, 0.0), (half, 0.5 * wide, high)), _YELLOW
    )
    for axis, sign in (("z", -1.0), ("y", 1.0)):
        columns = face_columns(axis, sign)
        for row in range(rows):
            aside = (row - 0.5 * (rows - 1)) * pitch * columns[:, 1]
            origin = layout.centre + aside + (layout.led_mm - high) * columns[:, 2]
            yield Place(strip, origin, columns, group="light")


def _front_strips(layout: Layout) -> Iterator[Place]:
    """Yield the strips of the front light: around the masks' windows, on their inner faces."""
    half = layout.window_half_mm
    low = half + STRIP_ASIDE_MM
    solid = block((-half, low, -STRIP_HIGH_MM), (half, low + STRIP_WIDE_MM, 0.0))
    strip = Part("front_strip", "Row of LEDs, front light", BOUGHT, solid, _YELLOW)
    for axis, sign in (("z", 1.0), ("y", -1.0)):
        columns = face_columns(axis, sign)
        for turn in range(4):
            cosine, sine = np.cos(0.5 * np.pi * turn), np.sin(0.5 * np.pi * turn)
            about = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
            yield Place(strip, layout.centre + layout.ledge_mm * columns[:, 2], columns @ about, group="front_light")
