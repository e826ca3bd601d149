"""What calibration errors do to a point: derivatives against differences, covariances against perturbed poses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from cathxr.core import Catheter, Intrinsics, Marker, Pose, Provenance, Rig, RigCamera, Roi
from cathxr.geometry import CameraModel, triangulate
from cathxr.geometry.calibration_error import (
    ASSUMED_MARKER_PX,
    CameraError,
    camera_errors,
    intrinsics_covariance,
    intrinsics_jacobian,
    point_covariance,
    point_covariances,
    pose_jacobian,
)
from cathxr.geometry.pose import perturbed
from cathxr.storage.rig_file import example_rig

LENS = Intrinsics(np.array([1357.7, 1357.7]), np.array([640.0, 360.0]), np.array([-0.18, 0.06, 0.001, -0.002, -0.01]))
# Off-nominal by some degrees and millimetres, as real boxes are.
OFF = np.array([0.05, -0.03, 0.08, 2.0, -3.0, 4.0])
TOP = perturbed(Pose(np.array([0.0, 1.0, 0.0, 0.0]), np.array([-60.0, 0.0, 330.0])), OFF)
FRONT = perturbed(Pose(np.array([0.70710678, 0.70710678, 0.0, 0.0]), np.array([-60.0, 0.0, 330.0])), -OFF)
ROI = Roi(np.array([0.0, -60.0, -60.0]), np.array([120.0, 60.0, 60.0]))
POINT = np.array([85.0, 15.0, -20.0])
# Correlated and different for the two cameras: 1 mrad and 0.2 mm or so.
MIX = np.random.default_rng(0).normal(size=(2, 6, 6)) * np.array([1e-3] * 3 + [0.2] * 3)[:, None] / np.sqrt(6.0)


def rig_camera(name: str, pose: Pose, covariance: np.ndarray | None = None) -> RigCamera:
    """Return a camera of the rig; its stated pose error may be absent."""
    return RigCamera(name, (1280, 720), 60.0, LENS, pose, Provenance(covariance=covariance))


def rig(covariances: list[np.ndarray] | list[None], markers: dict[str, tuple[Marker, ...]] | None = None) -> Rig:
    """Return a rig of two cameras."""
    cameras = {"top": rig_camera("top", TOP, covariances[0]), "front": rig_camera("front", FRONT, covariances[1])}
    return Rig("", ROI, Catheter("", 3.0), cameras, markers or {})


def corner_markers(count: int = 4) -> dict[str, tuple[Marker, ...]]:
    """Return the architecture's fiducials, as many a view as asked."""
    flat = [(0.0, -60.0), (120.0, -60.0), (120.0, 60.0), (0.0, 60.0)][:count]
    return {
        "top": tuple(Marker(f"mT{i}", np.array([x, y, 0.0]), "red") for i, (x, y) in enumerate(flat)),
        "front": tuple(Marker(f"mF{i}", np.array([x, 0.0, z]), "red") for i, (x, z) in enumerate(flat)),
    }


@pytest.mark.parametrize("pose", [TOP, FRONT], ids=["top", "front"])
def test_the_pose_derivative_is_the_central_difference(pose: Pose) -> None:
    points = np.random.default_rng(1).uniform(ROI.min_mm, ROI.max_mm, (20, 3))
    got = pose_jacobian(CameraModel(LENS, pose, (1280, 720)), points)
    assert got.shape == (20, 2, 6)
    for axis in range(6):
        # Third derivatives are below 1e4 px per rad^3 and 1e-3 px per mm^3: step^2 of it is under 1e-5 and 1e-8.
        step = np.zeros(6)
        step[axis] = 1e-5 if axis < 3 else 1e-3
        plus, minus = (CameraModel(LENS, perturbed(pose, sign * step), (1280, 720)) for sign in (1.0, -1.0))
        difference = (plus.project(points) - minus.project(points)) / (2.0 * step[axis])
        np.testing.assert_allclose(got[:, :, axis], difference, rtol=1e-7, atol=1e-5 if axis < 3 else 1e-7)


def monte_carlo(rig_errors: list[CameraError], cameras: list[list[CameraModel]]) -> float:
    """Return the whitened squared error summed over triangulations with the stated cameras of what `cameras` see."""
    models = [each.model for each in rig_errors]
    pixels = np.stack([np.concatenate([one.project(POINT[None]) for one in view]) for view in cameras])
    errors = triangulate(models, pixels).points_box - POINT
    whitening = np.linalg.inv(point_covariance(rig_errors, POINT))
    return float(np.einsum("ni,ij,nj->", errors, whitening, errors))


