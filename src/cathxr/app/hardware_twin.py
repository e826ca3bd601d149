"""What the twin's cameras see of a rig as designed: its nominal rig, with the frame's solids put into the scene."""

import dataclasses

import numpy as np

from cathxr.core import FloatArray, PixelArray
from cathxr.geometry import CameraModel
from cathxr.hardware.layout import Layout
from cathxr.hardware.nominal import nominal_rig
from cathxr.twin.lens import ray_table
from cathxr.twin.scenes import scene
from cathxr.twin.settings import TwinSettings
from cathxr.twin.static_picture import static_picture
from cathxr.twin.static_scene import static_scene
from cathxr.twin.things import StaticScene

_BLACK = (0.05, 0.05, 0.05)


def with_frame(base: StaticScene, layout: Layout) -> StaticScene:
    """Return a scene with the frame's beams, the masks' windows and the dark panels: what is seen round the ROI."""
    # Seen from inside, the beams end at the ledge, where the diffuser and the masks lie.
    inner, outer = layout.inner_mm, layout.ledge_mm
    thick = 0.5 * (outer - inner)
    for axis in range(3):
        others = [each for each in range(3) if each != axis]
        for first in (-1.0, 1.0):
            for second in (-1.0, 1.0):
                centre = layout.centre.copy()
                centre[others[0]] += first * (inner + thick)
                centre[others[1]] += second * (inner + thick)
                half = np.full(3, thick)
                half[axis] = outer
                base = base.with_box(centre, np.eye(3), half, _BLACK)
    for normal, sign in ((2, 1.0), (1, -1.0)):
        base = _with_window(base, layout, normal, sign)
    for sign in (-1.0, 1.0):
        half = np.array([1.5, inner, inner])
        aside = np.array([sign * (layout.ledge_mm + 1.5), 0.0, 0.0])
        base = base.with_box(layout.centre + aside, np.eye(3), half, _BLACK)
    return base


def _with_window(base: StaticScene, layout: Layout, normal: int, sign: float) -> StaticScene:
    """Return the scene with a mask as four strips around its window."""
    window, edge = layout.window_half_mm, layout.outer_mm
    strip = 0.5 * (edge - window)
    for axis in (each for each in range(3) if each != normal):
        for side in (-1.0, 1.0):
            centre, half = layout.centre.copy(), np.full(3, edge)
            centre[normal] += sign * (layout.ledge_mm + 1.5)
            centre[axis] += side * (window + strip)
            half[normal], half[axis] = 1.5, strip
            base = base.with_box(centre, np.eye(3), half, _BLACK)
    return base


def static_view(layout: Layout, camera: str, settings: TwinSettings, *, frame: bool = True) -> FloatArray:
    """Return (H, W, 3) the light of what never moves, DN, as one camera of the nominal rig sees it."""
    rig = nominal_rig(layout)
    model = CameraModel.of(rig.cameras[camera])
    base = static_scene(rig, settings)
    level = static_picture(model, ray_table(model), with_frame(base, layout) if frame else base, settings, seed=0).level
    return np.asarray(level, dtype=np.float64)


def twin_pictures(layout: Layout) -> dict[str, PixelArray]:
    """Return pictures (H, W, 3) BGR by name: the empty box and both crosses, from both cameras."""
    found: dict[str, PixelArray] = {}
    lit = scene("empty")
    crosses = dataclasses.replace(scene("pillars"), back_light=0.45)
    for camera in ("top", "front"):
        found[f"twin_{camera}_empty"] = np.clip(static_view(layout, camera, lit), 0, 255).astype(np.uint8)
        found[f"twin_{camera}_crosses"] = np.clip(static_view(layout, camera, crosses), 0, 255).astype(np.uint8)
    return found
