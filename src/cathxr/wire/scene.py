"""What does not change while the server runs: frames and units in words, and the scene description."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from cathxr.core import Pose, Rig, RigCamera
from cathxr.wire.messages import (
    PROTOCOL,
    CameraDescription,
    HeartDescription,
    PoseDescription,
    SceneDescription,
    TargetDescription,
    TwinDescription,
)

FRAMES: Mapping[str, str] = MappingProxyType(
    {
        "box": "Right-handed, mm. Origin at the centre of the inlet; +x insertion; +z up, towards the top camera; "
        "the front camera is on the -y side.",
        "tip": "Right-handed, mm. Origin at the most distal point of the rounded end; z along the tangent, distally; "
        "x the beam direction.",
        "ct": "DICOM LPS of the heart's source, mm.",
        "camera_top": "OpenCV, mm: x right, y down, z forward.",
        "camera_front": "OpenCV, mm: x right, y down, z forward.",
        "image_top": "OpenCV, px: the centre of the first pixel is (0, 0); x right, y down.",
        "image_front": "OpenCV, px: the centre of the first pixel is (0, 0); x right, y down.",
        "gltf": "heart.glb's own: metres, y up; (x, z, -y) / 1000 of ct.",
    }
)
"""Each frame's axes and origin, in words."""

UNITS: Mapping[str, str] = MappingProxyType(
    {"length": "mm", "angle": "rad", "time": "s", "latency_ms": "ms", "skew_ms": "ms", "picture": "px"}
)
"""The unit of each kind of quantity on the link."""


def scene_description(
    rig: Rig,
    source: str,
    *,
    heart: HeartDescription | None = None,
    targets: Sequence[TargetDescription] = (),
    twin: TwinDescription | None = None,
) -> SceneDescription:
    """Return the scene for a rig. `source`: what feeds the tracker (twin, cameras or replay)."""
    return SceneDescription(
        protocol=PROTOCOL,
        source=source,
        frames=dict(FRAMES),
        roi_min_mm=_vector3(rig.roi.min_mm.tolist()),
        roi_max_mm=_vector3(rig.roi.max_mm.tolist()),
        catheter_name=rig.catheter.name,
        catheter_diameter_mm=rig.catheter.diameter_mm,
        sector_deg=rig.catheter.sector_deg,
        cameras=[_camera_description(camera) for camera in rig.cameras.values()],
        heart=heart,
        targets=list(targets),
        twin=twin,
    )


def pose_description(pose: Pose) -> PoseDescription:
    """Return a pose as the scene writes it."""
    w, x, y, z = pose.rotation_wxyz.tolist()
    return PoseDescription(rotation_wxyz=(w, x, y, z), translation_mm=_vector3(pose.translation_mm.tolist()))


def _camera_description(camera: RigCamera) -> CameraDescription:
    intrinsics = camera.intrinsics
    k1, k2, p1, p2, k3 = intrinsics.distortion.tolist()
    (fx, fy), (cx, cy) = intrinsics.focal_px.tolist(), intrinsics.centre_px.tolist()
    return CameraDescription(
        name=camera.name,
        size_px=camera.size_px,
        rate_hz=camera.rate_hz,
        focal_px=(fx, fy),
        centre_px=(cx, cy),
        distortion=(k1, k2, p1, p2, k3),
        camera_from_box=pose_description(camera.camera_from_box),
    )


def _vector3(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z
