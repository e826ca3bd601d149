"""Triangulation: exact without noise, honest about noise, and refusing what it cannot do."""

import numpy as np
import pytest
from scipy import stats

from cathxr.core import Intrinsics, Pose
from cathxr.geometry import CameraModel, Triangulation, nearest_to_rays, triangulate
from cathxr.geometry.pose import perturbed

LENS = Intrinsics(np.array([1357.7, 1357.7]), np.array([640.0, 360.0]), np.array([-0.18, 0.06, 0.001, -0.002, -0.01]))
TOP = Pose(np.array([0.0, 1.0, 0.0, 0.0]), np.array([-60.0, 0.0, 330.0]))
FRONT = Pose(np.array([0.70710678, 0.70710678, 0.0, 0.0]), np.array([-60.0, 0.0, 330.0]))
POSES = [
    TOP,
    FRONT,
    perturbed(TOP, np.array([0.5, 0.1, 0.2, 5.0, -3.0, 20.0])),
    perturbed(FRONT, np.array([0.0, -0.6, 0.1, 0.0, 5.0, 40.0])),
]
POINTS = np.random.default_rng(0).uniform([10.0, -30.0, -30.0], [110.0, 30.0, 30.0], (40, 3))


def rig(views: int) -> list[CameraModel]:
    """Return that many cameras."""
    return [CameraModel(LENS, each, (1280, 720)) for each in POSES[:views]]


def seen(cameras: list[CameraModel], points: np.ndarray) -> np.ndarray:
    """Return where the cameras see points (N, 3): (V, N, 2) px."""
    return np.stack([camera.project(points) for camera in cameras])


@pytest.mark.parametrize("views", [2, 3, 4])
def test_points_without_noise_come_back_exactly(views: int) -> None:
    cameras = rig(views)
    result = triangulate(cameras, seen(cameras, POINTS))
    # Undistortion ends at 1e-13 of the focal length, the steps at 1e-10 mm.
    np.testing.assert_allclose(result.points_box, POINTS, atol=1e-9)
    np.testing.assert_allclose(result.residual_px, 0.0, atol=1e-8)
    assert result.residual_px.shape == (views, len(POINTS), 2)
    assert result.covariance_mm2.shape == (len(POINTS), 3, 3)


@pytest.mark.parametrize("views", [2, 3, 4])
def test_the_covariance_is_the_inverse_information(views: int) -> None:
    cameras = rig(views)
    sigma = 0.3 + 0.1 * np.arange(views * len(POINTS)).reshape(views, len(POINTS)) / len(POINTS)
    result = triangulate(cameras, seen(cameras, POINTS), sigma_px=sigma)
    for i in (0, 17, 39):
        information = np.zeros((3, 3))
        for view, camera in enumerate(cameras):
            jacobian = camera.project_with_jacobian(POINTS[i : i + 1])[1][0]
            information += jacobian.T @ jacobian / sigma[view, i] ** 2
        np.testing.assert_allclose(result.covariance_mm2[i] @ information, np.eye(3), atol=1e-9)


@pytest.mark.parametrize("views", [2, 3])
def test_the_covariance_is_honest(views: int) -> None:
    cameras = rig(views)
    sigma = np.array([0.5, 0.2, 0.8])[:views]  # px, unequal so that the weights matter
    point, count = np.array([90.0, 20.0, -25.0]), 4000
    rng = np.random.default_rng(3)
    pixels = np.repeat(seen(cameras, point[None]), count, axis=1)
    noisy = pixels + rng.normal(size=pixels.shape) * sigma[:, None, None]
    result = triangulate(cameras, noisy, sigma_px=np.broadcast_to(sigma[:, None], (views, count)))
    errors = result.points_box - point
    # e^T C^-1 e is chi-square with 3 degrees of freedom for each point; their sum with 3 N. A right covariance fails
    # this by chance once in a million; 10 % too large or too small (N = 4000: 6 sigma) fails it always.
    distance = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(result.covariance_mm2), errors)
    low, high = stats.chi2.ppf([5e-7, 1.0 - 5e-7], 3 * count)
    assert low < distance.sum() < high
    # And in shape, not only in size: whitened errors have the identity as covariance; an entry of a sample covariance
    # has a standard deviation of at most sqrt(2 / N), and five of them is once in a million.
    white = errors @ np.linalg.cholesky(np.linalg.inv(result.covariance_mm2.mean(axis=0)))
    np.testing.assert_allclose(white.T @ white / count, np.eye(3), atol=5.0 * np.sqrt(2.0 / count))
    # No bias beyond that of a mean of N (5 standard deviations).
    assert (np.abs(white.mean(axis=0)) < 5.0 / np.sqrt(count)).all()
    # The residuals have 2 V - 3 degrees of freedom left.
    misfit = np.square(result.residual_px / sigma[:, None, None]).sum(axis=(0, 2))
    low, high = stats.chi2.ppf([5e-7, 1.0 - 5e-7], (2 * views - 3) * count)
    assert low < misfit.sum() < high


