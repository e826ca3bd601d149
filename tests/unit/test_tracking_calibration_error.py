"""What calibration errors do to a point: derivatives against differences, covariances against perturbed poses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from cathxr.core import Catheter, Intrinsics, Marker, Pose, Provenance, Rig, RigCamera, Roi
from cathxr.geometry import CameraModel, triangulate
from cathxr.geometry.pose import perturbed
from cathxr.storage.rig_file import example_rig
from cathxr.tracking.calibration_error import (
    ASSUMED_MARKER_PX,
    CameraError,
    camera_errors,
    distortion_derivative,
    point_covariance,
    pose_jacobian,
)
from cathxr.twin import true_rig

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
        np.testing.assert_allclose(errors[name].pose_covariance @ information, np.eye(6), atol=1e-6)
        np.testing.assert_array_equal(errors[name].focal_variance, [0.0, 0.0])
        np.testing.assert_array_equal(errors[name].centre_variance, [0.0, 0.0])


@pytest.mark.parametrize("count", [0, 3])
def test_too_few_markers_are_replaced_by_the_corners_of_the_middle_planes(count: int) -> None:
    # The architecture's fiducials are those very corners, in another order, which changes no covariance.
    expected = camera_errors(rig([None, None], corner_markers()))
    got = camera_errors(rig([None, None], corner_markers(count)))
    for name in ("top", "front"):
        np.testing.assert_allclose(got[name].pose_covariance, expected[name].pose_covariance, rtol=1e-6, atol=1e-15)


def test_assumed_errors_give_a_credible_sigma() -> None:
    # 0.1 px on four markers, 4 px per mm: a few hundredths of a millimetre, never zero and never a millimetre.
    sigma = np.sqrt(np.trace(point_covariance(list(camera_errors(rig([None, None])).values()), POINT)))
    assert 0.005 < sigma < 0.2


def test_a_stated_covariance_is_taken_as_it_is() -> None:
    covariances = [each @ each.T for each in MIX]
    errors = camera_errors(rig(covariances, corner_markers()))
    np.testing.assert_array_equal(errors["top"].pose_covariance, covariances[0])
    np.testing.assert_array_equal(errors["front"].pose_covariance, covariances[1])


def test_distortion_derivative_is_that_of_the_projection() -> None:
    rig = true_rig(example_rig(), 2)
    model = CameraModel.of(rig.cameras["front"])
    point = np.array([90.0, -35.0, 40.0])
    step = 1e-6
    for which in range(5):
        change = step * np.eye(5)[which]
        ahead, behind = (
            CameraModel(
                replace(model.intrinsics, distortion=model.intrinsics.distortion + sign * change),
                model.camera_from_box,
                model.size_px,
            ).project(point)
            for sign in (1.0, -1.0)
        )
        # central differences of a function linear in the coefficient: rounding alone is left
        np.testing.assert_allclose(
            distortion_derivative(model, point)[:, which], (ahead - behind) / (2.0 * step), atol=1e-5
        )


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
