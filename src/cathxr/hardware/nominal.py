"""The rig as designed, for rig.toml: what the twin simulates and calibration starts from."""

import numpy as np

from cathxr.core import Catheter, Intrinsics, Marker, Pose, Provenance, Rig, RigCamera, Roi, Roll
from cathxr.hardware.gears import backlash_deg
from cathxr.hardware.layout import COLOURS, Layout

_TURNS = {
    "top": np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
    "front": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
"""From `box` to each camera's own axes: x right, y down, z forward."""


def nominal_rig(layout: Layout) -> Rig:
    """Return the rig as drawn: straight cameras, a lens without distortion, markers where the crosses carry them."""
    parameters = layout.parameters
    side = parameters.roi.side_mm
    cameras = {name: _camera(layout, name) for name in ("top", "front")}
    markers = {
        name: tuple(
            Marker(f"m{name[0].upper()}{index + 1}", place, colour)
            for index, (place, colour) in enumerate(zip(places, COLOURS, strict=True))
        )
        for name, places in layout.marker_places.items()
    }
    gear = parameters.gear
    roll = Roll(
        counts_per_turn=4.0 * parameters.encoder.pulses,
        gear_ratio=gear.catheter_teeth / gear.encoder_teeth,
        direction=-1,
        backlash_deg=round(backlash_deg(gear), 3),
        provenance=Provenance(method="drawing"),
    )
    return Rig(
        name=parameters.name,
        roi=Roi(np.array([0.0, -0.5 * side, -0.5 * side]), np.array([side, 0.5 * side, 0.5 * side])),
        catheter=Catheter(parameters.catheter.name, parameters.catheter.diameter_mm),
        cameras=cameras,
        markers=markers,
        roll=roll,
    )


def _camera(layout: Layout, name: str) -> RigCamera:
    camera = layout.parameters.camera
    turn = _TURNS[name]
    away = np.array([0.0, 0.0, 1.0]) if name == "top" else np.array([0.0, -1.0, 0.0])
    place = layout.centre + camera.distance_mm * away
    size = (camera.width_px, camera.height_px)
    return RigCamera(
        name=name,
        size_px=size,
        rate_hz=camera.rate_hz,
        intrinsics=Intrinsics(
            focal_px=np.full(2, layout.focal_px),
            centre_px=0.5 * (np.array(size, dtype=np.float64) - 1.0),
            provenance=Provenance(method="drawing"),
        ),
        camera_from_box=Pose.from_matrix(turn, -turn @ place),
        pose_provenance=Provenance(method="drawing"),
    )
