"""The one policy on what happens without a fresh pose: coast a moment, then lost."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cathxr.core import Detection, Observation, Pose, Status, Track
from cathxr.geometry.pose import turned_about_z
from cathxr.tracking.continuity import COAST_NS, COAST_SPEED_MM_S, Continuity, missing_reason

START_NS = 10**12


def seen(camera: str, repeats: int = 0) -> Detection:
    """Return a detection with a curve."""
    return Detection(
        camera,
        0,
        START_NS,
        curve_px=np.zeros((2, 2)),
        normal_px=np.ones((2, 2)),
        sigma_px=np.ones(2),
        half_width_px=np.ones(2),
        tip_px=np.zeros(2),
        tip_sigma_px=1.0,
        repeats=repeats,
    )


def unseen(camera: str, reason: str, repeats: int = 0) -> Detection:
    """Return a detection that says why there is none."""
    return Detection(camera, 0, START_NS, reason=reason, repeats=repeats)


def observation(age_ns: int = 0, *detections: Detection) -> Observation:
    """Return an observation some time after the start."""
    return Observation(7, START_NS + age_ns, detections)


def tracked(**changes: Any) -> Track:
    """Return a tracked Track at the start."""
    fields: dict[str, Any] = {
        "shape_box": np.array([[50.0, 1.0, 2.0], [0.0, 0.0, 0.0]]),
        "box_from_tip": Pose.identity(),
        "roll_rad": 0.4,
        "sigma_mm": 0.3,
    }
    return Track(3, START_NS, Status.TRACKED, **(fields | changes))


@pytest.mark.parametrize(
    ("detections", "reason"),
    [
        ((seen("top"), seen("front")), None),
        ((unseen("top", "no catheter"), seen("front")), None),  # a picture without a catheter is news
        ((unseen("top", "no catheter"), unseen("front", "black picture")), None),
        ((unseen("top", "no picture from top"), seen("front")), "no picture from top"),
        ((seen("top"), unseen("front", "no picture from front")), "no picture from front"),
        ((unseen("top", "no picture from top"), unseen("front", "no picture from front")), "no picture from top"),
        ((seen("top"),), "no picture from one camera"),
        ((), "no picture from one camera"),
        ((seen("top", repeats=1), seen("front")), "frozen picture from top"),
        ((seen("top"), seen("front", repeats=9)), "frozen picture from front"),
        ((seen("top", repeats=1), seen("front", repeats=2)), "frozen pictures"),
        ((unseen("top", "no catheter", repeats=1), seen("front")), "frozen picture from top"),
        ((unseen("top", "no picture from top"), seen("front", repeats=1)), "no picture from top"),
    ],
)
def test_what_brings_no_news(detections: tuple[Detection, ...], reason: str | None) -> None:
    assert missing_reason(observation(0, *detections)) == reason


def test_a_tracked_track_passes_unchanged() -> None:
    one = tracked()
    assert Continuity().tracked(one) is one


@pytest.mark.parametrize("age_ns", [0, 20_000_000, COAST_NS])
def test_it_coasts_on_the_last_pose_with_a_growing_sigma(age_ns: int) -> None:
    policy = Continuity()
    last = policy.tracked(tracked())
    got = policy.coasting(replace(observation(age_ns), roll_rad=0.4), "no picture from top")
    assert got.status is Status.COASTING
    assert got.reason == "no picture from top"
    assert (got.seq, got.t_ns) == (7, START_NS + age_ns)
    assert got.shape_box is not None
    np.testing.assert_array_equal(got.shape_box, last.shape_box)
    assert got.box_from_tip is last.box_from_tip
    assert got.roll_rad == last.roll_rad
    wandered = COAST_SPEED_MM_S * age_ns * 1e-9
    assert got.sigma_mm == pytest.approx(np.sqrt(0.3**2 + wandered**2), rel=1e-12)


@pytest.mark.parametrize(("roll_rad", "turned_rad"), [(1.1, 0.7), (None, -0.4)])
def test_the_roll_goes_on_while_pictures_are_missing(roll_rad: float | None, turned_rad: float) -> None:
    policy = Continuity()
    policy.tracked(tracked())
    got = policy.coasting(replace(observation(20_000_000), roll_rad=roll_rad), "frozen pictures")
    assert got.roll_rad == roll_rad
    assert got.box_from_tip is not None
    expected = turned_about_z(np.eye(3), turned_rad)  # the last orientation was that of roll 0.4, now it is roll's or 0
    np.testing.assert_allclose(got.box_from_tip.rotation, expected, atol=1e-12)  # rounding


def test_after_the_stated_time_it_is_lost_and_stays_lost() -> None:
    policy = Continuity()
    policy.tracked(tracked())
    late = policy.coasting(observation(COAST_NS + 1), "no picture from top")
    assert late.status is Status.LOST
    assert late.reason == "no picture from top"
    # What was dropped does not come back, whatever the next instant says.
    assert policy.coasting(observation(0), "no picture from top").status is Status.LOST


def test_coasting_is_counted_from_the_last_tracked_pose() -> None:
    policy = Continuity()
    policy.tracked(tracked())
    for part in (0.4, 0.8):
        assert policy.coasting(observation(round(part * COAST_NS)), "frozen pictures").status is Status.COASTING
    assert policy.coasting(observation(round(1.2 * COAST_NS)), "frozen pictures").status is Status.LOST


def test_a_fresh_pose_starts_the_time_anew() -> None:
    policy = Continuity()
    policy.tracked(tracked())
    policy.coasting(observation(COAST_NS), "frozen pictures")
    policy.tracked(replace(tracked(), t_ns=START_NS + COAST_NS))
    got = policy.coasting(observation(2 * COAST_NS), "frozen pictures")
    assert got.status is Status.COASTING
    assert got.sigma_mm == pytest.approx(np.hypot(0.3, COAST_SPEED_MM_S * COAST_NS * 1e-9))


def test_time_that_runs_backwards_is_lost() -> None:
    policy = Continuity()
    policy.tracked(tracked())
    assert policy.coasting(observation(-1), "no picture from top").status is Status.LOST


def test_without_a_last_pose_there_is_nothing_to_coast_on() -> None:
    got = Continuity().coasting(observation(0), "no picture from top")
    assert got.status is Status.LOST
    assert got.shape_box is None


@pytest.mark.parametrize("how", ["lost", "reset"])
def test_losing_or_resetting_forgets(how: str) -> None:
    policy = Continuity()
    policy.tracked(tracked())
    if how == "lost":
        got = policy.lost(observation(5), "no catheter (top)")
        assert (got.status, got.reason, got.seq, got.t_ns) == (Status.LOST, "no catheter (top)", 7, START_NS + 5)
    else:
        policy.reset()
    assert policy.coasting(observation(10), "no picture from top").status is Status.LOST
