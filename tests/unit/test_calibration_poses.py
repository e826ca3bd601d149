"""Poses from fiducials: right where the pixels are, honest where they are not, and refused where nothing can be had."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from cathxr.calibration.error_map import error_summary, expected_error_mm, roi_grid
from cathxr.calibration.poses import calibrate_poses, pose_std, with_intrinsics
from cathxr.calibration.sighting import Blob, FoundMarker, Sighting
from cathxr.core import CalibrationError, Intrinsics, Pose, Provenance, Rig
from cathxr.geometry import CameraModel, triangulate
from cathxr.geometry.pose import angle_between, perturbed, rotation_vector_from_quaternion
from cathxr.storage.rig_file import example_rig, rig_from_text, rig_to_text
from cathxr.twin import true_rig

DATE = "2026-01-31"
NAMES = ("top", "front")
LENS_STD = np.array([2.0, 2.0, 1.5, 1.5, 4e-3, 2e-2, 2e-4, 2e-4, 4e-2])  # fifteen pictures of a board, 0.1 px


def sighting(
    rig: Rig, camera: str, *, names: str = "TF", noise_px: float = 0.0, sigma_px: float = 0.1, seed: int = 0
) -> Sighting:
    """What a camera of `rig` sees of the crosses whose letters are in `names`."""
    rng = np.random.default_rng([seed, NAMES.index(camera)])
    model = CameraModel.of(rig.cameras[camera])
    seen = [each for group in rig.markers.values() for each in group if each.name[1] in names]
    found = tuple(
        FoundMarker(
            each.name, each.colour, model.project(each.position_mm[None])[0] + noise_px * rng.normal(size=2), sigma_px
        )
        for each in seen
    )
    return Sighting(camera, rig.cameras[camera].size_px, found)


def changed(seen: Sighting, **moved: tuple[float, float]) -> Sighting:
    """The sighting with some fiducials elsewhere, px."""
    return replace(
        seen,
        markers=tuple(replace(each, centre_px=each.centre_px + moved.get(each.name, 0.0)) for each in seen.markers),
    )


def pose_error(estimate: Pose, truth: Pose) -> np.ndarray:
    """Rotation (rad) and translation (mm) that take the true pose to the estimate, as rig covariances mean them."""
    turn = Pose(estimate.rotation_wxyz, np.zeros(3)) @ Pose(truth.rotation_wxyz, np.zeros(3)).inverse()
    return np.concatenate(
        [rotation_vector_from_quaternion(turn.rotation_wxyz), estimate.translation_mm - truth.translation_mm]
    )


def with_lens_errors(rig: Rig, std: np.ndarray = LENS_STD, *, seed: int | None = None) -> Rig:
    """The rig with lenses whose covariance is stated, and, with a seed, that are wrong by a draw from it."""
    rng = np.random.default_rng(7)
    mix = rng.normal(size=(9, 9)) + 2.0 * np.eye(9)
    correlation = mix @ mix.T
    scale = std / np.sqrt(np.diag(correlation))
    covariance = scale[:, None] * correlation * scale
    covariance = 0.5 * (covariance + covariance.T)
    cameras = {}
    for number, (name, camera) in enumerate(rig.cameras.items()):
        lens = camera.intrinsics
        values = np.concatenate([lens.focal_px, lens.centre_px, lens.distortion])
        if seed is not None:
            values = values + np.random.default_rng([seed, number]).multivariate_normal(np.zeros(9), covariance)
        stated = Intrinsics(values[:2], values[2:4], values[4:], Provenance(covariance=covariance))
        cameras[name] = replace(camera, intrinsics=stated)
    return replace(rig, cameras=cameras)


@pytest.mark.parametrize("names", ["T", "F", "TF"])
def test_exact_pixels_give_the_exact_pose(names: str) -> None:
    truth = true_rig(example_rig(), 5)
    result = calibrate_poses(example_rig(), [sighting(truth, name, names=names) for name in NAMES], date=DATE)
    for name in NAMES:
        error = pose_error(result.rig.cameras[name].camera_from_box, truth.cameras[name].camera_from_box)
        # Pixels of 1e3 are exact to 1e-13; the pose is known to some 1e-6 rad and 1e-3 mm for each px.
        np.testing.assert_allclose(error, 0.0, atol=1e-9)
        assert result.rms_px[name] < 1e-9
    assert result.warnings == ()


def test_the_rig_says_how_its_poses_were_measured_and_keeps_all_else() -> None:
    rig = with_lens_errors(example_rig())
    truth = true_rig(rig, 1)
    result = calibrate_poses(rig, [sighting(truth, name, noise_px=0.1) for name in NAMES], date=DATE)
    for name in NAMES:
        camera = result.rig.cameras[name]
        stated = camera.pose_provenance
        assert stated.covariance is not None
        assert stated.covariance_with_intrinsics is not None
        assert (stated.n, stated.date) == (8, DATE)
        assert stated.rms_px == result.rms_px[name]
        np.testing.assert_allclose(stated.std["translation_mm"], np.sqrt(np.diag(stated.covariance)[3:]))
        assert camera.intrinsics is rig.cameras[name].intrinsics
        # The true rig's cameras are up to 3 mm an axis and some degrees off.
        earlier, now = rig.cameras[name].camera_from_box, camera.camera_from_box
        shift = np.linalg.norm(now.inverse().translation_mm - earlier.inverse().translation_mm)
        assert result.moved[name] == pytest.approx((shift, np.rad2deg(angle_between(now, earlier))))
    assert result.rig.markers is not None
    again = rig_from_text(rig_to_text(result.rig))
    np.testing.assert_array_equal(
        again.cameras["top"].pose_provenance.covariance_with_intrinsics,
        result.rig.cameras["top"].pose_provenance.covariance_with_intrinsics,
    )


def test_one_camera_alone_leaves_the_other_as_it_was() -> None:
    rig = example_rig()
    result = calibrate_poses(rig, [sighting(true_rig(rig, 3), "front", names="F")], date=DATE)
    assert result.rig.cameras["top"] is rig.cameras["top"]
    assert set(result.rms_px) == {"front"}


@pytest.mark.parametrize("names", ["own", "TF"])
@pytest.mark.parametrize("lens", [False, True], ids=["exact lens", "lens with errors"])
def test_normalised_errors_are_those_of_the_stated_covariance(names: str, lens: bool) -> None:
    count, total = 20, 0.0
    nominal = with_lens_errors(example_rig()) if lens else example_rig()
    for seed in range(count):
        truth = true_rig(nominal, seed)
        stated = with_lens_errors(nominal, seed=seed) if lens else nominal
        seen = [
            sighting(truth, name, names=name[0].upper() if names == "own" else names, noise_px=0.1, seed=seed)
            for name in NAMES
        ]
        result = calibrate_poses(stated, seen, date=DATE)
        for name in NAMES:
            camera = result.rig.cameras[name]
            error = pose_error(camera.camera_from_box, truth.cameras[name].camera_from_box)
            total += float(error @ np.linalg.solve(camera.pose_provenance.covariance, error))
    # Chi-square with 6 for each pose, once in ten thousand; the estimated noise scale widens it by a few per cent.
    low, high = stats.chi2.ppf([5e-5, 1.0 - 5e-5], 12 * count)
    assert 0.95 * low < total < 1.1 * high


@pytest.mark.parametrize("names", ["own", "TF"])
def test_the_error_of_points_is_the_expected_one_with_a_wrong_lens(names: str) -> None:
    # Without the covariance between pose and lens it would be stated ten times too large with eight fiducials.
    count, square, expected = 20, 0.0, 0.0
    nominal = with_lens_errors(example_rig())
    points = roi_grid(nominal, count=3)
    for seed in range(count):
        truth, stated = true_rig(nominal, seed), with_lens_errors(nominal, seed=seed)
        seen = [
            sighting(truth, name, names=name[0].upper() if names == "own" else names, noise_px=0.1, seed=seed)
            for name in NAMES
        ]
        rig = calibrate_poses(stated, seen, date=DATE).rig
        pixels = np.stack([CameraModel.of(truth.cameras[name]).project(points) for name in NAMES])
        found = triangulate([CameraModel.of(rig.cameras[name]) for name in NAMES], pixels).points_box
        square += float(np.square(found - points).sum(axis=1).mean())
        expected += float(np.square(expected_error_mm(rig, points)).mean())
    # Some ten independent numbers for each rig, unequal: a few hundred, of which the mean square scatters by a tenth.
    assert 0.7 < np.sqrt(square / expected) < 1.35


def test_a_stated_std_of_the_fiducials_widens_the_pose_and_gives_them_their_share() -> None:
    rig = example_rig()
    loose = {
        camera: tuple(replace(each, provenance=Provenance(std={"position_mm": np.full(3, 0.1)})) for each in group)
        for camera, group in rig.markers.items()
    }
    count, total = 20, 0.0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        truth = true_rig(rig, seed)
        displaced = {
            camera: tuple(replace(each, position_mm=each.position_mm + 0.1 * rng.normal(size=3)) for each in group)
            for camera, group in rig.markers.items()
        }
        seen = [sighting(replace(truth, markers=displaced), name, noise_px=0.1, seed=seed) for name in NAMES]
        result = calibrate_poses(replace(rig, markers=loose), seen, date=DATE)
        assert not [each for each in result.residuals if not each.used]
        for name in NAMES:
            camera = result.rig.cameras[name]
            error = pose_error(camera.camera_from_box, truth.cameras[name].camera_from_box)
            total += float(error @ np.linalg.solve(camera.pose_provenance.covariance, error))
    low, high = stats.chi2.ppf([5e-5, 1.0 - 5e-5], 12 * count)
    # Both poses lean on the same fiducials: what they share counts twice, so that the sum scatters more.
    assert 0.85 * low < total < 1.2 * high


def test_noise_beyond_what_is_stated_widens_the_covariance() -> None:
    truth = true_rig(example_rig(), 2)
    stated = [sighting(truth, name, noise_px=0.2, sigma_px=0.1, seed=4) for name in NAMES]
    result = calibrate_poses(example_rig(), stated, date=DATE)
    # Twenty degrees of freedom against the prior's eight: towards 2 by two thirds, give or take a sixth.
    assert all(1.2 < each < 2.3 for each in result.noise_scale.values())


def test_a_fiducial_that_is_off_is_named_and_left_out() -> None:
    truth = true_rig(example_rig(), 6)
    seen = [changed(sighting(truth, "top", noise_px=0.05), mT3=(3.0, -3.0)), sighting(truth, "front", noise_px=0.05)]
    result = calibrate_poses(example_rig(), seen, date=DATE)
    (warning,) = result.warnings
    assert "mT3 lies 4." in warning
    assert "left out" in warning
    assert [each.name for each in result.residuals if not each.used] == ["mT3"]
    assert result.rig.cameras["top"].pose_provenance.n == 7
    error = pose_error(result.rig.cameras["top"].camera_from_box, truth.cameras["top"].camera_from_box)
    assert np.linalg.norm(error[3:]) < 0.2  # 0.02 mm expected with 0.05 px; 4 px of one in eight would be 1 mm


def test_two_exchanged_fiducials_are_both_left_out() -> None:
    truth = true_rig(example_rig(), 6)
    top = sighting(truth, "top", noise_px=0.05)
    places = {each.name: each.centre_px for each in top.markers}
    swap = {"mT1": places["mT2"] - places["mT1"], "mT2": places["mT1"] - places["mT2"]}
    result = calibrate_poses(example_rig(), [changed(top, **swap)], date=DATE)
    assert {each.name for each in result.residuals if not each.used} == {"mT1", "mT2"}


def test_with_five_the_one_that_is_off_is_named_and_refused() -> None:
    truth = true_rig(example_rig(), 6)
    top = sighting(truth, "top", noise_px=0.05)
    five = replace(top, markers=tuple(each for each in top.markers if each.name in ("mT1", "mT2", "mT3", "mT4", "mF2")))
    with pytest.raises(CalibrationError, match=r"px from where the others say in the top picture.*too few"):
        calibrate_poses(example_rig(), [changed(five, mT3=(30.0, -20.0))], date=DATE)


def test_four_that_do_not_fit_are_refused() -> None:
    truth = true_rig(example_rig(), 6)
    seen = changed(sighting(truth, "top", names="T", noise_px=0.05), mT3=(8.0, -8.0))
    with pytest.raises(CalibrationError, match=r"four fiducials of the top camera .* do not fit together"):
        calibrate_poses(example_rig(), [seen], date=DATE)


def test_residuals_all_too_large_are_a_warning() -> None:
    truth = true_rig(example_rig(), 6)
    result = calibrate_poses(example_rig(), [sighting(truth, "top", noise_px=0.8, sigma_px=0.1, seed=1)], date=DATE)
    assert any("times worse than expected" in each for each in result.warnings)


def test_a_lens_of_another_resolution_is_refused() -> None:
    rig = example_rig()
    camera = rig.cameras["top"]
    half = replace(
        camera.intrinsics, focal_px=0.5 * camera.intrinsics.focal_px, centre_px=camera.intrinsics.centre_px / 2
    )
    wrong = with_intrinsics(rig, "top", half)
    with pytest.raises(CalibrationError, match=r"lens"):
        calibrate_poses(wrong, [sighting(true_rig(rig, 1), "top", noise_px=0.1)], date=DATE)


def test_exchanged_pictures_are_refused() -> None:
    truth = true_rig(example_rig(), 6)
    seen = replace(sighting(truth, "front"), camera="top")
    with pytest.raises(CalibrationError, match="exchanged"):
        calibrate_poses(example_rig(), [seen], date=DATE)


def test_a_second_cross_that_fits_nowhere_is_a_warning() -> None:
    # Both crosses of the example box are alike: seen by the wrong camera the nearer one fits to the last bit.
    rig = example_rig()
    seen = sighting(true_rig(rig, 6), "top", names="T")
    colours = ("red", "green", "blue", "yellow")
    strays = tuple(Blob(each, np.array([300.0 + 100.0 * i, 300.0]), 9.0) for i, each in enumerate(colours))
    markers = tuple(replace(each, radius_px=12.0) for each in seen.markers)
    for blobs, count in ((strays, 1), (strays[:3], 0), ((), 0)):
        result = calibrate_poses(rig, [replace(seen, markers=markers, blobs=blobs)], date=DATE)
        assert len([each for each in result.warnings if "exchanged" in each]) == count


def test_a_mirrored_picture_is_refused() -> None:
    truth = true_rig(example_rig(), 6)
    seen = sighting(truth, "top", names="T")
    mirrored = replace(
        seen, markers=tuple(replace(each, centre_px=each.centre_px * [-1, 1] + [1279, 0]) for each in seen.markers)
    )
    with pytest.raises(CalibrationError, match="mirrored"):
        calibrate_poses(example_rig(), [mirrored], date=DATE)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda seen: replace(seen, camera="side"), "no camera 'side'"),
        (lambda seen: replace(seen, size_px=(640, 480)), "640x480 pixels"),
        (lambda seen: replace(seen, problem="mT1 (red) was not found."), "mT1"),
        (lambda seen: replace(seen, markers=seen.markers[:3]), "sees 3 fiducials"),
        (lambda seen: replace(seen, markers=()), "none"),
        (lambda seen: replace(seen, markers=(*seen.markers, seen.markers[0])), "twice"),
        (lambda seen: replace(seen, markers=(replace(seen.markers[0], name="mX9"), *seen.markers[1:])), "mX9"),
        (lambda seen: changed(seen, mT1=(-1e5, 0.0)), "lens"),
    ],
    ids=["camera", "size", "problem", "three", "none", "twice", "unknown", "beyond the lens"],
)
def test_what_cannot_give_a_pose_is_told_in_a_sentence(change, says) -> None:
    with pytest.raises(CalibrationError) as caught:
        calibrate_poses(example_rig(), [change(sighting(true_rig(example_rig(), 1), "top", names="T"))], date=DATE)
    assert says in str(caught.value)


def test_no_sighting_two_of_one_camera_and_a_rig_without_fiducials_are_refused() -> None:
    rig = example_rig()
    seen = sighting(rig, "top")
    for sightings, where, says in (([], rig, "give pictures"), ([seen, seen], rig, "twice")):
        with pytest.raises(CalibrationError, match=says):
            calibrate_poses(where, sightings, date=DATE)
    with pytest.raises(CalibrationError, match="no fiducials"):
        calibrate_poses(replace(rig, markers={}), [seen], date=DATE)


def test_fiducials_on_one_line_are_refused() -> None:
    rig = example_rig()
    names = ("mT1", "mT2", "mF1", "mF2")
    line = {
        "top": tuple(
            replace(each, position_mm=np.array([30.0 * names.index(each.name), 0.0, 0.0]))
            for group in rig.markers.values()
            for each in group
            if each.name in names
        )
    }
    in_line = replace(rig, markers=line)
    with pytest.raises(CalibrationError, match="one line"):
        calibrate_poses(in_line, [sighting(in_line, "top")], date=DATE)


def test_the_std_of_a_pose_is_that_of_its_centre_in_the_box() -> None:
    truth = true_rig(example_rig(), 9)
    result = calibrate_poses(example_rig(), [sighting(truth, "top", noise_px=0.1)], date=DATE)
    camera = result.rig.cameras["top"]
    std = pose_std(camera)
    assert std is not None
    rng = np.random.default_rng(0)
    steps = rng.multivariate_normal(np.zeros(6), camera.pose_provenance.covariance, size=4000)
    centres = np.stack([perturbed(camera.camera_from_box, each).inverse().translation_mm for each in steps])
    # A standard deviation from 4000 draws is good to 1.1 %; five times that.
    np.testing.assert_allclose(centres.std(axis=0), std[0], rtol=0.06)
    np.testing.assert_allclose(steps[:, :3].std(axis=0), std[1], rtol=0.06)
    assert pose_std(example_rig().cameras["top"]) is None


def test_a_new_lens_ends_what_the_pose_knew_of_the_old_one() -> None:
    rig = with_lens_errors(example_rig())
    calibrated = calibrate_poses(rig, [sighting(true_rig(rig, 1), name, noise_px=0.1) for name in NAMES], date=DATE).rig
    other = with_intrinsics(calibrated, "top", example_rig().cameras["top"].intrinsics)
    assert other.cameras["top"].pose_provenance.covariance_with_intrinsics is None
    assert other.cameras["top"].pose_provenance.covariance is not None
    assert other.cameras["front"] is calibrated.cameras["front"]


def test_the_summary_is_that_of_the_expected_error() -> None:
    rig = example_rig()
    summary = error_summary(rig)
    error = expected_error_mm(rig, roi_grid(rig))
    assert summary.max_mm == pytest.approx(error.max())
    assert summary.mean_mm == pytest.approx(np.sqrt(np.mean(error**2)))
    assert summary.mean_mm < summary.p95_mm < summary.max_mm
