"""Views of different instants: the compiled loops against plain NumPy, and the twin's scene with skew."""

import numpy as np
import pytest

from cathxr.app.bench_scenes import Sequence
from cathxr.app.bench_sequence import Method
from cathxr.core import Status
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.tracking.pair_work import fit_work
from cathxr.tracking.skew import at_instant, shift_view

TIMES_S = (0.012, -0.021, -0.055)


@pytest.fixture
def curves() -> list[np.ndarray]:
    """Three curves (K, 3) mm of one view, the newest first."""
    rng = np.random.default_rng(5)
    return [rng.uniform(-1.0, 1.0, size=(40, 3)) for _ in range(3)]


def test_a_view_is_moved_by_the_parabola_through_its_last_three_instants(curves: list[np.ndarray]) -> None:
    result = np.zeros((40, 3))
    at_instant(*curves, TIMES_S, result)
    expected = np.zeros((40, 3))
    for i, curve in enumerate(curves):
        others = [each for j, each in enumerate(TIMES_S) if j != i]
        expected += curve * np.prod([(0.0 - each) / (TIMES_S[i] - each) for each in others])
    np.testing.assert_allclose(result, expected, atol=1e-12)


def test_two_instants_give_a_straight_line_and_one_no_motion(curves: list[np.ndarray]) -> None:
    result = np.zeros((40, 3))
    at_instant(*curves, (0.012, -0.021, 0.0), result)
    np.testing.assert_allclose(result, curves[0] + 0.012 / 0.033 * (curves[1] - curves[0]), atol=1e-12)
    at_instant(*curves, (0.012, 0.0, 0.0), result)
    np.testing.assert_array_equal(result, curves[0])


def test_nothing_moves_faster_than_a_hand(curves: list[np.ndarray]) -> None:
    result = np.zeros((40, 3))
    at_instant(curves[0], curves[1] + 500.0, curves[2], (0.016, -0.017, 0.0), result)
    np.testing.assert_allclose(np.linalg.norm(result - curves[0], axis=1), 5.0)


def test_measured_points_move_as_the_curve_does() -> None:
    camera = CameraModel.of(example_rig().cameras["front"])
    t = np.linspace(0.0, 1.0, 100)
    there = np.stack([80.0 - 80.0 * t, 10.0 * np.sin(2.0 * t), 15.0 * (1.0 - t) ** 2], axis=1)
    moved = np.stack([1.0 - t, 0.5 * (1.0 - t), -2.0 * (1.0 - t)], axis=1)
    work = fit_work(30, 10, 2)
    places = np.linspace(0.0, 1.0, 25)
    exact = np.stack([np.interp(places, t, there[:, axis]) for axis in range(3)], axis=1)
    before = exact - np.stack([np.interp(places, t, moved[:, axis]) for axis in range(3)], axis=1)
    work.at[5:30] = places
    work.at[10] = -1.0  # without a place of its own: it goes with the point before
    work.curve[5:30] = camera.project(exact)
    work.end[3:10] = camera.project(there[:7])
    shift_view(camera.numbers, moved, there, (5, 30), (3, 10), work)
    others = np.arange(25) != 5
    np.testing.assert_allclose(work.curve[5:30][others], camera.project(before)[others], atol=0.01)
    np.testing.assert_allclose(work.end[3:10], camera.project(there[:7] - moved[:7]), atol=1e-9)
    as_before = camera.project(exact[5:6]) + camera.project(before[4:5]) - camera.project(exact[4:5])
    np.testing.assert_allclose(work.curve[10:11], as_before, atol=0.01)
    assert not work.curve[:5].any()
    assert not work.end[:3].any()


def test_a_front_camera_twelve_milliseconds_late_costs_no_accuracy_once_the_motion_is_known() -> None:
    sequence = Sequence("skew", seed=4)
    method = Method("model", sequence)
    errors, normalised = [], []
    for pair in sequence.pairs(12, 30.0):
        track = method.track(pair)[1]
        if pair.seq < 3:
            continue
        assert track.status is Status.TRACKED
        assert track.tip_box is not None
        assert track.sigma_mm is not None
        assert pair.truth.tip_box is not None
        errors.append(float(np.linalg.norm(track.tip_box - pair.truth.tip_box)))
        normalised.append(errors[-1] / track.sigma_mm)
    # without the correction 0.47 on average: 100 mm/s for 12 ms, seen by one camera of two
    assert np.mean(errors) < 0.06
    assert np.sqrt(np.mean(np.square(normalised))) < 2.0
