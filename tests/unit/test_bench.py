"""What `cathxr bench` counts and how it calibrates: small runs, no figures of accuracy."""

from dataclasses import replace

import numpy as np
import pytest

from cathxr.app.bench_accuracy import calibration_alone, measured
from cathxr.app.bench_accuracy_page import BEGIN, END, written_between
from cathxr.app.bench_scenes import CATEGORIES, Sequence, from_fiducials, resized
from cathxr.app.bench_sequence import SequenceScore
from cathxr.core import ConfigError, Pose, Status, Track
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.twin import SCENES


def straight(tip_x_mm: float, *, sigma_mm: float = 0.1) -> Track:
    shape = np.linspace([tip_x_mm, 0.0, 0.0], [0.0, 0.0, 0.0], 50)
    pose = Pose(np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]), shape[0])
    return Track(0, 0, Status.TRACKED, shape_box=shape, box_from_tip=pose, sigma_mm=sigma_mm)


def test_a_score_counts_what_is_wrong_and_a_pose_without_a_catheter_is_the_worst() -> None:
    score = SequenceScore()
    for off_mm in (0.1, -1.9, 2.1):
        score.add(straight(60.0 + off_mm), straight(60.0), 0.001)
    assert (score.wrong, score.statuses["tracked"]) == (1, 3)
    assert score.normalised == pytest.approx([1.0, 19.0, 21.0])
    score.add(straight(60.0), Track(0, 0, Status.LOST, reason="no catheter in the scene"), 0.001)
    assert score.wrong == 2


def test_every_category_is_a_scene_of_the_twin() -> None:
    assert {each.scene for each in CATEGORIES.values()} <= set(SCENES)
    with pytest.raises(ConfigError, match="no scene 'none'"):
        Sequence("none", seed=0)


def test_poses_from_fiducials_are_as_far_off_as_the_noise_says() -> None:
    """Four points of two pixel coordinates, 0.1 px each, less six parameters: two degrees of freedom are left."""
    rig = example_rig()
    squares = []
    for seed in range(60):
        found = from_fiducials(rig, np.random.default_rng(seed))
        points = np.stack([each.position_mm for each in rig.markers["top"]])
        there, true = (CameraModel.of(each.cameras["top"]).project(points) for each in (found, rig))
        squares.append(np.square(there - true).sum() / 0.1**2)
    # chi-squared with six degrees of freedom, the mean of 60: 6 and a standard error of sqrt(2 * 6 / 60) = 0.45
    assert abs(float(np.mean(squares)) - 6.0) < 4.0 * 0.45


def test_a_resized_camera_sees_the_same() -> None:
    camera = example_rig().cameras["top"]
    larger = resized(camera, (1920, 1080))
    points = np.array([[60.0, 10.0, 5.0], [20.0, -30.0, 12.0]])
    small, large = CameraModel.of(camera).project(points), CameraModel.of(larger).project(points)
    middle, scale = 0.5 * (np.array(camera.size_px) - 1.0), 1.5
    assert large == pytest.approx(scale * (small - middle) + 0.5 * (np.array([1920, 1080]) - 1.0), abs=1e-9)


def test_the_calibration_alone_costs_more_far_from_the_fiducials_planes() -> None:
    inner, corner = calibration_alone(np.array([[60.0, 0.0, 0.0], [120.0, -60.0, 60.0]]), draws=30, seed=3)
    assert 0.0 < inner < corner < 1.0


def test_exact_poses_are_better_than_measured_ones_on_the_same_pictures() -> None:
    exact, posed = measured("smooth", seeds=(3,), pairs=6)
    assert exact.pairs == posed.pairs == 6
    assert exact.rms_mm < posed.rms_mm
    assert replace(exact).quantile_mm(1.0) == max(exact.tip_mm)


def test_only_what_stands_between_the_markers_is_replaced() -> None:
    page = f"# Accuracy\n\nwords\n{BEGIN}\nold\n{END}\nmore words\n"
    assert written_between(page, "new") == f"# Accuracy\n\nwords\n{BEGIN}\nnew\n{END}\nmore words\n"
    assert written_between("", "new") == f"# Accuracy\n\n{BEGIN}\nnew\n{END}\n"
