"""The pictures of poses can be drawn for every rig, and show what they should."""

from dataclasses import replace

import cv2
import numpy as np

from cathxr.calibration.poses import calibrate_poses
from cathxr.calibration.poses_drawing import error_map_png, residuals_png
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import Rig
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.twin import true_rig


def picture(png: bytes) -> np.ndarray:
    pixels = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert pixels is not None
    return pixels


def seen(rig: Rig, camera: str, off_px: float = 0.0) -> Sighting:
    model = CameraModel.of(rig.cameras[camera])
    rng = np.random.default_rng(0)
    found = [
        FoundMarker(each.name, each.colour, model.project(each.position_mm[None])[0] + 0.1 * rng.normal(size=2), 0.1)
        for group in rig.markers.values()
        for each in group
    ]
    found[2] = replace(found[2], centre_px=found[2].centre_px + off_px)
    return Sighting(camera, rig.cameras[camera].size_px, tuple(found))


def test_the_error_of_a_rig_without_stated_errors_can_be_drawn() -> None:
    pixels = picture(error_map_png(example_rig()))
    assert pixels.shape[1] > 2 * pixels.shape[0] > 800
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 30  # the colours of a map, not an empty frame


def test_residuals_of_one_camera_or_both_with_one_left_out_can_be_drawn() -> None:
    truth = true_rig(example_rig(), 1)
    both = calibrate_poses(example_rig(), [seen(truth, "top", 5.0), seen(truth, "front")], date="2026-01-31")
    one = calibrate_poses(example_rig(), [seen(truth, "front")], date="2026-01-31")
    wide, narrow = picture(residuals_png(both)), picture(residuals_png(one))
    assert wide.shape[1] == 2 * narrow.shape[1]
    red = (wide[..., 2] > 180) & (wide[..., 1] < 80) & (wide[..., 0] < 80)
    assert red.any()
    assert not ((narrow[..., 2] > 180) & (narrow[..., 1] < 80) & (narrow[..., 0] < 80)).any()


def test_exact_residuals_can_be_drawn() -> None:
    truth = true_rig(example_rig(), 1)
    model = CameraModel.of(truth.cameras["top"])
    found = tuple(
        FoundMarker(each.name, each.colour, model.project(each.position_mm[None])[0], 1e-6)
        for each in truth.markers["top"]
    )
    result = calibrate_poses(example_rig(), [Sighting("top", (1280, 720), found)], date="2026-01-31")
    assert picture(residuals_png(result)).size
    assert picture(error_map_png(result.rig)).size
