"""Poses of random twin rigs against the truth: errors as stated, by numbers and by pictures. `make prove` writes it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from cathxr.calibration.error_map import expected_error_mm
from cathxr.calibration.marker_finding import find_markers
from cathxr.calibration.poses import PosesResult, calibrate_poses
from cathxr.calibration.sighting import FoundMarker, Sighting
from cathxr.core import FloatArray, Intrinsics, Pose, Provenance, Rig
from cathxr.geometry import CameraModel, triangulate
from cathxr.geometry.calibration_error import intrinsics_jacobian, pose_jacobian
from cathxr.geometry.pose import pose_from_vector, rotation_vector_from_quaternion
from cathxr.storage.rig_file import example_rig
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig

RIGS = 200
NOISE_PX = 0.1
BOARD_PX, BOARD_VIEWS = 0.1, 15
CAMERAS = ("top", "front")
HONEST = (0.8, 1.2)  # what the issue asks of normalised errors


@dataclass
class Tally:
    """Normalised squared errors of poses, for each degree of freedom, and errors at points of the ROI, mm."""

    pose: list[float] = field(default_factory=list)
    error_mm: list[FloatArray] = field(default_factory=list)
    expected_mm: list[FloatArray] = field(default_factory=list)

    @property
    def normalised(self) -> float:
        return float(np.sqrt(np.mean(self.pose)))

    @property
    def normalised_points(self) -> float:
        """Root mean square error at points over what was expected there."""
        ratio = np.concatenate(self.error_mm) / np.concatenate(self.expected_mm)
        return float(np.sqrt(np.mean(ratio**2)))

    def row(self, name: str) -> str:
        error = np.concatenate(self.error_mm)
        return (
            f"| {name} | {len(self.pose)} | {self.normalised:.2f} | {self.normalised_points:.2f} | "
            f"{error.mean():.3f} | {np.percentile(error, 95):.3f} |"
        )


def random_truth(seed: int) -> Rig:
    """A twin rig of this seed: cameras off their places, lenses unlike each other."""
    rig = true_rig(example_rig(), seed)
    cameras = {}
    for number, (name, camera) in enumerate(rig.cameras.items()):
        rng = np.random.default_rng([seed, number, 0x1E45])
        focal = camera.intrinsics.focal_px * rng.uniform(0.97, 1.03) * rng.uniform(0.998, 1.002, size=2)
        centre = camera.intrinsics.centre_px + rng.uniform(-12.0, 12.0, size=2)
        spread = np.array([0.08, 0.04, 1e-3, 1e-3, 0.02])
        distortion = camera.intrinsics.distortion + spread * rng.uniform(-1.0, 1.0, size=5)
        cameras[name] = replace(camera, intrinsics=Intrinsics(focal, centre, distortion))
    return replace(rig, cameras=cameras)


def board_covariance(camera: CameraModel, rng: np.random.Generator) -> FloatArray:
    """What fifteen pictures of a board leave of a lens: every number's error and how they hang together."""
    grid = np.stack(np.meshgrid(6.0 * np.arange(9) - 24.0, 6.0 * np.arange(9) - 24.0, [0.0]), axis=-1).reshape(-1, 3)
    information, views = np.zeros((9, 9)), 0
    while views < BOARD_VIEWS:
        place = [rng.uniform(-80, 80), rng.uniform(-45, 45), rng.uniform(200, 330)]
        view = CameraModel(
            camera.intrinsics, pose_from_vector(np.array([*rng.uniform(-0.6, 0.6, 3), *place])), camera.size_px
        )
        seen = grid[view.inside(view.project(grid))]
        if len(seen) < 30:
            continue
        views += 1
        pose, lens = pose_jacobian(view, seen).reshape(-1, 6), intrinsics_jacobian(view, seen).reshape(-1, 9)
        information += lens.T @ (lens - pose @ np.linalg.solve(pose.T @ pose, pose.T @ lens))
    covariance = BOARD_PX**2 * np.linalg.inv(information)
    return np.asarray(0.5 * (covariance + covariance.T), dtype=np.float64)


def believed(truth: Rig, seed: int, *, exact: bool) -> Rig:
    """What a person knows before: the drawing's poses; lenses that are exact or off by a draw of what they state."""
    cameras = {}
    for number, (name, camera) in enumerate(truth.cameras.items()):
        lens = camera.intrinsics
        if not exact:
            rng = np.random.default_rng([seed, number, 0xB0A2])
            covariance = board_covariance(CameraModel.of(camera), rng)
            values = np.concatenate([lens.focal_px, lens.centre_px, lens.distortion])
            values = values + np.linalg.cholesky(covariance) @ rng.normal(size=9)
            lens = Intrinsics(values[:2], values[2:4], values[4:], Provenance(covariance=covariance))
        nominal = example_rig().cameras[name]
        cameras[name] = replace(nominal, intrinsics=lens)
    return replace(truth, cameras=cameras)


def by_numbers(truth: Rig, camera: str, count: int, seed: int) -> Sighting:
    """The exact places of four or eight fiducials, with noise."""
    rng = np.random.default_rng([seed, CAMERAS.index(camera), 0x5EE5])
    group = truth.markers[camera] if count == 4 else [each for cross in truth.markers.values() for each in cross]
    pixels = CameraModel.of(truth.cameras[camera]).project(np.stack([each.position_mm for each in group]))
    found = tuple(
        FoundMarker(each.name, each.colour, at + NOISE_PX * rng.normal(size=2), NOISE_PX)
        for each, at in zip(group, pixels, strict=True)
    )
    return Sighting(camera, truth.cameras[camera].size_px, found)


