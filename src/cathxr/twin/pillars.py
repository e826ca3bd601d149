"""The removable crosses with their fiducial balls, and what makes fiducials hard to find: look-alikes and fingers.

Each ball is centred at its marker's position. The arms that carry a cross's balls lie on the side away from that
cross's own camera, well behind the balls, so that with both crosses in each camera sees all eight balls whole.
"""

import numpy as np

from cathxr.core import ConfigError, FloatArray, Marker, Rig
from cathxr.geometry import CameraModel
from cathxr.twin.settings import Colour, TwinSettings
from cathxr.twin.things import StaticScene

MARKER_RADIUS_MM = 3.0
ARM_GAP_MM = 5.0
"""From the plane of the balls' centres to the arms: a camera may stand this much off its place and hide no ball."""
_ARM_WIDTH_MM, _ARM_THICK_MM, _ARM_BEYOND_MM = 10.0, 3.0, 6.0
_STEM_HALF_MM = 0.8
_ARM_COLOUR: Colour = (0.045, 0.045, 0.045)
_SKIN: Colour = (0.42, 0.52, 0.74)
_FINGER_RADIUS_MM, _FINGER_LONG_MM, _FINGER_STEP_MM = 8.0, 70.0, 3.5
_CLUTTER_CLEAR_PX, _CLUTTER_SPREAD_MM, _CLUTTER_TRIES = 6.0, 15.0, 400
_COLOURS: dict[str, Colour] = {
    "red": (0.10, 0.10, 0.85),
    "green": (0.18, 0.70, 0.12),
    "blue": (0.85, 0.28, 0.08),
    "yellow": (0.08, 0.85, 0.90),
    "orange": (0.05, 0.45, 0.90),
    "magenta": (0.70, 0.10, 0.85),
    "cyan": (0.85, 0.75, 0.10),
    "white": (0.88, 0.88, 0.88),
    "black": (0.03, 0.03, 0.03),
}


def with_pillars(scene: StaticScene, rig: Rig, settings: TwinSettings, *, seed: int) -> StaticScene:
    """Return the scene with the crosses that the settings ask for, and the fingers and look-alikes beside them.

    Raises:
        ConfigError: the rig has no markers, or none of a cross that is asked for, or of a colour the twin does not
            know; a marker to hide is not there; no place is left for the look-alikes.
    """
    wanted = ("top", "front") if settings.pillars == "both" else (settings.pillars,)
    crosses = {name: rig.markers[name] for name in wanted if rig.markers.get(name)}
    if not crosses:
        raise ConfigError(
            f"The rig {rig.name!r} has no [markers] for {settings.pillars!r}, so its twin has no such pillars: "
            "leave them out."
        )
    for name, markers in crosses.items():
        scene = _with_cross(scene, markers, rig.cameras[name].camera_from_box.inverse().translation_mm)
    for hidden in settings.occluded_markers:
        scene = _with_finger(scene, crosses, hidden, rig, share=settings.occlusion_share)
    present = [marker for markers in crosses.values() for marker in markers]
    return _with_look_alikes(scene, rig, present, count=settings.coloured_clutter, seed=seed)


def _with_cross(scene: StaticScene, markers: tuple[Marker, ...], camera_box: FloatArray) -> StaticScene:
    """Return the scene with crossed arms behind the markers' plane, seen from the camera, and the balls before them."""
    places = np.stack([marker.position_mm for marker in markers])
    middle, normal = _plane(places, camera_box)
    for marker in markers:
        along = marker.position_mm - middle
        length = float(np.linalg.norm(along))
        along = along / max(length, 1e-9)
        axes = np.column_stack([along, np.cross(normal, along), normal])
        half = 0.5 * np.array([length + _ARM_BEYOND_MM, _ARM_WIDTH_MM, _ARM_THICK_MM])
        centre = middle + along * half[0] - normal * (ARM_GAP_MM + half[2])
        scene = scene.with_box(centre, axes, half, _ARM_COLOUR)
        # The stem only touches the ball: one that entered it would cut into the outline that the other camera sees.
        stem = np.array([_STEM_HALF_MM, _STEM_HALF_MM, 0.5 * (ARM_GAP_MM - MARKER_RADIUS_MM)])
        scene = scene.with_box(marker.position_mm - normal * (ARM_GAP_MM - stem[2]), axes, stem, _ARM_COLOUR)
        scene = scene.with_ball(marker.position_mm, MARKER_RADIUS_MM, _paint(marker))
    return scene