def test_a_view_that_is_known_badly_counts_little() -> None:
    cameras = rig(3)
    pixels = seen(cameras, POINTS)
    pixels[2] += 30.0  # the third view is wrong
    off = triangulate(cameras, pixels).points_box - POINTS
    sigma = np.ones((3, len(POINTS)))
    sigma[2] = 1e4
    believed = triangulate(cameras, pixels, sigma_px=sigma).points_box - POINTS
    assert np.linalg.norm(off, axis=1).min() > 0.5
    # Its share of the weight is about 1e-8: 30 px / 4 px per mm x 1e-8.
    assert np.linalg.norm(believed, axis=1).max() < 1e-6


def test_one_sigma_for_all_scales_the_covariance_only() -> None:
    cameras = rig(2)
    pixels = seen(cameras, POINTS) + np.random.default_rng(5).normal(size=(2, len(POINTS), 2))
    one, three = (triangulate(cameras, pixels, sigma_px=sigma) for sigma in (1.0, 3.0))
    np.testing.assert_allclose(three.points_box, one.points_box, atol=1e-9)
    np.testing.assert_allclose(three.covariance_mm2, 9.0 * one.covariance_mm2, rtol=1e-9)


def test_the_result_is_the_least_reprojection_error() -> None:
    cameras = rig(3)
    pixels = seen(cameras, POINTS) + np.random.default_rng(6).normal(scale=2.0, size=(3, len(POINTS), 2))
    result = triangulate(cameras, pixels)

    def cost(points: np.ndarray) -> np.ndarray:
        return np.asarray(np.square(pixels - seen(cameras, points)).sum(axis=(0, 2)))

    best = cost(result.points_box)
    np.testing.assert_allclose(best, np.square(result.residual_px).sum(axis=(0, 2)), rtol=1e-9)
    for step in 0.01 * np.vstack([np.eye(3), -np.eye(3)]):  # mm: the cost rises by step^2 x 2 views x (4 px/mm)^2
        assert (cost(result.points_box + step) > best).all()


def test_no_points_give_no_points() -> None:
    result = triangulate(rig(2), np.empty((2, 0, 2)))
    assert isinstance(result, Triangulation)
    assert result.points_box.shape == (0, 3)
    assert result.covariance_mm2.shape == (0, 3, 3)


@pytest.mark.parametrize("shape", [(2, 2), (2, 5, 3), (3, 5, 2), (1, 5, 2), (2, 5, 2, 1)])
def test_pixels_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"pixels: expected shape \(2, N, 2\)"):
        triangulate(rig(2), np.zeros(shape))


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_cameras_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match="at least two cameras"):
        triangulate(rig(count), np.zeros((count, 5, 2)))


@pytest.mark.parametrize(
    "sigma",
    [np.ones(2), np.ones(40), np.ones((1, 2, 40)), 0.0, -1.0, np.nan, np.zeros((2, 40))],
    ids=["per view", "per point", "3 axes", "zero", "negative", "nan", "zeros"],
)
def test_sigmas_that_mean_nothing_are_refused(sigma: np.ndarray | float) -> None:
    cameras = rig(2)
    with pytest.raises(ValueError, match="sigma_px: expected positive numbers"):
        triangulate(cameras, seen(cameras, POINTS), sigma_px=sigma)


def test_sigmas_for_another_number_of_points_are_refused() -> None:
    cameras = rig(2)
    with pytest.raises(ValueError, match="broadcast"):
        triangulate(cameras, seen(cameras, POINTS), sigma_px=np.ones((2, 3)))


def test_parallel_rays_are_refused() -> None:
    origins = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    along = np.tile([0.0, 0.6, 0.8], (2, 3, 1))
    with pytest.raises(ValueError, match="rays that are not parallel"):
        nearest_to_rays(origins, along)
    along[1, :2] = [0.0, 0.8, 0.6]  # one point of three is still seen along parallel rays
    with pytest.raises(ValueError, match="rays that are not parallel"):
        nearest_to_rays(origins, along)


def test_two_cameras_that_are_one_are_refused() -> None:
    camera = rig(1)[0]
    with pytest.raises(ValueError, match="rays that are not parallel"):
        triangulate([camera, camera], seen([camera, camera], POINTS))


def test_the_point_nearest_to_two_skew_rays_lies_halfway() -> None:
    origins = np.array([[-5.0, 0.0, 1.0], [0.0, -5.0, -1.0]])
    directions = np.array([[[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]])
    np.testing.assert_allclose(nearest_to_rays(origins, directions), [[0.0, 0.0, 0.0]], atol=1e-14)