def test_the_point_covariance_is_that_of_perturbed_poses() -> None:
    covariances = [each @ each.T for each in MIX]
    errors = list(camera_errors(rig(covariances)).values())
    rng = np.random.default_rng(2)
    count = 2000
    cameras = [
        [CameraModel(LENS, perturbed(pose, mix @ rng.normal(size=6)), (1280, 720)) for _ in range(count)]
        for pose, mix in zip((TOP, FRONT), MIX, strict=True)
    ]
    # Chi-square with 3 N degrees of freedom, once in a million either way; the second order of 1 mrad is 1e-3 of it.
    low, high = stats.chi2.ppf([5e-7, 1.0 - 5e-7], 3 * count)
    assert low < monte_carlo(errors, cameras) < high


def test_the_point_covariance_is_that_of_perturbed_lenses() -> None:
    std = {"focal_px": np.array([3.0, 2.0]), "centre_px": np.array([1.5, 2.5])}
    lens = replace(LENS, provenance=Provenance(std=std))
    covariance = 1e-14 * np.eye(6)
    cameras = {
        name: replace(rig_camera(name, pose, covariance), intrinsics=lens)
        for name, pose in (("top", TOP), ("front", FRONT))
    }
    errors = list(camera_errors(Rig("", ROI, Catheter("", 3.0), cameras)).values())
    rng = np.random.default_rng(3)
    count = 2000

    def drawn() -> Intrinsics:
        return replace(
            LENS,
            focal_px=LENS.focal_px + std["focal_px"] * rng.normal(size=2),
            centre_px=LENS.centre_px + std["centre_px"] * rng.normal(size=2),
        )

    seen = [[CameraModel(drawn(), pose, (1280, 720)) for _ in range(count)] for pose in (TOP, FRONT)]
    low, high = stats.chi2.ppf([5e-7, 1.0 - 5e-7], 3 * count)
    assert low < monte_carlo(errors, seen) < high


def test_where_the_rig_states_no_error_four_markers_with_a_tenth_of_a_pixel_are_assumed() -> None:
    errors = camera_errors(rig([None, None], corner_markers()))
    for name, pose in (("top", TOP), ("front", FRONT)):
        model = CameraModel(LENS, pose, (1280, 720))
        points = np.stack([each.position_mm for each in corner_markers()[name]])
        information = np.zeros((6, 6))
        for each in pose_jacobian(model, points):
            information += each.T @ each / ASSUMED_MARKER_PX**2
        np.testing.assert_allclose(errors[name].covariance[:6, :6] @ information, np.eye(6), atol=1e-6)
        np.testing.assert_array_equal(errors[name].covariance[6:], np.zeros((9, 15)))


@pytest.mark.parametrize("count", [0, 3])
def test_too_few_markers_are_replaced_by_the_corners_of_the_middle_planes(count: int) -> None:
    # The architecture's fiducials are those very corners, in another order, which changes no covariance.
    expected = camera_errors(rig([None, None], corner_markers()))
    got = camera_errors(rig([None, None], corner_markers(count)))
    for name in ("top", "front"):
        np.testing.assert_allclose(got[name].covariance, expected[name].covariance, rtol=1e-6, atol=1e-15)


def test_assumed_errors_give_a_credible_sigma() -> None:
    # 0.1 px on four markers, 4 px per mm: a few hundredths of a millimetre, never zero and never a millimetre.
    sigma = np.sqrt(np.trace(point_covariance(list(camera_errors(rig([None, None])).values()), POINT)))
    assert 0.005 < sigma < 0.2


def test_a_stated_covariance_is_taken_as_it_is() -> None:
    covariances = [each @ each.T for each in MIX]
    errors = camera_errors(rig(covariances, corner_markers()))
    np.testing.assert_array_equal(errors["top"].covariance[:6, :6], covariances[0])
    np.testing.assert_array_equal(errors["front"].covariance[:6, :6], covariances[1])


def with_values(lens: Intrinsics, values: np.ndarray) -> Intrinsics:
    """Return the lens with other values, in the order of a covariance."""
    return replace(lens, focal_px=values[:2], centre_px=values[2:4], distortion=values[4:])


def values_of(lens: Intrinsics) -> np.ndarray:
    """Return the nine numbers of a lens in the order of a covariance."""
    return np.concatenate([lens.focal_px, lens.centre_px, lens.distortion])