def by_pictures(truth: Rig, rig: Rig, seed: int) -> list[Sighting]:
    """What is found in pictures of the twin with both crosses in, light and sensor by seed."""
    rng = np.random.default_rng([seed, 0x91C7])
    settings = replace(
        scene("pillars"),
        gain=float(rng.uniform(1.0, 4.0)),
        lens_blur_px=float(rng.uniform(0.5, 1.1)),
        cast=tuple(rng.uniform(0.85, 1.15, size=3)),
        front_unevenness=float(rng.uniform(0.0, 0.3)),
    )
    world = TwinWorld(truth, seed=seed, settings=settings, start_ns=0)
    return [find_markers(rig, name, CameraRenderer(world, name).picture(0)) for name in CAMERAS]


def count_in(tally: Tally, truth: Rig, result: PosesResult, seed: int) -> None:
    """Compare poses with the true ones, and points triangulated with them from what the true cameras see."""
    rig = result.rig
    for name in CAMERAS:
        estimate, true = rig.cameras[name].camera_from_box, truth.cameras[name].camera_from_box
        turn = Pose(estimate.rotation_wxyz, np.zeros(3)) @ Pose(true.rotation_wxyz, np.zeros(3)).inverse()
        shift = estimate.translation_mm - true.translation_mm
        error = np.concatenate([rotation_vector_from_quaternion(turn.rotation_wxyz), shift])
        covariance = rig.cameras[name].pose_provenance.covariance
        assert covariance is not None
        tally.pose.append(float(error @ np.linalg.solve(covariance, error)) / 6.0)
    points = np.random.default_rng([seed, 0x7199]).uniform(rig.roi.min_mm, rig.roi.max_mm, (30, 3))
    pixels = np.stack([CameraModel.of(truth.cameras[name]).project(points) for name in CAMERAS])
    found = triangulate([CameraModel.of(rig.cameras[name]) for name in CAMERAS], pixels).points_box
    tally.error_mm.append(np.linalg.norm(found - points, axis=1))
    tally.expected_mm.append(expected_error_mm(rig, points))


def numbers(seeds: Sequence[int], count: int, *, exact: bool) -> Tally:
    tally = Tally()
    for seed in seeds:
        truth = random_truth(seed)
        rig = believed(truth, seed, exact=exact)
        result = calibrate_poses(rig, [by_numbers(truth, name, count, seed) for name in CAMERAS], date="2026-01-31")
        count_in(tally, truth, result, seed)
    return tally


def pictures(seeds: Sequence[int]) -> Tally:
    tally = Tally()
    for seed in seeds:
        truth = random_truth(seed)
        rig = believed(truth, seed, exact=False)
        result = calibrate_poses(rig, by_pictures(truth, rig, seed), date="2026-01-31")
        count_in(tally, truth, result, seed)
    return tally


@pytest.mark.parametrize(("count", "exact"), [(4, True), (8, False)])
def test_a_few_rigs_have_the_errors_they_state(count: int, exact: bool) -> None:
    tally = numbers(range(12), count, exact=exact)
    # 144 squared normal numbers: their root mean square scatters by 6 %; four times that.
    assert 0.76 < tally.normalised < 1.24


def test_a_rig_measured_by_pictures_knows_points_to_hundredths() -> None:
    tally = pictures([1])
    # A lens of 0.1 px boards leaves 0.03 mm with eight fiducials, and the pictures of the fiducials far less.
    assert np.concatenate(tally.error_mm).mean() < 0.1
    assert tally.normalised < 2.0  # twelve numbers: beyond it once in a million


@pytest.mark.proof
def test_poses_are_right_and_their_errors_honest(repo_root: Path) -> None:
    seeds = range(RIGS)
    cases = {
        f"{count} fiducials, {'exact lens' if exact else 'lens of a board'}": numbers(seeds, count, exact=exact)
        for exact in (True, False)
        for count in (4, 8)
    }
    cases["pictures, 8 fiducials, lens of a board"] = pictures(seeds)
    lines = "\n".join(each.row(name) for name, each in cases.items())
    (repo_root / "docs" / "proof-poses.md").write_text(f"{_HEAD}{lines}\n", encoding="utf-8", newline="\n")
    for name, each in cases.items():
        assert HONEST[0] < each.normalised < HONEST[1], name
        assert HONEST[0] < each.normalised_points < HONEST[1], name


_HEAD = f"""# Poses from the fiducials

Made by `make prove` (tests/e2e/test_proof_poses.py): {RIGS} random rigs of the twin. Each camera stands up to 3 mm an
axis and 2.5 degrees from the drawing, and has a lens of its own. In the first rows each fiducial's place is known with
{NOISE_PX} px of noise, in the last it is found in a picture of the twin (sensor noise, blur, colour cast and uneven
light by chance). *Lens of a board*: the lens that the poses are found with is off by a draw from the
covariance it states, that of {BOARD_VIEWS} pictures of a board with {BOARD_PX} px.

Normalised: root mean square of an error over the stated one; 1 is honest. Of the pose: all six numbers of it, by their
covariance. Of points: the distance from the truth, at 30 random points of the region of interest in each rig, of what
both cameras see exactly, over the expected error (the picture `expected_error.png` of `calibrate markers`).

| case | poses | pose, normalised | points, normalised | mean error at a point, mm | 95 % below, mm |
|---|---|---|---|---|---|
"""
