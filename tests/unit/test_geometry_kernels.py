"""The compiled curves against plain NumPy: even sampling, the tip's frame, medians, and sigma's table."""

import numpy as np
import pytest

from cathxr.core import FloatArray, Pose
from cathxr.geometry import arc_length, resampled, tangents, tip_pose, transported
from cathxr.geometry.calibration_error import camera_errors, point_covariance
from cathxr.geometry.calibration_table import CalibrationTable
from cathxr.geometry.camera import CameraModel
from cathxr.geometry.camera_kernels import project_row
from cathxr.geometry.curve_kernels import carry_on, quaternion_of
from cathxr.geometry.medians import median_of, smallest_but
from cathxr.geometry.pose import frame_from_tangent, quaternion_from_rotation_vector, turned_about_z
from cathxr.storage.rig_file import example_rig


def bent(count: int, seed: int) -> FloatArray:
    """Return a smooth curve (N, 3) mm with uneven steps, tip first."""
    rng = np.random.default_rng(seed)
    at = np.sort(rng.uniform(0.0, 1.0, count))[::-1]
    a, b = rng.uniform(1.0, 3.0, 2)
    return np.stack([70.0 * at, 20.0 * np.sin(a * at), 15.0 * np.cos(b * at)], axis=1)


def plain_resampled(points: FloatArray, count: int) -> FloatArray:
    along = arc_length(points)
    wanted = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, axis) for axis in points.T])


def plain_tip_pose(shape: FloatArray, zero: FloatArray, roll_rad: float) -> Pose:
    from_entry = np.ascontiguousarray(shape[::-1])
    along = tangents(from_entry)
    normals = transported(from_entry, along, zero)
    return Pose.from_matrix(turned_about_z(frame_from_tangent(along[-1], normals[-1]), roll_rad), shape[0])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("given", "count"), [(2, 2), (2, 7), (60, 50), (241, 50), (10, 200)])
def test_even_sampling_is_numpys_interpolation(given: int, count: int, seed: int) -> None:
    points = bent(given, seed)
    np.testing.assert_allclose(resampled(points, count), plain_resampled(points, count), atol=1e-9)


def test_coinciding_points_do_not_matter_to_even_sampling() -> None:
    points = np.repeat(bent(20, 0), 3, axis=0)
    np.testing.assert_allclose(resampled(points, 33), plain_resampled(bent(20, 0), 33), atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("count", [2, 3, 4, 50, 240])
def test_the_tips_frame_is_the_plain_one(count: int, seed: int) -> None:
    shape, zero = bent(count, seed), np.array([0.0, -1.0, 0.0])
    got, expected = tip_pose(shape, zero_direction=zero, roll_rad=0.7 * seed), plain_tip_pose(shape, zero, 0.7 * seed)
    np.testing.assert_allclose(got.rotation, expected.rotation, atol=1e-9)
    np.testing.assert_array_equal(got.translation_mm, shape[0])


@pytest.mark.parametrize("seed", range(20))
def test_quaternions_are_those_of_the_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    angle = rng.choice([0.01, 1.0, np.pi - 1e-3])
    matrix = Pose(quaternion_from_rotation_vector(angle * axis / np.linalg.norm(axis)), np.zeros(3)).rotation
    got = np.empty(4)
    quaternion_of(matrix, got)
    np.testing.assert_allclose(got, Pose.from_matrix(matrix, np.zeros(3)).rotation_wxyz, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3, 10, 37, 220])
def test_medians_and_order_are_numpys(count: int) -> None:
    rng = np.random.default_rng(count)
    for values in (rng.normal(size=count), rng.integers(0, 3, count).astype(np.float64)):
        assert median_of(values.copy(), count) == np.median(values)
        wanted = count // 3
        assert smallest_but(values.copy(), count, wanted) == np.sort(values)[wanted]
    assert median_of(np.empty(0), 0) == 0.0


def test_a_curve_is_carried_on_but_not_too_far() -> None:
    last, before, got = bent(30, 1), bent(30, 1) - np.array([0.0, 2.0, 0.0]), np.empty((30, 3))
    carry_on(last, before, 1.5, 8.0, got)
    np.testing.assert_allclose(got, last + np.array([0.0, 3.0, 0.0]), atol=1e-12)
    carry_on(last, before, 10.0, 8.0, got)
    np.testing.assert_allclose(got, last + np.array([0.0, 8.0, 0.0]), atol=1e-12)


def test_the_cameras_numbers_project_as_the_model() -> None:
    model = CameraModel.of(example_rig().cameras["front"])
    for point in bent(20, 3):
        u, v, by_u, by_v, depth = project_row(*point, model.numbers)
        pixels, jacobian = model.project_with_jacobian(point[None])
        np.testing.assert_allclose([u, v], pixels[0], atol=1e-9)
        np.testing.assert_allclose([by_u, by_v], jacobian[0], atol=1e-9)
        assert depth == pytest.approx(model.to_camera(point)[2])


def test_the_table_of_sigma_is_what_it_stands_for() -> None:
    rig = example_rig()
    errors = list(camera_errors(rig).values())
    table = CalibrationTable(errors, rig.roi)
    rng = np.random.default_rng(0)
    inside = rng.uniform(rig.roi.min_mm, rig.roi.max_mm, (200, 3))
    beyond = np.array([[150.0, 0.0, 0.0], [60.0, -90.0, 10.0]])
    for point in np.concatenate([inside, beyond, rig.roi.corners_mm]):
        exact = float(np.sqrt(np.trace(point_covariance(errors, point))))
        # what bends within 6 mm: far below what sigma itself is known to
        assert table.sigma_mm(point) == pytest.approx(exact, rel=0.03)