def _plane(places: FloatArray, camera_box: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the middle (3,) of markers (N, 3) and the normal (3,) of their plane, towards the camera."""
    middle = places.mean(axis=0)
    normal = np.linalg.svd(places - middle)[2][2] if len(places) > 2 else camera_box - middle
    normal = normal / np.linalg.norm(normal)
    return middle, -normal if normal @ (camera_box - middle) < 0 else normal


def _paint(marker: Marker) -> Colour:
    if marker.colour not in _COLOURS:
        known = ", ".join(_COLOURS)
        raise ConfigError(f"Marker {marker.name} has the colour {marker.colour!r}; the twin can paint {known}.")
    return _COLOURS[marker.colour]


def _with_finger(
    scene: StaticScene, crosses: dict[str, tuple[Marker, ...]], hidden: str, rig: Rig, *, share: float
) -> StaticScene:
    """Return the scene with a finger at a marker, from outside the cross.

    share 1: its tip is around the marker, which no camera sees. Less: the tip is before the marker and hides that share
    of its diameter from the cross's own camera.
    """
    found = [(name, each) for name, markers in crosses.items() for each in markers if each.name == hidden]
    if not found:
        there = ", ".join(marker.name for markers in crosses.values() for marker in markers)
        raise ConfigError(f"There is no marker {hidden!r} to hide in the twin's box; there are {there}.")
    camera, marker = found[0]
    camera_box = rig.cameras[camera].camera_from_box.inverse().translation_mm
    middle, _ = _plane(np.stack([each.position_mm for each in crosses[camera]]), camera_box)
    outward = (marker.position_mm - middle) / np.linalg.norm(marker.position_mm - middle)
    tip = marker.position_mm
    if share < 1.0:
        # Along the line of sight nothing shifts in the picture, but everything grows by what it comes nearer.
        sight = camera_box - marker.position_mm
        near = (_FINGER_RADIUS_MM + MARKER_RADIUS_MM + 1.0) / float(np.linalg.norm(sight))
        outward = outward - (outward @ sight) / (sight @ sight) * sight
        outward = outward / np.linalg.norm(outward)
        aside = (1.0 - 2.0 * share) * MARKER_RADIUS_MM * (1.0 - near) + _FINGER_RADIUS_MM
        tip = marker.position_mm + near * sight + aside * outward
    for along in np.arange(0.0, _FINGER_LONG_MM, _FINGER_STEP_MM):
        scene = scene.with_ball(tip + along * outward, _FINGER_RADIUS_MM, _SKIN)
    return scene


def _with_look_alikes(scene: StaticScene, rig: Rig, markers: list[Marker], *, count: int, seed: int) -> StaticScene:
    """Return the scene with `count` small balls and blocks of the markers' colours, clear of the markers in any view.

    Raises:
        ConfigError: so many do not find a place.
    """
    rng = np.random.default_rng([seed, 0xC1077E4])
    models = [CameraModel.of(camera) for camera in rig.cameras.values()]
    places = np.stack([marker.position_mm for marker in markers])
    placed = 0
    for _ in range(_CLUTTER_TRIES * (count > 0)):
        if placed == count:
            break
        at = rng.uniform(rig.roi.min_mm - _CLUTTER_SPREAD_MM, rig.roi.max_mm + _CLUTTER_SPREAD_MM)
        radius = rng.uniform(1.2, 4.5)
        paint = _paint(markers[int(rng.integers(len(markers)))])
        if not all(_clear(model, at, radius, places) for model in models):
            continue
        placed += 1
        if rng.uniform() < 0.5:
            scene = scene.with_ball(at, radius, paint)
        else:
            axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            half = np.maximum(rng.uniform(0.4, 1.0, size=3) * radius / np.sqrt(3.0), 0.4)
            scene = scene.with_box(at, axes, half, paint)
    if placed < count:
        raise ConfigError(f"The twin found no place for {count} coloured things beside the markers: ask for fewer.")
    return scene


def _clear(model: CameraModel, at: FloatArray, radius_mm: float, markers: FloatArray) -> bool:
    """Return whether a thing is in the picture and does not come near any of the markers (N, 3) there."""
    focal = float(model.intrinsics.focal_px.mean())
    everything = np.vstack([at, markers])
    pixels = model.project(everything)
    radii = focal * np.concatenate([[radius_mm], np.full(len(markers), MARKER_RADIUS_MM)])
    radii = radii / model.to_camera(everything)[:, 2]
    off = np.linalg.norm(pixels[1:] - pixels[0], axis=1) - radii[1:] - radii[0]
    return bool(model.inside(pixels[:1]).all() and (off > _CLUTTER_CLEAR_PX).all())
