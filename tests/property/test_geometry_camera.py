"""Projecting and undoing it, for each lens coefficient alone and for all together, over the whole picture."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cathxr.core import Intrinsics
from cathxr.geometry import CameraModel
from cathxr.geometry.camera import distort, distortion_jacobian, undistort
from cathxr.geometry.pose import pose_from_vector

# The picture's corner lies at most at r = 0.63 for the widest lens here (54 degrees across), still before every fold.
WIDTH, HEIGHT = 1280, 720
RANGES = {"k1": (-0.35, 0.35), "k2": (-0.43, 0.43), "p1": (-0.005, 0.005), "p2": (-0.005, 0.005), "k3": (-0.5, 0.8)}
NAMES = tuple(RANGES)
PUBLISHED = [
    [0.0608, -0.4297, 0.00017, 0.0019, 0.776],
    [0.0241, -0.1165, 0.00296, -0.00425, 0.0],
    [-0.35, 0.0, 0.0, 0.0, 0.0],
]
# Undistortion stops at an error of 1e-13 of the focal length; the lens magnifies that by at most about 1 / 0.3 here
# (`assume` below), and 1e-9 is far below anything a picture can show (1e-6 px).
EXACT = 1e-9

pictures = st.tuples(st.floats(0.0, WIDTH - 1.0), st.floats(0.0, HEIGHT - 1.0)).map(np.array)
focals = st.tuples(st.floats(1250.0, 3000.0), st.floats(1250.0, 3000.0)).map(np.array)
centres = st.tuples(st.floats(600.0, 680.0), st.floats(330.0, 390.0)).map(np.array)


@st.composite
def cameras(draw: st.DrawFn, distortion: st.SearchStrategy[list[float]]) -> CameraModel:
    """Return a camera somewhere about the box."""
    pose = draw(
        st.lists(st.floats(-np.pi, np.pi), min_size=3, max_size=3).map(
            lambda each: np.array([*each, -60.0, 5.0, 330.0])
        )
    )
    lens = Intrinsics(draw(focals), draw(centres), np.array(draw(distortion)))
    return CameraModel(lens, pose_from_vector(pose), (WIDTH, HEIGHT))


def one_coefficient(name: str) -> st.SearchStrategy[list[float]]:
    """Return coefficients that are 0 but for one."""
    index = NAMES.index(name)
    return st.floats(*RANGES[name]).map(lambda value: [value if each == index else 0.0 for each in range(5)])


every_coefficient = st.tuples(*(st.floats(*RANGES[name]) for name in NAMES)).map(list)


def least_stretch(ideal: np.ndarray, coefficients: np.ndarray) -> float:
    """Return the least singular value of the lens' derivative on the way from the centre to ideal points (N, 2)."""
    on_the_way = np.linspace(0.0, 1.0, 32)[:, None, None] * ideal
    return float(np.linalg.svd(distortion_jacobian(on_the_way, coefficients), compute_uv=False).min())


def corners(model: CameraModel) -> np.ndarray:
    """Return the ideal coordinates (4, 2) of the picture's corners, were there no distortion."""
    pixels = np.array([[0.0, 0.0], [WIDTH - 1.0, 0.0], [0.0, HEIGHT - 1.0], [WIDTH - 1.0, HEIGHT - 1.0]])
    return np.asarray((pixels - model.intrinsics.centre_px) / model.intrinsics.focal_px)


def check_there_and_back(model: CameraModel, pixel: np.ndarray) -> None:
    """Assert that a pixel's place without distortion is found again from where the lens puts it."""
    ideal = (pixel - model.intrinsics.centre_px) / model.intrinsics.focal_px
    np.testing.assert_allclose(model.undistort(model.pixels_from_normalised(ideal)), ideal, atol=EXACT)


def check_back_and_there(model: CameraModel, pixel: np.ndarray) -> None:
    """Assert that undoing the lens and doing it again gives the raw pixel."""
    back = model.pixels_from_normalised(model.undistort(pixel))
    np.testing.assert_allclose(back, pixel, atol=3000.0 * EXACT)


@pytest.mark.parametrize("name", NAMES)
@given(st.data())
def test_each_coefficient_alone_can_be_undone(name: str, data: st.DataObject) -> None:
    model = data.draw(cameras(one_coefficient(name)))
    pixel = data.draw(pictures)
    check_there_and_back(model, pixel)  # in these ranges no coefficient folds within the picture
    check_back_and_there(model, pixel)


@given(cameras(every_coefficient), pictures)
def test_all_coefficients_together_can_be_undone(model: CameraModel, pixel: np.ndarray) -> None:
    assume(least_stretch(corners(model), model.intrinsics.distortion) > 0.3)
    check_there_and_back(model, pixel)


@pytest.mark.parametrize("coefficients", PUBLISHED, ids=str)
@given(st.data())
def test_published_lenses_can_be_undone(coefficients: list[float], data: st.DataObject) -> None:
    model = data.draw(cameras(st.just(coefficients)))
    pixel = data.draw(pictures)
    check_there_and_back(model, pixel)
    check_back_and_there(model, pixel)


@given(every_coefficient, st.floats(0.0, 2.0 * np.pi), st.floats(0.0, 3.0))
def test_what_is_undone_lies_on_the_near_side(coefficients: list[float], angle: float, radius: float) -> None:
    lens = np.array(coefficients)
    distorted = radius * np.array([np.cos(angle), np.sin(angle)])
    try:
        ideal = undistort(distorted, lens)
    except ValueError:
        return  # refused: allowed here; the tests above say where it must not be
    np.testing.assert_allclose(distort(ideal, lens), distorted, atol=EXACT)
    # On the way from the middle the picture nowhere turns over by more than the tangential terms' own share.
    on_the_way = np.linspace(0.0, 1.0, 64)[:, None] * ideal
    k1, k2, p1, p2, k3 = lens
    squared = np.square(on_the_way).sum(axis=1)
    slope = 1.0 + squared * (3.0 * k1 + squared * (5.0 * k2 + squared * 7.0 * k3))
    assert (slope >= -6.0 * (abs(p1) + abs(p2)) * np.sqrt(squared) - 1e-9).all()
    assert np.linalg.det(distortion_jacobian(ideal, lens)) > 0


@given(cameras(every_coefficient), pictures, st.floats(50.0, 600.0))
def test_the_ray_through_a_points_picture_passes_through_the_point(
    model: CameraModel, pixel: np.ndarray, depth: float
) -> None:
    assume(least_stretch(corners(model), model.intrinsics.distortion) > 0.3)
    ideal = (pixel - model.intrinsics.centre_px) / model.intrinsics.focal_px
    point = model.camera_from_box.inverse().apply(depth * np.array([*ideal, 1.0]))
    direction = model.ray(model.project(point))
    np.testing.assert_allclose(np.linalg.norm(direction), 1.0, atol=1e-14)
    away = point - model.centre_box
    assert away @ direction > 0  # forwards
    np.testing.assert_allclose(np.cross(away, direction), 0.0, atol=1000.0 * EXACT)


@given(cameras(every_coefficient))
def test_the_centre_is_where_every_ray_begins(model: CameraModel) -> None:
    np.testing.assert_allclose(model.to_camera(model.centre_box), 0.0, atol=1e-10)
