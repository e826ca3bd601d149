"""A lens from views of a board: exact on exact corners, honest about its errors, and clear about bad views."""

import dataclasses

import numpy as np
import pytest

from cathxr.calibration.board import Board, parse_board
from cathxr.calibration.board_views import BoardView, RejectedView
from cathxr.calibration.intrinsics import LEAST_VIEWS, IntrinsicsResult, calibrate_intrinsics
from cathxr.calibration.intrinsics_drawing import coverage_png, residual_png
from cathxr.core import CalibrationError, FloatArray, Intrinsics, Pose
from cathxr.geometry import CameraModel
from cathxr.geometry.pose import pose_from_vector

SIZE_PX = (1280, 720)
BOARD = parse_board("charuco:10x10:10.0:7.0:DICT_4X4_50")
TODAY = "2026-01-31"


def lens_of(rng: np.random.Generator) -> Intrinsics:
    """Return a lens such as a box may have."""
    focal = 1357.7 * rng.uniform(0.9, 1.1)
    return Intrinsics(
        focal * np.array([1.0, 1.0 + rng.uniform(-0.002, 0.002)]),
        np.array([640.0, 360.0]) + rng.uniform(-15.0, 15.0, size=2),
        np.array([-0.18, 0.06, 0.0, 0.0, 0.0]) + rng.uniform(-1.0, 1.0, size=5) * [0.05, 0.03, 1e-3, 1e-3, 0.0],
    )


def poses(rng: np.random.Generator, count: int, *, tilt_deg: float = 35.0, spread: float = 1.0) -> list[Pose]:
    """Return camera_from_board all over the picture, tilted to all sides."""
    result = []
    middle = BOARD.corners_mm.mean(axis=0)
    for i in range(count):
        way, tilt = 2.0 * np.pi * i / 5.0 + rng.uniform(-0.3, 0.3), np.deg2rad(tilt_deg) * rng.uniform(0.5, 1.0)
        turn = pose_from_vector(np.array([tilt * np.cos(way), tilt * np.sin(way), 0.0, 0.0, 0.0, 0.0]))
        depth = rng.uniform(230.0, 330.0)
        shift = spread * rng.uniform(-1.0, 1.0, size=2) * [0.28 * depth, 0.12 * depth]
        result.append(Pose(turn.rotation_wxyz, np.array([*shift, depth]) - turn.rotation @ middle))
    return result


def views_of(
    lens: Intrinsics, places: list[Pose], rng: np.random.Generator, *, noise_px: float, board: Board = BOARD
) -> list[BoardView]:
    """Return what a perfect detector with so much noise would see; corners outside the picture are not seen."""
    model = CameraModel(lens, Pose.identity(), SIZE_PX)
    result = []
    for number, pose in enumerate(places):
        seen = board.corners_mm @ pose.rotation.T + pose.translation_mm
        pixels = model.pixels_from_normalised(seen[:, :2] / seen[:, 2:])
        ids = np.flatnonzero(model.inside(pixels, margin_px=5.0))
        noisy = pixels[ids] + noise_px * rng.standard_normal((len(ids), 2))
        result.append(BoardView(f"view{number:02d}.png", SIZE_PX, ids, noisy, 1.0, 40.0))
    return result


def solved(views: list[BoardView], **options: bool) -> IntrinsicsResult:
    """Return the calibration of views."""
    return calibrate_intrinsics(BOARD, views, size_px=SIZE_PX, date=TODAY, **options)


def vector(lens: Intrinsics) -> FloatArray:
    """Return the lens as (9,), in the order of its covariance."""
    return np.concatenate([lens.focal_px, lens.centre_px, lens.distortion])


def test_exact_corners_give_the_exact_lens() -> None:
    rng = np.random.default_rng(1)
    lens = lens_of(rng)
    result = solved(views_of(lens, poses(rng, 15), rng, noise_px=0.0))
    # The weak prior on the distortion pulls by far less than any camera's noise would.
    np.testing.assert_allclose(result.intrinsics.focal_px, lens.focal_px, atol=0.02)
    np.testing.assert_allclose(result.intrinsics.centre_px, lens.centre_px, atol=0.02)
    stated = result.intrinsics.provenance
    assert (stated.n, stated.date) == (15, TODAY)
    assert stated.rms_px is not None
    assert stated.rms_px < 1e-3
    assert stated.covariance is not None
    assert stated.covariance.shape == (9, 9)
    np.testing.assert_allclose(np.sqrt(np.diag(stated.covariance))[:2], stated.std["focal_px"], rtol=1e-9)


