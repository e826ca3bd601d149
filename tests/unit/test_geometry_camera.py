"""The camera model against OpenCV, against a plain NumPy twin, and against the architecture's own words."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from cathxr.core import Intrinsics, Pose, RigCamera
from cathxr.geometry import CameraModel
from cathxr.geometry.camera import distort, distortion_jacobian, undistort
from cathxr.geometry.pose import pose_from_vector, vector_from_pose

ALL_FIVE = np.array([-0.21, 0.09, 0.0021, -0.0034, -0.02])
LENSES = {
    "none": np.zeros(5),
    "k1": np.array([-0.18, 0.0, 0.0, 0.0, 0.0]),
    "k2": np.array([0.0, 0.2, 0.0, 0.0, 0.0]),
    "p1": np.array([0.0, 0.0, 0.004, 0.0, 0.0]),
    "p2": np.array([0.0, 0.0, 0.0, -0.003, 0.0]),
    "k3": np.array([0.0, 0.0, 0.0, 0.0, -0.1]),
    "all": ALL_FIVE,
    "published 1": np.array([0.0608, -0.4297, 0.00017, 0.0019, 0.776]),
    "published 2": np.array([0.0241, -0.1165, 0.00296, -0.00425, 0.0]),
}
# The architecture's nominal poses.
TOP_FROM_BOX = Pose(np.array([0.0, 1.0, 0.0, 0.0]), np.array([-60.0, 0.0, 330.0]))
FRONT_FROM_BOX = Pose(np.array([0.70710678, 0.70710678, 0.0, 0.0]), np.array([-60.0, 0.0, 330.0]))
SOMEWHERE = pose_from_vector(np.array([2.9, 0.2, -0.15, -55.0, 7.0, 310.0]))


def camera(distortion: np.ndarray, camera_from_box: Pose = SOMEWHERE) -> CameraModel:
    """Return a 1280x720 camera with unequal focal lengths and its centre off the picture's middle."""
    return CameraModel(
        Intrinsics(np.array([1357.7, 1341.2]), np.array([651.3, 348.9]), distortion), camera_from_box, (1280, 720)
    )


def box_points(count: int, seed: int = 0) -> np.ndarray:
    """Return points (N, 3) of the region of interest, mm."""
    return np.random.default_rng(seed).uniform([0.0, -60.0, -60.0], [120.0, 60.0, 60.0], (count, 3))


@pytest.mark.parametrize("name", LENSES)
def test_projection_is_opencvs(name: str) -> None:
    model = camera(LENSES[name])
    points = box_points(200)
    vector = vector_from_pose(model.camera_from_box)
    expected, _ = cv2.projectPoints(
        points, vector[:3], vector[3:], model.intrinsics.matrix, model.intrinsics.distortion
    )
    # Both are the same formula; rounding of about a thousand px leaves 1e-11 px.
    np.testing.assert_allclose(model.project(points), expected[:, 0], atol=1e-9)


@pytest.mark.parametrize("name", LENSES)
def test_the_compiled_projection_is_the_plain_one(name: str) -> None:
    model = camera(LENSES[name])
    points = box_points(50)
    pixels, jacobian = model.project_with_jacobian(points)
    np.testing.assert_allclose(pixels, model.project(points), atol=1e-9)
    rotation = model.camera_from_box.rotation
    for point, got in zip(points, jacobian, strict=True):  # the chain rule, written out point by point
        x, y, z = rotation @ point + model.camera_from_box.translation_mm
        by_camera = np.array([[1.0 / z, 0.0, -x / z**2], [0.0, 1.0 / z, -y / z**2]])
        by_ideal = distortion_jacobian(np.array([x / z, y / z]), model.intrinsics.distortion)
        expected = np.diag(model.intrinsics.focal_px) @ by_ideal @ by_camera @ rotation
        np.testing.assert_allclose(got, expected, atol=1e-11)


@pytest.mark.parametrize("name", LENSES)
def test_the_derivative_is_the_central_difference(name: str) -> None:
    model = camera(LENSES[name])
    points = box_points(50)
    _, jacobian = model.project_with_jacobian(points)
    step = 1e-3  # mm: third-order term (px/mm^3 under 1e-3) times step^2 is 1e-9; rounding 1e-12 / 1e-3 is 1e-9
    for axis in range(3):
        move = step * np.eye(3)[axis]
        difference = (model.project(points + move) - model.project(points - move)) / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, :, axis], difference, atol=1e-7)


