"""Track: a pose when there is one, a reason when there is none, never anything between."""

from typing import Any

import numpy as np
import pytest

from cathxr.core import Event, Health, Pose, Status, Track

SHAPE = np.array([[30.0, 4.0, 0.0], [30.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def track(status: Status = Status.TRACKED, **changes: Any) -> Track:
    """Return a Track with a pose, with some fields replaced."""
    fields: dict[str, Any] = {
        "reason": "" if status is Status.TRACKED else "no picture from top",
        "shape_box": SHAPE,
        "box_from_tip": Pose.identity(),
        "sigma_mm": 0.1,
    }
    return Track(1, 2, status, **(fields | changes))


def lost(**changes: Any) -> Track:
    """Return a lost Track, with some fields replaced."""
    fields: dict[str, Any] = {"reason": "no catheter"}
    return Track(1, 2, Status.LOST, **(fields | changes))


def test_status_is_written_as_the_wire_says() -> None:
    assert [each.value for each in Status] == ["tracked", "coasting", "lost"]


@pytest.mark.parametrize("status", [Status.TRACKED, Status.COASTING])
@pytest.mark.parametrize("name", ["shape_box", "box_from_tip", "sigma_mm"])
def test_a_track_with_a_pose_lacks_nothing(status: Status, name: str) -> None:
    track(status)
    with pytest.raises(ValueError, match="Track: expected shape, pose and sigma"):
        track(status, **{name: None})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"shape_box": SHAPE}, "none on a lost one"),
        ({"box_from_tip": Pose.identity()}, "none on a lost one"),
        ({"sigma_mm": 0.1}, "none on a lost one"),
        ({"roll_rad": 0.0}, "a lost Track carries no roll"),
        ({"reason": ""}, "expected a reason with status lost"),
    ],
)
def test_a_lost_track_carries_no_pose_and_says_why(changes: dict[str, Any], message: str) -> None:
    lost()
    with pytest.raises(ValueError, match=message):
        lost(**changes)


def test_a_coasting_track_says_why() -> None:
    with pytest.raises(ValueError, match="expected a reason with status coasting"):
        track(Status.COASTING, reason="")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"shape_box": np.zeros((3, 2))}, "shape_box: expected shape"),
        ({"shape_box": np.zeros(3)}, "shape_box: expected shape"),
        ({"shape_box": np.zeros((1, 3))}, "shape_box: expected at least 2 points, got 1"),
        ({"shape_box": np.full((2, 3), np.nan)}, "shape_box: expected finite"),
        ({"sigma_mm": np.nan}, "sigma_mm: expected a finite number"),
        ({"sigma_mm": np.inf}, "sigma_mm: expected a finite number"),
        ({"sigma_mm": -0.1}, "sigma_mm: expected a finite number"),
        ({"roll_rad": np.nan}, "roll_rad: expected a finite number"),
        ({"roll_rad": np.inf}, "roll_rad: expected a finite number"),
    ],
)
def test_numbers_that_mean_nothing_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        track(**changes)


def test_the_shape_is_a_read_only_copy() -> None:
    given = SHAPE.copy()
    one = track(shape_box=given)
    given[0] = 0.0
    np.testing.assert_array_equal(one.tip_box, SHAPE[0])
    assert one.shape_box is not None
    with pytest.raises(ValueError, match="read-only"):
        one.shape_box[0, 0] = 1.0


def test_length_is_that_of_the_polyline() -> None:
    assert track().length_mm == pytest.approx(34.0, rel=1e-15)


@pytest.mark.parametrize(
    ("direction", "yaw_deg", "pitch_deg"),
    [
        ([1.0, 0.0, 0.0], 0.0, 0.0),
        ([0.0, 1.0, 0.0], 90.0, 0.0),
        ([0.0, -1.0, 0.0], -90.0, 0.0),
        ([-1.0, 0.0, 0.0], 180.0, 0.0),
        ([np.sqrt(0.5), 0.0, np.sqrt(0.5)], 0.0, 45.0),
        ([0.0, 0.6, -0.8], 90.0, -np.rad2deg(np.arcsin(0.8))),
    ],
)
def test_yaw_and_pitch_are_those_of_the_tip_tangent(direction: list[float], yaw_deg: float, pitch_deg: float) -> None:
    z = np.array(direction)
    x = np.cross([0.3, -0.5, 0.9], z)
    x /= np.linalg.norm(x)
    one = track(box_from_tip=Pose.from_matrix(np.column_stack([x, np.cross(z, x), z]), SHAPE[0]))
    assert one.direction_box is not None
    assert one.yaw_rad is not None
    assert one.pitch_rad is not None
    # A unit quaternion gives back its matrix to a few roundings; asin is steep only near 90 degrees.
    np.testing.assert_allclose(one.direction_box, z, atol=1e-14)
    assert np.rad2deg(one.pitch_rad) == pytest.approx(pitch_deg, abs=1e-10)
    assert np.cos(one.yaw_rad - np.deg2rad(yaw_deg)) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("angle", [0.5, -0.5])
def test_a_tangent_straight_up_or_down_has_a_pitch(angle: float) -> None:
    # A rounding above 1 must not become NaN.
    half = angle * np.pi / 2
    one = track(box_from_tip=Pose(np.array([np.cos(half), 0.0, np.sin(half), 0.0]), SHAPE[0]))
    assert one.pitch_rad == pytest.approx(0.0, abs=1e-14)
    up = track(box_from_tip=Pose.identity())
    assert up.pitch_rad == pytest.approx(np.pi / 2, abs=1e-7)  # asin near 1 loses half the digits


@pytest.mark.parametrize("name", ["tip_box", "direction_box", "yaw_rad", "pitch_rad", "length_mm", "shape_box"])
def test_a_lost_track_answers_none(name: str) -> None:
    assert getattr(lost(), name) is None


def test_events_and_health_compare_by_value() -> None:
    assert Event(1, "steer", {"a": 1}) == Event(1, "steer", {"a": 1})
    assert Event(1, "steer") != Event(1, "steer", {"a": 1})
    assert Health(1, "top", True, None, 30.0, 0) == Health(1, "top", True, None, 30.0, 0, last_error=None)
