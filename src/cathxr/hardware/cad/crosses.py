"""The two removable crosses with their fiducials. Own frame: x, then q in the plane, then n towards the camera."""

from collections.abc import Iterator

import build123d as b
import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.frame import BLACK, GREY, STEEL
from cathxr.hardware.cad.part import BOUGHT, CALIBRATION, PRINTED, Part, Place
from cathxr.hardware.cad.screws import screw_places
from cathxr.hardware.cad.shapes import Solid, ball, block, cut, joined, prism, rod
from cathxr.hardware.layout import (
    ARM_BEYOND_MM,
    ARM_GAP_MM,
    ARM_THICK_MM,
    ARM_WIDTH_MM,
    COLOURS,
    MARKER_RADIUS_MM,
    NOTCH_MM,
    Layout,
)
from cathxr.hardware.screws import joints

_HUB_MM = 44.0
_PIN_MM = 1.5
_SCREWS_MM = (13.0, 20.0)
"""From an arm's end to the screws of its leg."""
_SLOT_PLAY_MM = 0.2
_PAINTS = {"red": (0.85, 0.1, 0.1), "green": (0.12, 0.7, 0.18), "blue": (0.08, 0.28, 0.85), "yellow": (0.9, 0.85, 0.08)}
_LEG_OVERLAP_MM = 26.0
_BACK = ARM_GAP_MM + ARM_THICK_MM
_AXES = {
    "top": np.eye(3),
    "front": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
"""Columns x, q, n of each cross in `box`."""


def cross_places(layout: Layout) -> Iterator[Place]:
    """Yield both crosses with legs, balls and pins."""
    leg = Part("cross_leg", "Leg of a cross", PRINTED, _leg(layout), BLACK)
    pin = Part("pin", f"Dowel pin {_PIN_MM:g} x {_BACK:g}", BOUGHT, rod((0, 0, -_BACK), "z", _BACK, _PIN_MM), STEEL)
    balls = {
        colour: Part(f"ball_{colour}", f"Ball of {2 * MARKER_RADIUS_MM:g} mm, {colour}, drilled {_PIN_MM:g}", BOUGHT,
                     ball((0.0, 0.0, 0.0), MARKER_RADIUS_MM), _PAINTS[colour])
        for colour in COLOURS
    }  # fmt: skip
    held = joints(layout)["leg"]
    for name, axes in _AXES.items():
        core = Part(f"cross_{name}", f"Cross of the {name} camera", PRINTED, _core(layout, name), GREY)
        yield Place(core, layout.centre, axes, setup=CALIBRATION, group="cross")
        for place, colour in zip(layout.marker_places[name], COLOURS, strict=True):
            yield Place(balls[colour], place, axes, setup=CALIBRATION, group="cross")
            yield Place(pin, place, axes, setup=CALIBRATION, group="cross")
        for angle in (45.0, 135.0, 225.0, 315.0):
            own = axes @ _about_n(angle)
            yield Place(leg, layout.centre, own, setup=CALIBRATION, group="cross")
            heads = [(layout.arm_reach_mm - back, 0.0, -_BACK - ARM_THICK_MM) for back in _SCREWS_MM]
            heads_box = layout.centre + np.array(heads) @ own.T
            yield from screw_places(held, heads_box, own[:, 2], setup=CALIBRATION, group="cross")


def _about_n(angle_deg: float) -> FloatArray:
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _core(layout: Layout, name: str) -> Solid:
    """Return the one-piece middle: four arms and a hub, slotted half across so that the other cross passes."""
    reach, half = layout.arm_reach_mm, 0.5 * ARM_WIDTH_MM
    arms = [
        b.Rot(0.0, 0.0, angle) * block((-reach, -half, -_BACK), (reach, half, -ARM_GAP_MM)) for angle in (45.0, 135.0)
    ]
    body = joined(arms[0], arms[1], rod((0.0, 0.0, -_BACK), "z", ARM_THICK_MM, _HUB_MM))
    tools = []
    for angle in (45.0, 135.0, 225.0, 315.0):
        turn = b.Rot(0.0, 0.0, angle)
        tools.append(turn * rod((reach - ARM_BEYOND_MM, 0.0, -_BACK - 1.0), "z", ARM_THICK_MM + 2.0, _PIN_MM))
        for back in _SCREWS_MM:
            tools.append(turn * rod((reach - back, 0.0, -_BACK - 1.0), "z", ARM_THICK_MM + 2.0, 2.6))
    # The other cross's arms lie behind its balls too: at q = +5 to +8 for the top one, -8 to -5 for the front one.
    sign, side = (1.0, -1.0) if name == "top" else (-1.0, 1.0)
    low, high = sorted((sign * (ARM_GAP_MM - _SLOT_PLAY_MM), sign * (_BACK + _SLOT_PLAY_MM)))
    slot = sorted((side * _HUB_MM, -side * _SLOT_PLAY_MM))
    tools.append(block((slot[0], low, -_BACK - 1.0), (slot[1], high, -ARM_GAP_MM + 1.0)))
    return cut(body, tools)


def _leg(layout: Layout) -> Solid:
    """Return a leg along x: under an arm's end, into a beam's notch, with a slot by which it is drawn back."""
    half, reach = 0.5 * ARM_WIDTH_MM, layout.arm_reach_mm
    end = np.sqrt(2.0) * (layout.inner_mm + NOTCH_MM) - 0.2
    start = reach - _LEG_OVERLAP_MM - 8.0
    outline = np.array([[start, -half], [end - half, -half], [end, 0.0], [end - half, half], [start, half]])
    body = prism(outline, ARM_THICK_MM, base=-_BACK - ARM_THICK_MM)
    # Drawn back by 9 mm the leg is out of the notch: the screws at 13 and 20 mm slide along.
    first, last = reach - 20.0 - 1.7, reach - 13.0 + 9.0 + 1.7
    slot = block((first, -1.7, -_BACK - ARM_THICK_MM - 1.0), (last, 1.7, -_BACK + 1.0))
    return cut(body, [slot])
