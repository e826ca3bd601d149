"""What never moves in the box: the inlet block, the cross pillars with their fiducials, as boxes and discs."""

from dataclasses import dataclass, field

import numpy as np

from cathxr.core import ConfigError, FloatArray, Marker, Rig
from cathxr.twin.settings import Colour, TwinSettings

INLET_SIZE_MM = (40.0, 30.0, 30.0)
"""Length behind the entry plane, width, height of the inlet block."""
BORE_PLAY_MM = 0.35
MARKER_RADIUS_MM = 3.0
_ARM_WIDTH_MM, _ARM_THICK_MM, _ARM_BEYOND_MM = 10.0, 3.0, 6.0
_BLOCK_COLOUR: Colour = (0.10, 0.10, 0.11)
_WALL_SIZE_MM = (4.0, 260.0, 260.0)
_WALL_COLOUR: Colour = (0.16, 0.16, 0.15)
_BORE_COLOUR: Colour = (0.02, 0.02, 0.02)
_ARM_COLOUR: Colour = (0.06, 0.06, 0.06)
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


@dataclass(frozen=True, eq=False)
class StaticScene:
    """Opaque things in `box`, mm.

    box_centre (B, 3), box_axes (B, 3, 3) columns, box_half (B, 3), box_colour (B, 3); disc_centre (D, 3), disc_normal
    (D, 3), disc_radius (D,), disc_colour (D, 3). Discs lie on faces and are seen from either side.
    """

    box_centre: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    box_axes: FloatArray = field(default_factory=lambda: np.empty((0, 3, 3)))
    box_half: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    box_colour: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    disc_centre: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    disc_normal: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    disc_radius: FloatArray = field(default_factory=lambda: np.empty(0))
    disc_colour: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    def with_box(self, centre: FloatArray, axes: FloatArray, half: FloatArray, colour: Colour) -> "StaticScene":
        """Return the scene with one more block: axes (3, 3) columns, half its size (3,) along them."""
        return StaticScene(
            np.concatenate([self.box_centre, centre[None]]),
            np.concatenate([self.box_axes, axes[None]]),
            np.concatenate([self.box_half, half[None]]),
            np.concatenate([self.box_colour, np.array(colour)[None]]),
            self.disc_centre,
            self.disc_normal,
            self.disc_radius,
            self.disc_colour,
        )

    def with_disc(self, centre: FloatArray, normal: FloatArray, radius: float, colour: Colour) -> "StaticScene":
        """Return the scene with one more disc."""
        return StaticScene(
            self.box_centre,
            self.box_axes,
            self.box_half,
            self.box_colour,
            np.concatenate([self.disc_centre, centre[None]]),
            np.concatenate([self.disc_normal, normal[None]]),
            np.concatenate([self.disc_radius, [radius]]),
            np.concatenate([self.disc_colour, np.array(colour)[None]]),
        )


def static_scene(rig: Rig, settings: TwinSettings) -> StaticScene:
    """Return the blocks and discs of a rig's box.

    Raises:
        ConfigError: pillars are asked for and the rig has no markers, or markers of a colour the twin does not know.
    """
    scene = StaticScene()
    if settings.inlet:
        half = 0.5 * np.array(INLET_SIZE_MM)
        scene = scene.with_box(np.array([-half[0], 0.0, 0.0]), np.eye(3), half, _BLOCK_COLOUR)
        bore = 0.5 * (rig.catheter.diameter_mm + BORE_PLAY_MM)
        scene = scene.with_disc(np.zeros(3), np.array([1.0, 0.0, 0.0]), bore, _BORE_COLOUR)
    if settings.wall:
        half = 0.5 * np.array(_WALL_SIZE_MM)
        scene = scene.with_box(np.array([-INLET_SIZE_MM[0] - half[0], 0.0, 0.0]), np.eye(3), half, _WALL_COLOUR)
    if settings.pillars:
        if not any(rig.markers.values()):
            raise ConfigError(f"The rig {rig.name!r} has no [markers], so its twin has no pillars: leave them out.")
        for camera, markers in rig.markers.items():
            scene = _with_pillar(scene, markers, rig.cameras[camera].camera_from_box.inverse().translation_mm)
    return scene


def _with_pillar(scene: StaticScene, markers: tuple[Marker, ...], camera_box: FloatArray) -> StaticScene:
    """Return the scene with crossed arms behind the markers' plane, seen from the camera, and the markers on them."""
    if not markers:
        return scene
    places = np.stack([marker.position_mm for marker in markers])
    middle = places.mean(axis=0)
    normal = np.linalg.svd(places - middle)[2][2] if len(places) > 2 else camera_box - middle
    normal = normal / np.linalg.norm(normal)
    if normal @ (camera_box - middle) < 0:
        normal = -normal
    for place in places:
        along = place - middle
        length = float(np.linalg.norm(along))
        along = along / length
        axes = np.column_stack([along, np.cross(normal, along), normal])
        half = 0.5 * np.array([length + _ARM_BEYOND_MM, _ARM_WIDTH_MM, _ARM_THICK_MM])
        centre = middle + along * half[0] - normal * (half[2] + 1e-3)
        scene = scene.with_box(centre, axes, half, _ARM_COLOUR)
    for marker in markers:
        if marker.colour not in _COLOURS:
            known = ", ".join(_COLOURS)
            raise ConfigError(f"Marker {marker.name} has the colour {marker.colour!r}; the twin can paint {known}.")
        scene = scene.with_disc(marker.position_mm, normal, MARKER_RADIUS_MM, _COLOURS[marker.colour])
    return scene
