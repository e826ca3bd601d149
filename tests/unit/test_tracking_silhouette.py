"""Whole silhouettes against plain NumPy: the search over depths, the discs, and catheters that lie over themselves."""

from dataclasses import replace
from itertools import product
from typing import Any

import cv2
import numpy as np
import pytest

from cathxr.app.bench_scenes import Sequence
from cathxr.app.bench_sequence import Method
from cathxr.core import Detection, FloatArray, Status
from cathxr.geometry import CameraModel, resampled
from cathxr.storage.rig_file import example_rig
from cathxr.tracking import model
from cathxr.tracking.depth_search import MOST_SLOPE, STEP_MM, best_depths, entry_costs, point_costs
from cathxr.tracking.fit import CurveFit, camera_table
from cathxr.tracking.pair_work import DISCS, PairWork
from cathxr.tracking.rim_kernels import distances, held, invented, set_discs, unexplained
from cathxr.tracking.silhouette import SilhouetteFit
from cathxr.tracking.solve import Solution, solved
from cathxr.vision.rim import CUT_PX, rim_of
from cathxr.vision.segmentation import Window

CUT = 100.0


def closed(ring: FloatArray) -> FloatArray:
    return np.vstack([ring, ring[:1]])


def tube(x: FloatArray, y: FloatArray, radius: float) -> FloatArray:
    """Return DISCS discs (S, 3) along a line that is given by a few points."""
    at = np.linspace(0.0, len(x) - 1.0, DISCS)
    whole = np.arange(len(x))
    return np.stack([np.interp(at, whole, x), np.interp(at, whole, y), np.full(DISCS, radius)], axis=1)


