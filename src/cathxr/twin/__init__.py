"""The digital twin: a simulated vision box with two cameras and an encoder, and the exact truth about it."""

from cathxr.twin.kinematics import Controls
from cathxr.twin.placement import true_rig, with_readout
from cathxr.twin.render import CameraRenderer
from cathxr.twin.scenes import SCENES, scene
from cathxr.twin.settings import TwinSettings
from cathxr.twin.world import CatheterState, TwinWorld

__all__ = [
    "SCENES",
    "CameraRenderer",
    "CatheterState",
    "Controls",
    "TwinSettings",
    "TwinWorld",
    "scene",
    "true_rig",
    "with_readout",
]