def test_stated_errors_are_those_made() -> None:
    normalised = []
    for seed in range(24):
        rng = np.random.default_rng([seed, 7])
        lens = lens_of(rng)
        result = solved(views_of(lens, poses(rng, 14), rng, noise_px=0.1))
        covariance = result.intrinsics.provenance.covariance
        assert covariance is not None
        normalised.append((vector(result.intrinsics) - vector(lens)) / np.sqrt(np.diag(covariance)))
    rms = np.sqrt(np.mean(np.square(normalised), axis=0))
    # 24 boxes: the rms of 24 unit normals is 1 with a standard deviation of 0.14; k3's prior, which holds the true
    # value, makes the distortion's errors smaller than they might be. `make prove` uses more, and pictures.
    assert (rms[:4] > 0.6).all()
    assert (rms[:4] < 1.45).all()
    assert (rms[4:] < 1.45).all()


def test_an_outlier_is_named_and_left_out() -> None:
    rng = np.random.default_rng(3)
    lens = lens_of(rng)
    views = views_of(lens, poses(rng, 14), rng, noise_px=0.05)
    spoiled = views[4].corners_px + 3.0 * rng.standard_normal(views[4].corners_px.shape)
    views[4] = dataclasses.replace(views[4], corners_px=spoiled)
    result = solved(views)
    assert [each.name for each in result.rejected] == ["view04.png"]
    assert "outlier" in result.rejected[0].reason
    assert abs(result.intrinsics.focal_px[0] - lens.focal_px[0]) < 4.0 * result.intrinsics.provenance.std["focal_px"][0]


def test_blurred_repeated_and_foreign_views_are_named() -> None:
    rng = np.random.default_rng(4)
    views = views_of(lens_of(rng), poses(rng, 12), rng, noise_px=0.05)
    views[1] = dataclasses.replace(views[1], sharpness=0.2)
    views[2] = dataclasses.replace(views[3], name=views[2].name, corners_px=views[3].corners_px + 0.01)
    views[5] = dataclasses.replace(views[5], size_px=(640, 480))
    result = solved(views)
    reasons = {each.name: each.reason for each in result.rejected}
    assert "blurred" in reasons["view01.png"]
    assert any("the same view" in reason for reason in reasons.values())
    assert "640x480" in reasons["view05.png"]


def test_too_few_views_say_how_many_are_needed_and_why_others_were_not_used() -> None:
    rng = np.random.default_rng(5)
    views = views_of(lens_of(rng), poses(rng, LEAST_VIEWS - 1), rng, noise_px=0.05)
    with pytest.raises(CalibrationError, match=rf"at least {LEAST_VIEWS} are needed.*dark.png: too dark"):
        calibrate_intrinsics(BOARD, views, size_px=SIZE_PX, date=TODAY, rejected=[RejectedView("dark.png", "too dark")])


def test_views_all_alike_are_refused_with_what_to_do() -> None:
    rng = np.random.default_rng(6)
    # Facing the camera squarely at one distance, only shifted: focal length and distance cannot be told apart.
    flat = [Pose(np.array([1.0, 0.0, 0.0, 0.0]), np.array([-50.0 + 4.0 * i, -50.0, 300.0])) for i in range(10)]
    lens = Intrinsics(np.array([1357.7, 1357.7]), np.array([640.0, 360.0]))
    with pytest.raises(CalibrationError, match="tilt the board"):
        solved(views_of(lens, flat, rng, noise_px=0.1))


def test_a_wrong_board_is_refused() -> None:
    rng = np.random.default_rng(7)
    oblong = dataclasses.replace(BOARD)
    views = views_of(lens_of(rng), poses(rng, 12), rng, noise_px=0.05, board=oblong)
    swapped = Board("charuco", 7, 13, 10.0, 7.0, "DICT_4X4_50")
    short = [dataclasses.replace(each, ids=each.ids[:60], corners_px=each.corners_px[:60]) for each in views]
    with pytest.raises(CalibrationError, match="board"):
        calibrate_intrinsics(swapped, short, size_px=SIZE_PX, date=TODAY)


def test_the_pictures_of_a_result_are_pictures() -> None:
    rng = np.random.default_rng(8)
    result = solved(views_of(lens_of(rng), poses(rng, 8), rng, noise_px=0.1))
    for png in (coverage_png(result), residual_png(result)):
        assert png.startswith(b"\x89PNG")
        assert len(png) > 10_000