def box(x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """Return a rectangle's outline (R, 2), a point a pixel, closed."""
    across, down = np.arange(x0, x1), np.arange(y0, y1)
    return closed(
        np.concatenate(
            [
                np.stack([across, np.full(len(across), y0)], 1),
                np.stack([np.full(len(down), x1), down], 1),
                np.stack([across[::-1] + 1.0, np.full(len(across), y1)], 1),
                np.stack([np.full(len(down), x0), down[::-1] + 1.0], 1),
            ]
        )
    )


def test_the_best_way_through_depths_is_the_best_of_all() -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        costs, entry = rng.uniform(0.0, 4.0, (4, 6)), rng.uniform(0.0, 4.0, 6)
        least = np.inf
        for way in product(range(6), repeat=4):
            slopes = np.diff(way)
            turns = np.diff(slopes)
            if np.abs(slopes).max() > MOST_SLOPE or np.abs(turns).max() > 2:
                continue
            least = min(least, costs[range(4), way].sum() + entry[way[-1]] + 0.5 * float((turns**2).sum()))
        got = best_depths(costs, entry)
        bends = float((np.diff(np.diff(got)) ** 2).sum())
        assert costs[range(4), got].sum() + entry[got[-1]] + 0.5 * bends == pytest.approx(least)


def test_a_depth_costs_what_its_tube_sticks_out() -> None:
    camera = CameraModel.of(example_rig().cameras["front"])
    origin, ray = np.array([60.0, 0.0, 330.0]), np.array([[0.0, 0.0, -1.0]])
    seen = camera.project(origin + (300.0 + STEP_MM * np.arange(100))[:, None] * ray[0])
    corner = np.floor(seen.min(axis=0)) - 20.0
    width, height = (np.ceil(seen.max(axis=0)) + 20.0 - corner).astype(int)
    clearance = np.full((height, width), -5.0)
    middle = np.round(seen[40] - corner).astype(int)
    clearance[middle[1] - 2 : middle[1] + 3, :] = 30.0
    got = point_costs(origin, ray, 300.0, 100, camera.numbers, clearance, np.zeros_like(clearance), corner, 1.5)[0]
    rows = np.round(seen[:, 1] - corner[1]).astype(int)
    np.testing.assert_array_equal(got < 1.0, np.abs(rows - middle[1]) <= 2)
    axis = entry_costs(origin, ray[0], 300.0, 100)
    assert abs(float(300.0 + STEP_MM * np.argmin(axis)) - 330.0) <= STEP_MM


def test_distances_to_a_tube_are_those_of_its_segments() -> None:
    discs = tube(np.array([0.0, 60.0, 60.0]), np.array([0.0, 0.0, 40.0]), 5.0)
    points = np.random.default_rng(1).uniform(-20.0, 80.0, (40, 2))
    steps = np.diff(discs[:, :2], axis=0)
    offset = points[:, None] - discs[None, :-1, :2]
    share = np.clip((offset * steps).sum(axis=2) / np.square(steps).sum(axis=1), 0.0, 1.0)
    expected = np.linalg.norm(offset - share[..., None] * steps, axis=2).min(axis=1) - 5.0
    np.testing.assert_allclose(distances(discs, points), expected, atol=1e-9)


def test_what_is_left_of_a_rim_is_told() -> None:
    off = np.array([0.0, 0.1, 2.0, 2.0, 2.0, 0.0, 2.0, 0.0])
    share, run, rms, _ = unexplained(off, np.zeros(8), (0, 8), 1.0)
    assert (share, run) == (0.5, 3)
    assert rms == pytest.approx(np.sqrt(np.mean(np.square(np.minimum(off, 1.0)))))


def test_how_far_a_rim_is_off_is_told_whatever_lies_in_its_corners() -> None:
    off = np.random.default_rng(2).normal(0.0, 0.1, 2000)
    off[::40] = 2.0  # where parts of the catheter meet
    _, _, _, clean = unexplained(off, np.zeros(2000), (0, 2000), 1.0)
    assert clean == pytest.approx(0.1, rel=0.15)
    off[::5] = 2.0  # and where they do not
    _, _, _, otherwise = unexplained(off, np.zeros(2000), (0, 2000), 1.0)
    assert otherwise > 0.35


def test_a_tube_beyond_the_silhouette_is_invented() -> None:
    rim = box(0.0, 0.0, 100.0, 12.0)
    sigma = np.full(len(rim), 0.1)
    inside = tube(np.array([8.0, 92.0]), np.array([6.0, 6.0]), 6.0)
    beyond = tube(np.array([8.0, 150.0]), np.array([6.0, 6.0]), 6.0)
    assert invented(inside, rim, sigma, CUT, 0.35) == 0
    assert invented(beyond, rim, sigma, CUT, 0.35) == np.count_nonzero(beyond[:, 0] > 100.0 - 0.65 * 6.0)
    sigma[rim[:, 0] == 100.0] = 1000.0  # the inlet's cut: nothing is known beyond
    assert invented(beyond, rim, sigma, CUT, 0.35) == 0
    hole = np.vstack([rim, box(40.0, 4.0, 60.0, 8.0)])  # nor is there anything in a hole
    assert invented(inside, hole, np.full(len(hole), 0.1), CUT, 0.35) > 20


def test_a_hidden_part_is_held_in_the_middle_of_its_room() -> None:
    rim = box(0.0, 0.0, 100.0, 16.0)
    discs = tube(np.array([10.0, 90.0, 90.0, 10.0]), np.array([6.0, 6.0, 9.0, 9.0]), 6.0)
    rows = np.zeros((DISCS, 6))
    count = held(discs, rim, np.full(len(rim), 0.1), CUT, rows)
    # both limbs show at the rim, one above and one below: nothing of them is hidden
    assert count < 8
    slim = tube(np.array([10.0, 90.0, 90.0, 10.0]), np.array([6.0, 6.0, 7.0, 7.0]), 6.0)
    slim[DISCS // 2 :, 2] = 5.0  # the other limb lies behind, and is seen smaller
    count = held(slim, box(0.0, 0.0, 100.0, 12.0), np.full(len(box(0.0, 0.0, 100.0, 12.0)), 0.1), CUT, rows)
    behind = rows[:count][rows[:count, 0] > 0.6]
    assert len(behind) > 5
    np.testing.assert_allclose(behind[:, 2], 6.0, atol=0.6)
    assert (behind[:, 5] < 1.6).all()


def test_the_rim_is_the_edge_to_a_part_of_a_pixel() -> None:
    height, width = 120, 260
    rows, columns = np.mgrid[:height, :width]
    edge = np.clip(8.3 - np.abs(rows - 60.2) + 0.5, 0.0, 1.0) * np.clip(201.7 - columns + 0.5, 0.0, 1.0)
    matte = cv2.GaussianBlur((0.8 * edge).astype(np.float32), (0, 0), 0.8)
    mask = np.where(matte[2::4, 2::4] > 0.2, 255, 0).astype(np.uint8)
    axis = np.stack([np.linspace(0.0, 120.0, 46), np.full(46, 60.0)], axis=1)
    rim = rim_of(matte, mask, 4, Window(0, 0, width, height), 0.8, axis, 16.0)
    assert rim is not None
    np.testing.assert_array_equal(rim.points[0], rim.points[-1])
    sides = (rim.sigma < CUT_PX) & (rim.points[:, 0] < 190.0)
    assert np.count_nonzero(sides) > 100
    np.testing.assert_allclose(np.abs(rim.points[sides, 1] - 60.2), 8.3, atol=0.1)
    assert rim_of(np.zeros_like(matte), mask, 4, Window(0, 0, width, height), 0.8, axis, 16.0) is None


@pytest.mark.parametrize(("scene", "seed"), [("curl", 5), ("crossing", 6)])
def test_a_catheter_over_itself_in_one_view_is_found_at_once(scene: str, seed: int) -> None:
    sequence = Sequence(scene, seed=seed)
    method = Method("model", sequence)
    tracked = 0
    for pair in sequence.pairs(45, 15.0):
        if pair.seq % 4:
            continue
        method.tracker.reset()
        _, track, _ = method.track(pair, whole=True)
        if track.status is Status.TRACKED:
            tracked += 1
            assert track.tip_box is not None
            assert pair.truth.tip_box is not None
            assert np.linalg.norm(track.tip_box - pair.truth.tip_box) < 2.0
    assert tracked >= 8  # of 12; two limbs that cover each other have more than one answer, and the status says so


def test_each_view_is_asked_about_its_own_rim(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[tuple[SilhouetteFit, CurveFit, list[Detection], FloatArray]] = []
    explained = SilhouetteFit.explained

    def kept(self: SilhouetteFit, fit: CurveFit, detections: list[Detection], balls: FloatArray) -> tuple[bool, bool]:
        taken.append((self, fit, detections, balls.copy()))
        return explained(self, fit, detections, balls)

    monkeypatch.setattr(SilhouetteFit, "explained", kept)
    sequence = Sequence("smooth", seed=3)
    Method("model", sequence).track(next(iter(sequence.pairs(1, 30.0))))
    asked, fit, (top, front), balls = taken[0]
    assert len(front.rim_px) > 100
    nothing = replace(top, rim_px=np.zeros((0, 2)), rim_sigma_px=np.zeros(0))
    assert explained(asked, fit, [nothing, front], balls) == (True, True)
    unknown = replace(top, rim_sigma_px=np.full(len(top.rim_px), 1000.0))
    assert explained(asked, fit, [unknown, front], balls) == (False, True)
    elsewhere = replace(front, rim_px=np.add(front.rim_px, [0.0, 40.0]))
    assert explained(asked, fit, [nothing, elsewhere], balls) == (False, False)


def test_both_silhouettes_find_a_catheter_that_lies_over_itself_from_a_millimetre_off() -> None:
    sequence = Sequence("crossing", seed=6, calibration="exact")
    method = Method("model", sequence)
    cameras = [CameraModel.of(sequence.rig.cameras[each]) for each in ("top", "front")]
    table, radius = camera_table(cameras), 0.5 * sequence.rig.catheter.diameter_mm
    fit = SilhouetteFit(cameras, table, radius_mm=radius, roi=sequence.rig.roi)
    rng = np.random.default_rng(0)
    found = tried = 0
    for pair in sequence.pairs(45, 15.0):
        if pair.seq % 4:
            continue
        observation, _, _ = method.track(pair, whole=True)
        assert pair.truth.shape_box is not None
        shape = resampled(pair.truth.shape_box, 1000)
        cap = int(np.searchsorted(np.linalg.norm(shape - shape[0], axis=1), radius))
        true = shape[cap:]
        off = rng.normal(size=(1, 3))
        off = off * np.linspace(1.0, 0.0, len(true))[:, None] ** 2 / np.linalg.norm(off)
        tried += 1
        solution = fit.found(observation.detections, PairWork(), true + off, search=False)
        if solution is not None:
            found += 1
            ends = np.linalg.norm(solution.fit.control[0] - true[0])
            assert ends < 0.4, pair.seq
            discs = np.zeros((DISCS, 3))
            for view, each in enumerate(observation.detections):
                set_discs(solution.fit.spans, solution.fit.control, table, view, radius, discs)
                seen = each.rim_sigma_px < CUT
                first = sum(int((one.rim_sigma_px < CUT).sum()) for one in observation.detections[:view])
                off_px = solution.fit.end_off_px[first : first + int(seen.sum())]
                apart = np.abs(off_px - distances(discs, each.rim_px[seen]))
                # what is said of each point belongs to the curve that is given
                assert np.quantile(apart, 0.95) < 0.6
    assert found >= tried - 1


@pytest.mark.parametrize(("apart_mm", "status"), [(0.1, Status.TRACKED), (2.0, Status.COASTING)])
def test_two_curves_that_explain_all_make_the_tip_as_unsure_as_they_are_apart(
    monkeypatch: pytest.MonkeyPatch, apart_mm: float, status: Status
) -> None:
    fitted: list[Solution] = []

    def doubtful(*args: Any, **kwargs: Any) -> Solution | str:
        solution = solved(*args, **kwargs)
        assert isinstance(solution, Solution)
        fitted.append(replace(solution, doubtful="top"))
        return fitted[-1]

    def other(*_: Any, **__: Any) -> Solution:
        fit = fitted[-1].fit
        return Solution(replace(fit, control=fit.control + np.array([0.0, apart_mm, 0.0])), 0.05)

    monkeypatch.setattr(model, "solved", doubtful)
    monkeypatch.setattr(SilhouetteFit, "found", other)
    sequence = Sequence("smooth", seed=3)
    _, track, _ = Method("model", sequence).track(next(iter(sequence.pairs(1, 30.0))))
    assert track.status is status
    assert track.sigma_mm is not None
    assert track.sigma_mm > apart_mm if apart_mm > 1.0 else track.sigma_mm < 0.2
    assert ("not resolved" in track.reason) == (status is Status.COASTING)
