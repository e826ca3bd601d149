"""What never moves in one rig's box: the inlet block, the end wall, the cross pillars with their fiducials."""

import numpy as np

from cathxr.core import Rig
from cathxr.twin.pillars import MARKER_RADIUS_MM, with_pillars
from cathxr.twin.settings import Colour, TwinSettings
from cathxr.twin.things import StaticScene

__all__ = ["BORE_PLAY_MM", "INLET_SIZE_MM", "MARKER_RADIUS_MM", "StaticScene", "static_scene"]

INLET_SIZE_MM = (40.0, 30.0, 30.0)
"""Length behind the entry plane, width, height of the inlet block."""
BORE_PLAY_MM = 0.35
_BLOCK_COLOUR: Colour = (0.10, 0.10, 0.11)
_WALL_SIZE_MM = (4.0, 260.0, 260.0)
_WALL_COLOUR: Colour = (0.16, 0.16, 0.15)
_BORE_COLOUR: Colour = (0.02, 0.02, 0.02)


def static_scene(rig: Rig, settings: TwinSettings, *, seed: int = 0) -> StaticScene:
    """Return the blocks, discs and balls of a rig's box.

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
    return with_pillars(scene, rig, settings, seed=seed) if settings.pillars != "none" else scene
