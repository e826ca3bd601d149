"""The rig as designed, in the twin: the frame's solids stand in its scene."""

import cv2
import numpy as np
import pytest

from cathxr.app.hardware_twin import static_view
from cathxr.calibration.marker_finding import find_markers
from cathxr.geometry import CameraModel
from cathxr.hardware.layout import Layout
from cathxr.hardware.nominal import nominal_rig
from cathxr.twin.scenes import scene
from cathxr.twin.settings import TwinSettings

_PLAIN = TwinSettings(catheter=False, vignetting=0.0, unevenness=0.0, inlet=False)


@pytest.mark.parametrize("camera", ["top", "front"])
def test_the_whole_roi_is_seen_before_the_light(default: Layout, camera: str) -> None:
    rig = nominal_rig(default)
    level = static_view(default, camera, _PLAIN).mean(axis=2)
    mask = np.zeros(level.shape, dtype=np.uint8)
    hull = cv2.convexHull(CameraModel.of(rig.cameras[camera]).project(rig.roi.corners_mm).astype(np.float32))
    cv2.fillConvexPoly(mask, np.rint(hull).astype(np.int32), 1)
    # A ring of 2 px is the lens's blur and the rounding of the outline.
    inside = level[cv2.erode(mask, np.ones((5, 5), np.uint8)) > 0]
    assert (inside > 0.8 * level.max()).all()
    assert (level < 0.3 * level.max()).mean() > 0.2, "the masks are not in the picture"


@pytest.mark.parametrize("camera", ["top", "front"])
def test_all_eight_fiducials_are_found_inside_the_frame(default: Layout, camera: str) -> None:
    rig = nominal_rig(default)
    pixels = np.clip(static_view(default, camera, scene("pillars")), 0, 255).astype(np.uint8)
    seen = find_markers(rig, camera, pixels)
    assert seen.problem is None
    assert len(seen.markers) == 8
    model = CameraModel.of(rig.cameras[camera])
    places = {marker.name: marker.position_mm for each in rig.markers.values() for marker in each}
    for each in seen.markers:
        # 0.02 px is what is found on clean pictures; shading by the lamp beside the lens adds to that.
        assert np.linalg.norm(each.centre_px - model.project(places[each.name])) < 0.3
