import dataclasses

import numpy as np
import pytest

from cathxr.core import ConfigError, Marker, Rig
from cathxr.geometry import CameraModel
from cathxr.geometry.fiducial_plane import FiducialPlane
from cathxr.storage.rig_file import example_rig


def with_markers(rig: Rig, camera: str, markers: tuple[Marker, ...]) -> Rig:
    return dataclasses.replace(rig, markers={**rig.markers, camera: markers})


@pytest.mark.parametrize(("camera", "axes"), [("top", (0, 1)), ("front", (0, 2))])
def test_markers_fall_on_their_places(camera: str, axes: tuple[int, int]) -> None:
    rig = example_rig()
    plane = FiducialPlane.of(rig, camera)
    positions = np.stack([each.position_mm for each in rig.markers[camera]])
    seen = CameraModel.of(rig.cameras[camera]).project(positions)
    # Float arithmetic of a 4-point homography over 120 mm.
    np.testing.assert_allclose(plane.to_plane(seen), positions[:, axes], atol=1e-8)


@pytest.mark.parametrize("camera", ["top", "front"])
def test_points_off_the_plane_look_larger_towards_the_camera(camera: str) -> None:
    """Intercept theorem: a point h above the plane appears magnified by d / (d - h) about the camera's foot."""
    rig = example_rig()
    plane = FiducialPlane.of(rig, camera)
    eye = CameraModel.of(rig.cameras[camera]).centre_box
    across = 3 - sum(plane.axes)
    foot = eye[list(plane.axes)]
    point = np.array([90.0, 30.0, 30.0])
    point[across] = 0.1 * eye[across]
    expected = foot + (point[list(plane.axes)] - foot) / 0.9
    np.testing.assert_allclose(plane.apparent(point), expected, atol=1e-7)


def test_without_markers_the_corners_of_the_roi_serve() -> None:
    rig = example_rig()
    bare = dataclasses.replace(rig, markers={})
    pixels = np.array([[600.0, 300.0], [700.0, 500.0]])
    # The example's markers lie exactly on the mid planes, so both ways give the same plane.
    np.testing.assert_allclose(
        FiducialPlane.of(bare, "top").to_plane(pixels), FiducialPlane.of(rig, "top").to_plane(pixels), atol=1e-8
    )


def test_too_few_markers_are_refused() -> None:
    rig = example_rig()
    with pytest.raises(ConfigError, match="needs four markers"):
        FiducialPlane.of(with_markers(rig, "top", rig.markers["top"][:3]), "top")


def test_markers_on_a_line_are_refused() -> None:
    line = tuple(Marker(f"m{i}", np.array([30.0 * i, 0.0, 0.0]), "red") for i in range(4))
    with pytest.raises(ConfigError, match="one line"):
        FiducialPlane.of(with_markers(example_rig(), "front", line), "front")


def test_markers_off_the_plane_are_refused() -> None:
    rig = example_rig()
    up = np.array([0.0, 0.0, 5.0])
    raised = tuple(dataclasses.replace(each, position_mm=each.position_mm + up) for each in rig.markers["top"])
    with pytest.raises(ConfigError, match="plane z = 0"):
        FiducialPlane.of(with_markers(rig, "top", raised), "top")
