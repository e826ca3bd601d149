"""Pose algebra, the camera model, triangulation and curves. Pure functions of their arguments."""

from cathxr.geometry.camera import CameraModel
from cathxr.geometry.curves import arc_length, resampled, tangents, tip_pose, transported
from cathxr.geometry.triangulation import Triangulation, nearest_to_rays, triangulate

__all__ = [
    "CameraModel",
    "Triangulation",
    "arc_length",
    "nearest_to_rays",
    "resampled",
    "tangents",
    "tip_pose",
    "transported",
    "triangulate",
]