@pytest.mark.parametrize("name", LENSES)
def test_the_distortions_derivative_is_the_central_difference(name: str) -> None:
    ideal = np.random.default_rng(1).uniform(-0.5, 0.5, (40, 2))
    jacobian = distortion_jacobian(ideal, LENSES[name])
    step = 1e-5  # third derivatives under 100: 1e-10 x 100; rounding 1e-16 / 1e-5
    for axis in range(2):
        move = step * np.eye(2)[axis]
        difference = (distort(ideal + move, LENSES[name]) - distort(ideal - move, LENSES[name])) / (2.0 * step)
        np.testing.assert_allclose(jacobian[..., axis], difference, atol=1e-8)


@pytest.mark.parametrize("name", LENSES)
def test_the_compiled_inverse_is_opencvs(name: str) -> None:
    # OpenCV's own fixed-point iteration, run to its end, is an independent inverse.
    pixels = np.random.default_rng(2).uniform([0.0, 0.0], [1279.0, 719.0], (100, 2))
    model = camera(LENSES[name])
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 500, 1e-14)
    # OpenCV 4 has a name of its own for the form that takes the stop rule.
    undo = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)
    lens = model.intrinsics
    expected = undo(pixels[:, None], lens.matrix, lens.distortion, R=np.eye(3), P=np.eye(3), criteria=criteria)[:, 0]
    np.testing.assert_allclose(model.undistort(pixels), expected, atol=1e-9)


def test_pixel_zero_is_the_first_pixels_centre() -> None:
    model = CameraModel(
        Intrinsics(np.array([100.0, 100.0]), np.array([31.5, 23.5])), Pose.identity(), (64, 48)
    )  # the picture's middle lies between its middle pixels
    np.testing.assert_array_equal(model.project(np.array([0.0, 0.0, 10.0])), [31.5, 23.5])
    np.testing.assert_allclose(model.project(np.array([-3.15, -2.35, 10.0])), [0.0, 0.0], atol=1e-12)
    inside = model.inside(np.array([[0.0, 0.0], [63.0, 47.0], [-0.1, 0.0], [63.1, 47.0], [0.0, 47.1]]))
    np.testing.assert_array_equal(inside, [True, True, False, False, False])
    with_margin = model.inside(np.array([[2.0, 2.0], [61.0, 45.0], [1.9, 2.0], [61.1, 45.0]]), margin_px=2.0)
    np.testing.assert_array_equal(with_margin, [True, True, False, False])


def test_the_top_camera_sees_x_to_the_right_and_y_up() -> None:
    model = camera(np.zeros(5), TOP_FROM_BOX)
    np.testing.assert_allclose(model.centre_box, [60.0, 0.0, 330.0], atol=1e-12)
    middle = model.project(np.array([60.0, 0.0, 0.0]))
    np.testing.assert_allclose(middle, model.intrinsics.centre_px, atol=1e-9)  # it looks straight down
    along_x, along_y = (model.project(np.array([60.0, 0.0, 0.0]) + 10.0 * np.eye(3)[axis]) - middle for axis in (0, 1))
    assert along_x[0] > 1.0
    assert abs(along_x[1]) < 1e-9
    assert along_y[1] < -1.0  # rows count downwards
    assert abs(along_y[0]) < 1e-9
    nearer = model.project(np.array([70.0, 0.0, 50.0])) - middle
    assert nearer[0] > along_x[0]  # +z is towards the camera


def test_the_front_camera_sees_x_to_the_right_and_z_up() -> None:
    model = camera(np.zeros(5), FRONT_FROM_BOX)
    np.testing.assert_allclose(model.centre_box, [60.0, -330.0, 0.0], atol=1e-5)  # eight written digits of the pose
    middle = model.project(np.array([60.0, 0.0, 0.0]))
    along_x, along_z = (model.project(np.array([60.0, 0.0, 0.0]) + 10.0 * np.eye(3)[axis]) - middle for axis in (0, 2))
    assert along_x[0] > 1.0
    assert abs(along_x[1]) < 1e-5
    assert along_z[1] < -1.0
    assert abs(along_z[0]) < 1e-5
    nearer = model.project(np.array([70.0, -50.0, 0.0])) - middle
    assert nearer[0] > along_x[0]  # -y is towards the camera


