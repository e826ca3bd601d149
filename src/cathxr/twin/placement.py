"""Where the simulated box's cameras really are: near the drawing, never on it."""

import dataclasses
import zlib

import numpy as np

from cathxr.core import Rig, RigCamera
from cathxr.geometry.pose import perturbed

SHIFT_MM = 3.0
"""Greatest displacement of a camera along each axis."""
TURN_DEG = (1.2, 1.2, 2.5)
"""Greatest turn about the camera's x, y and z (its optical axis). Small enough to keep the ROI in view."""


def true_rig(nominal: Rig, seed: int) -> Rig:
    """Return `nominal` with every camera moved off its place by a few mm and degrees, by seed. All else is the same."""
    cameras = {name: _moved(camera, seed) for name, camera in nominal.cameras.items()}
    return dataclasses.replace(nominal, cameras=cameras)


def with_readout(rig: Rig, readout_ms: float) -> Rig:
    """Return a rig that states both cameras' readout, ms, as their data sheet would: 0 for global shutters."""
    seconds = 1e-3 * readout_ms
    return dataclasses.replace(
        rig, timing=dataclasses.replace(rig.timing, top_readout_s=seconds, front_readout_s=seconds)
    )


def _moved(camera: RigCamera, seed: int) -> RigCamera:
    rng = np.random.default_rng([seed, zlib.crc32(camera.name.encode())])
    turn = np.deg2rad(rng.uniform(-1.0, 1.0, size=3) * TURN_DEG)
    shift = rng.uniform(-SHIFT_MM, SHIFT_MM, size=3)
    # The turn is about the camera's own centre: rotate in the camera frame after cancelling what that moves.
    box_from_camera = camera.camera_from_box.inverse()
    moved = perturbed(box_from_camera.inverse(), np.concatenate([turn, np.zeros(3)]))
    centre = box_from_camera.translation_mm + shift
    camera_from_box = dataclasses.replace(moved, translation_mm=-moved.rotation @ centre)
    return dataclasses.replace(camera, camera_from_box=camera_from_box)