def test_the_intrinsics_derivative_is_the_central_difference() -> None:
    model = CameraModel(LENS, TOP, (1280, 720))
    points = np.random.default_rng(4).uniform(ROI.min_mm, ROI.max_mm, (10, 3))
    got = intrinsics_jacobian(model, points)
    assert got.shape == (10, 2, 9)
    for which in range(9):
        step = 1e-6 * np.eye(9)[which]
        ahead, behind = (
            CameraModel(with_values(LENS, values_of(LENS) + sign * step), TOP, (1280, 720)).project(points)
            for sign in (1.0, -1.0)
        )
        # Linear in each number, so that only rounding (1e-13 px) over the step is left.
        np.testing.assert_allclose(got[:, :, which], (ahead - behind) / 2e-6, atol=1e-6)


def joint_draws(pose: Pose, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a covariance (15, 15) of a pose that takes up most of its lens's error, and draws (count, 15) from it."""
    model = CameraModel(LENS, pose, (1280, 720))
    points = ROI.corners_mm
    by_pose, by_lens = (each(model, points).reshape(16, -1) for each in (pose_jacobian, intrinsics_jacobian))
    taken_up = -np.linalg.lstsq(by_pose, by_lens, rcond=None)[0]
    lens = np.diag([3.0, 2.0, 1.5, 2.5, 5e-3, 2e-2, 2e-4, 2e-4, 2e-2])
    own = np.diag([1e-4] * 3 + [0.02] * 3)
    mix = np.block([[own, taken_up @ lens], [np.zeros((9, 6)), lens]])
    return mix @ mix.T, rng.normal(size=(count, 15)) @ mix.T


def test_the_point_covariance_is_that_of_poses_and_lenses_that_hang_together() -> None:
    rng = np.random.default_rng(5)
    count = 2000
    stated, seen = {}, []
    for name, pose in (("top", TOP), ("front", FRONT)):
        covariance, draws = joint_draws(pose, rng, count)
        covariance = 0.5 * (covariance + covariance.T)
        provenance = Provenance(covariance=covariance[:6, :6], covariance_with_intrinsics=covariance[:6, 6:])
        lens = replace(LENS, provenance=Provenance(covariance=covariance[6:, 6:]))
        stated[name] = RigCamera(name, (1280, 720), 60.0, lens, pose, provenance)
        seen.append(
            [
                CameraModel(with_values(LENS, values_of(LENS) + each[6:]), perturbed(pose, each[:6]), (1280, 720))
                for each in draws
            ]
        )
    errors = list(camera_errors(Rig("", ROI, Catheter("", 3.0), stated)).values())
    low, high = stats.chi2.ppf([5e-7, 1.0 - 5e-7], 3 * count)
    assert low < monte_carlo(errors, seen) < high
    # Without what they share the error would be another: the test above would see it.
    apart = {name: replace(each, pose_provenance=Provenance(covariance=each.pose_provenance.covariance))
             for name, each in stated.items()}  # fmt: skip
    wrong = list(camera_errors(Rig("", ROI, Catheter("", 3.0), apart)).values())
    assert not low < monte_carlo(wrong, seen) < high


def test_a_lens_states_its_covariance_in_full_or_by_std_or_not_at_all() -> None:
    full = np.diag(np.arange(1.0, 10.0))
    std = {"focal_px": np.array([1.0, 2.0]), "distortion": np.full(5, 0.5)}
    assert np.array_equal(intrinsics_covariance(replace(LENS, provenance=Provenance(std=std, covariance=full))), full)
    by_std = intrinsics_covariance(replace(LENS, provenance=Provenance(std=std)))
    assert np.array_equal(by_std, np.diag([1.0, 4.0, 0.0, 0.0, 0.25, 0.25, 0.25, 0.25, 0.25]))
    assert not intrinsics_covariance(LENS).any()


def test_many_points_have_the_covariance_of_each() -> None:
    errors = list(camera_errors(rig([None, None])).values())
    points = np.random.default_rng(6).uniform(ROI.min_mm, ROI.max_mm, (5, 3))
    together = point_covariances(errors, points)
    for point, covariance in zip(points, together, strict=True):
        # The same numbers added up in another order.
        np.testing.assert_allclose(point_covariance(errors, point), covariance, rtol=1e-9, atol=1e-15)


def test_a_stated_std_of_the_distortion_counts() -> None:
    rig = example_rig()
    stated = {
        name: replace(
            camera,
            intrinsics=replace(
                camera.intrinsics, provenance=Provenance(std={"distortion": np.array([0.02, 0.0, 0.0, 0.0, 0.0])})
            ),
        )
        for name, camera in rig.cameras.items()
    }
    point = np.array([110.0, 40.0, 40.0])
    without = point_covariance(list(camera_errors(rig).values()), point)
    with_it = point_covariance(list(camera_errors(replace(rig, cameras=stated)).values()), point)
    assert np.trace(with_it) > 1.5 * np.trace(without)
