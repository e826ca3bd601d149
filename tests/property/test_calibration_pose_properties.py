"""Poses from exact pixels are exact wherever the cameras are, and turn with the box."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cathxr.calibration.poses import calibrate_poses
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import CalibrationError, Pose, Rig
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import perturbed, vector_from_pose
from cathxr.storage.rig_file import example_rig

CORNERS = ["T", "F", "TF"]
small = st.floats(-1.0, 1.0)


def sighting(rig: Rig, camera: str, names: str, noise: np.ndarray | None = None) -> Sighting:
    model = CameraModel.of(rig.cameras[camera])
    seen = [each for group in rig.markers.values() for each in group if each.name[1] in names]
    pixels = model.project(np.stack([each.position_mm for each in seen]))
    pixels = pixels if noise is None else pixels + noise[: len(seen)]
    found = tuple(FoundMarker(each.name, each.colour, at, 0.1) for each, at in zip(seen, pixels, strict=True))
    return Sighting(camera, rig.cameras[camera].size_px, found)


@st.composite
def placed(draw: st.DrawFn) -> Rig:
    """The example rig with a camera moved by up to 40 mm and 17 degrees about each axis: well off any drawing."""
    rig = example_rig()
    cameras = dict(rig.cameras)
    for name, camera in cameras.items():
        step = np.array([draw(small) for _ in range(6)]) * [0.15, 0.15, 0.3, 40.0, 40.0, 40.0]
        cameras[name] = replace(camera, camera_from_box=perturbed(camera.camera_from_box, step))
    return replace(rig, cameras=cameras)


@given(placed(), st.sampled_from(CORNERS))
@settings(max_examples=25)
def test_exact_pixels_give_the_exact_pose(truth: Rig, names: str) -> None:
    result = calibrate_poses(example_rig(), [sighting(truth, name, names) for name in truth.cameras], date="")
    for name, camera in truth.cameras.items():
        off = result.rig.cameras[name].camera_from_box @ camera.camera_from_box.inverse()
        # Rounding of pixels (1e-12 with the conditioning of four fiducials) times mm for each px.
        np.testing.assert_allclose(vector_from_pose(off), 0.0, atol=1e-8)


def turned(rig: Rig, box_from_old: Pose) -> Rig:
    """The same box described in another frame: fiducials and cameras move with it, the ROI must stay where it is."""
    cameras = {
        name: replace(each, camera_from_box=each.camera_from_box @ box_from_old.inverse())
        for name, each in rig.cameras.items()
    }
    markers = {
        name: tuple(replace(each, position_mm=box_from_old.apply(each.position_mm)) for each in group)
        for name, group in rig.markers.items()
    }
    return replace(rig, cameras=cameras, markers=markers)


@given(st.integers(0, 10**6), st.lists(small, min_size=6, max_size=6), st.sampled_from(CORNERS))
@settings(max_examples=15)
def test_poses_turn_with_the_box(seed: int, step: list[float], names: str) -> None:
    noise = np.random.default_rng(seed).normal(scale=0.1, size=(8, 2))
    # Small enough to leave each camera on its side of the box.
    box_from_old = perturbed(Pose.identity(), np.array(step) * [0.2, 0.2, 0.2, 5.0, 5.0, 5.0])
    rig = example_rig()
    seen = [sighting(rig, name, names, noise) for name in rig.cameras]
    here = calibrate_poses(rig, seen, date="")
    there = calibrate_poses(turned(rig, box_from_old), seen, date="")
    for name in rig.cameras:
        off = there.rig.cameras[name].camera_from_box @ box_from_old @ here.rig.cameras[name].camera_from_box.inverse()
        # Both stop where a step is below 1e-12 rad and 1e-9 mm, near the same least-squares pose.
        np.testing.assert_allclose(vector_from_pose(off), 0.0, atol=1e-6)
        ours, theirs = (each.rig.cameras[name].pose_provenance.covariance for each in (here, there))
        assert ours is not None
        assert theirs is not None
        # Turning is the same about a camera's own axes wherever the box's origin is; translation's error is not.
        np.testing.assert_allclose(theirs[:3, :3], ours[:3, :3], rtol=1e-4, atol=1e-12)
        assert there.rms_px[name] - here.rms_px[name] < 1e-6


@given(st.lists(st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)), min_size=4, max_size=8))
@settings(max_examples=40)
def test_any_pixels_give_a_pose_or_a_sentence(places: list[tuple[float, float]]) -> None:
    rig = example_rig()
    names = [each for group in rig.markers.values() for each in group][: len(places)]
    found = tuple(
        FoundMarker(each.name, each.colour, np.array(at), 0.1) for each, at in zip(names, places, strict=True)
    )
    try:
        result = calibrate_poses(rig, [Sighting("top", (1280, 720), found)], date="")
    except CalibrationError:
        return
    covariance = result.rig.cameras["top"].pose_provenance.covariance
    assert covariance is not None
    assert np.linalg.eigvalsh(covariance).min() > 0