@pytest.mark.parametrize("shape", [(3,), (1, 3), (5, 3), (2, 4, 3), (0, 3)])
def test_any_shape_of_points_goes_there_and_back(shape: tuple[int, ...]) -> None:
    model = camera(ALL_FIVE)
    points = box_points(8)[: max(1, int(np.prod(shape[:-1])))].reshape(-1, 3)[: int(np.prod(shape[:-1]))].reshape(shape)
    pixels = model.project(points)
    assert pixels.shape == (*shape[:-1], 2)
    assert model.to_camera(points).shape == shape
    assert model.undistort(pixels).shape == pixels.shape
    assert model.ray(pixels).shape == shape
    assert model.inside(pixels).shape == shape[:-1]
    flat = model.project(points.reshape(-1, 3))
    np.testing.assert_array_equal(pixels.reshape(-1, 2), flat)


@pytest.mark.parametrize("depth", [0.0, -1e-9, -100.0])
def test_points_behind_the_camera_are_refused(depth: float) -> None:
    model = camera(ALL_FIVE, Pose.identity())
    points = np.array([[0.0, 0.0, 100.0], [1.0, 1.0, depth]])
    with pytest.raises(ValueError, match="in front of the camera"):
        model.project(points)
    with pytest.raises(ValueError, match="in front of the camera"):
        model.project_with_jacobian(points)


@pytest.mark.parametrize("shape", [(3,), (4, 2), (2, 4, 3), (4, 4)])
def test_the_compiled_projection_refuses_other_shapes(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"points_box: expected shape \(N, 3\)"):
        camera(ALL_FIVE).project_with_jacobian(np.ones(shape))


# (coefficients, what folds): each turns back at a radius where no useful lens is used any more. The last one turns
# back and then forth again, so that pixels beyond the first fold have an image only on a far sheet.
FOLDING = [
    np.array([-0.35, 0.0, 0.0, 0.0, 0.0]),
    np.array([0.0, -0.3, 0.0, 0.0, 0.0]),
    np.array([0.0, 0.0, 0.0, 0.0, -0.2]),
    np.array([0.0241, -0.1165, 0.0, 0.0, 0.0]),
    np.array([-0.35, 0.15, 0.0, 0.0, -0.03]),
    np.array([-0.7, 0.2, 0.0, 0.0, 0.0]),
]


@pytest.mark.parametrize("coefficients", FOLDING, ids=str)
def test_pixels_beyond_the_fold_are_refused(coefficients: np.ndarray) -> None:
    k1, k2, _, _, k3 = coefficients
    roots = np.roots([7.0 * k3, 5.0 * k2, 3.0 * k1, 1.0])  # of the slope of r (1 + k1 r^2 + ...), by r^2
    fold = np.sqrt(min(each.real for each in roots if abs(each.imag) < 1e-12 and each.real > 0))
    reached = float(distort(np.array([fold, 0.0]), coefficients)[0])
    for angle in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
        direction = np.array([np.cos(angle), np.sin(angle)])
        near = 0.98 * fold * direction
        np.testing.assert_allclose(undistort(distort(near, coefficients), coefficients), near, atol=1e-9)
        for beyond in (1.001, 1.1, 1.5, 2.0, 2.5, 4.0):
            with pytest.raises(ValueError, match="cannot be undone"):
                undistort(beyond * reached * direction, coefficients)


def test_one_pixel_beyond_the_fold_is_enough() -> None:
    coefficients = FOLDING[0]
    with pytest.raises(ValueError, match="cannot be undone"):
        undistort(np.array([[0.1, 0.0], [0.9, 0.0], [0.1, 0.1]]), coefficients)


def test_a_rigs_camera_gives_its_model() -> None:
    lens = Intrinsics(np.array([10.0, 10.0]), np.array([20.0, 20.0]))
    model = CameraModel.of(RigCamera("top", (64, 48), 30.0, lens, SOMEWHERE))
    assert model.size_px == (64, 48)
    assert model.intrinsics is lens
    assert model.camera_from_box is SOMEWHERE
    assert replace(model, size_px=(32, 24)).size_px == (32, 24)
