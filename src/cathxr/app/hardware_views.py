"""What the renders of the building manual show: the whole, taken apart, and one picture for each step of assembly."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.layout import Layout
from cathxr.hardware.render import Drawn

_ISO, _LOW, _NEAR, _BEHIND = (-0.62, -0.85, 0.55), (-0.75, -0.55, -0.45), (-0.5, -0.8, 0.75), (-0.45, 0.85, 0.7)
_APART: Mapping[str, tuple[float, float]] = {
    "inlet": (-110.0, 0.0), "roll": (-190.0, 0.0), "panels": (0.0, 75.0), "front_light": (0.0, 75.0),
    "light": (0.0, 75.0), "camera": (0.0, 40.0), "roll_spring": (-190.0, 0.0), "roll_screws": (-190.0, 0.0),
}  # fmt: skip
"""How far groups are moved in the exploded view: along x, and along the normal of the face that they belong to."""
_SHARES: Mapping[str, float] = {
    "led_plate": 2.0, "led_strip": 1.6, "light_wall": 1.25, "spacer": 1.25, "foot": 2.6, "camera_plate": 1.0,
    "camera_carrier": 2.0, "camera": 3.2, "tilt_spring": 1.5, "lock_nut_m3": 0.5, "screw_m3x25": 2.9, "screw_m2x6": 3.9,
}  # fmt: skip
_ROLL_APART: Mapping[str, tuple[float, float, float]] = {
    "catheter_gear": (0.0, 0.0, 62.0), "catheter_lock": (0.0, 0.0, 62.0), "bearing_cap": (0.0, 0.0, 125.0),
    "encoder_gear": (40.0, 75.0, 22.0), "encoder_plate": (0.0, 75.0, 22.0), "encoder": (-55.0, 75.0, 22.0),
    "nano_holder": (0.0, -60.0, 22.0), "rail": (0.0, 0.0, -40.0), "carriage": (0.0, 0.0, -18.0),
    "tension_spring": (60.0, 40.0, 135.0), "nano": (0.0, -60.0, 52.0),
    "rail_plate": (0.0, 0.0, -62.0), "rail_bracket": (40.0, 0.0, -85.0), "rail_leg": (-40.0, 0.0, -85.0),
}  # fmt: skip
_INLET_SHARES: Mapping[str, float] = {"screw": 1.3, "nut": 0.8}
_PALE, _LOCK_APART_MM = 0.86, 55.0


@dataclass(frozen=True)
class View:
    """One render. new: the groups that it is about, named and in colour; before: those that stand there already, pale.

    parts: only these of the new groups, all where empty; apart: the new ones are drawn apart; setup: "" or which one.
    side: "top": only what belongs to the upper camera; unnamed: new groups whose parts get no names; small: whether
    screws, nuts and springs get some.
    """

    name: str
    new: tuple[str, ...]
    before: tuple[str, ...] = ()
    eye: tuple[float, float, float] = _ISO
    apart: bool = False
    setup: str = ""
    parts: tuple[str, ...] = ()
    side: str = ""
    unnamed: tuple[str, ...] = ()
    small: bool = True


_UNNAMED = ("roll", "roll_spring", "roll_screws", "nuts", "front_light")
_ALL = ("frame", "rods", "panels", "light", "camera", "inlet", *_UNNAMED)
VIEWS: tuple[View, ...] = (
    View("assembly", _ALL, unnamed=_UNNAMED, small=False),
    View("exploded", _ALL, apart=True, unnamed=_UNNAMED, small=False),
    View("step_1_frame", ("frame", "rods"), apart=True),
    View("step_2_light_boxes", ("light",), ("frame", "rods"), _LOW, apart=True),
    View("step_3_panels", ("panels",), ("frame", "rods", "light"), apart=True),
    View(
        "step_3_front_light",
        ("panels", "front_light"),
        eye=(-0.6, -0.7, -0.75),
        side="top",
        parts=("mask", "front_strip"),
    ),
    View("step_4_cameras", ("camera",), ("frame", "rods", "light", "panels"), apart=True, small=False),
    View("step_4_camera_near", ("camera",), eye=_NEAR, apart=True, side="top"),
    View("step_5_inlet", ("inlet",), apart=True),
    View("step_6_crosses", ("cross",), ("frame",), setup="calibration"),
    View("step_7_roll_unit", ("roll", "roll_spring"), eye=_BEHIND, apart=True),
    View("step_7_roll_unit_together", ("roll", "roll_spring", "roll_screws"), eye=_BEHIND, unnamed=("roll",)),
    View("step_8_jig", ("jig", "panels"), eye=_NEAR, setup="jig", parts=("jig", "end_panel")),
    View("step_8_phantom", ("phantom", "inlet"), eye=(-0.75, -0.85, 0.8), setup="phantom"),
)


def bodies_of(view: View, rig: Any, meshes: Mapping[str, Any]) -> list[Drawn]:
    """Return the bodies of a view of a `Rig3d`; meshes: of its parts, by key."""
    places = [each for each in rig.within([view.setup] if view.setup else []) if _is_in(view, each)]
    named = Counter(each.part.title for each in places if each.group in view.new)
    bodies = []
    for each in places:
        is_new = each.group in view.new
        aside = _apart(view, rig.layout, each) if view.apart and is_new else np.zeros(3)
        triangles = meshes[each.part.key].moved(each.columns, each.origin + aside).triangles
        colour = each.part.colour if is_new else tuple(_PALE + 0.1 * part for part in each.part.colour)
        title = each.part.title
        is_named = is_new and each.group not in view.unnamed and (view.small or not _is_small(each.part.key))
        label = "" if not is_named else title if named[title] == 1 else f"{title} ({named[title]})"
        bodies.append(Drawn(triangles, colour, label))
    return bodies


def _is_small(key: str) -> bool:
    return key.startswith(("screw_", "nut_", "lock_nut_", "tilt_spring"))


def _is_in(view: View, place: Any) -> bool:
    if place.group not in (*view.new, *view.before):
        return False
    if view.side == "top" and abs(place.columns[2, 2]) < 0.5:
        return False
    return not view.parts or place.group not in view.new or place.part.key in view.parts


def _apart(view: View, layout: Layout, place: Any) -> FloatArray:
    """Return how far a place is moved in an exploded view."""
    low, high = place.solid().bounding_box().min, place.solid().bounding_box().max
    middle = 0.5 * (np.array(tuple(low)) + np.array(tuple(high))) - layout.centre
    if view.new == ("frame", "rods"):
        return np.asarray(_frame_apart(place, middle, layout))
    if view.new == ("roll", "roll_spring"):
        aside = np.array(_ROLL_APART.get(place.part.key, (0.0, 0.0, 0.0)))
        if place.part.key == "catheter_lock":  # one comes from each side
            aside[0] = -_LOCK_APART_MM * place.columns[0, 0]
        return np.asarray(aside, dtype=np.float64)
    if place.group not in _APART:
        return np.zeros(3)
    along_x, outwards = _APART[place.group]
    normal = place.columns[:, 2]
    # Walls lie beside a face: they go with the face that they stand on.
    if place.part.key == "light_wall":
        normal = place.columns[:, 1]
    away = np.sign(middle @ normal) * normal
    # An insert is drawn out of its holder, the holder's screws and nuts to both sides.
    if place.group == "inlet":
        along_x *= 1.6 if place.part.key.endswith("F") else _INLET_SHARES.get(place.part.key.split("_")[0], 1.0)
    share = _SHARES.get(place.part.key, 1.0)
    return np.asarray(np.array([along_x, 0.0, 0.0]) + share * outwards * away, dtype=np.float64)


def _frame_apart(place: Any, middle: FloatArray, layout: Layout) -> FloatArray:
    """Return how far a part of the frame is moved: beams away from the middle, corners farther, rods along."""
    signs = np.where(np.abs(middle) > 0.5 * layout.inner_mm, np.sign(middle), 0.0)
    if place.part.key.startswith("rod"):
        return np.asarray(230.0 * place.columns[:, 2] if place.part.key == "rod_long" else 130.0 * place.columns[:, 2])
    return np.asarray((38.0 if place.part.key.startswith("corner") else 24.0) * signs)
