"""Pictures, readings and detections: what each noun accepts, what it refuses, and that nothing can be changed after."""

from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from cathxr.core import Detection, Image, Observation, Reading, RollStatus, Status, Track
from cathxr.core.arrays import checked


def found(**changes: Any) -> Detection:
    """Return a detection of three points, with some fields replaced."""
    fields: dict[str, Any] = {
        "camera": "top",
        "seq": 3,
        "t_ns": 5,
        "curve_px": np.arange(6.0).reshape(3, 2),
        "normal_px": np.tile([0.0, 1.0], (3, 1)),
        "sigma_px": np.full(3, 0.1),
        "half_width_px": np.full(3, 4.0),
        "tip_px": np.array([0.0, 1.0]),
        "tip_sigma_px": 0.2,
    }
    return Detection(**(fields | changes))


@pytest.mark.parametrize(
    ("values", "shape"),
    [
        (np.zeros(3), (4,)),
        (np.zeros((3, 2)), (None, 3)),
        (np.zeros((3, 2)), (3,)),
        (np.zeros(3), (3, None)),
        (0.0, (1,)),
        ([[0.0, 1.0]], (2, 2)),
    ],
)
def test_a_wrong_shape_is_refused_with_both_shapes(values: Any, shape: tuple[int | None, ...]) -> None:
    with pytest.raises(ValueError, match=r"^thing: expected shape .* got ") as refusal:
        checked("thing", values, shape)
    assert str(np.shape(values)) in str(refusal.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="thing: expected finite numbers"):
        checked("thing", [0.0, value], (2,))


def test_a_checked_array_is_a_read_only_copy() -> None:
    given = np.zeros((2, 3), dtype=np.float32)
    result = checked("thing", given, (None, 3))
    assert result.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        result[0, 0] = 1.0
    given[0, 0] = 1.0
    assert result[0, 0] == 0.0


@pytest.mark.parametrize("shape", [(4, 6), (4, 6, 3)])
def test_a_picture_gives_width_then_height(shape: tuple[int, ...]) -> None:
    assert Image("top", 0, 0, np.zeros(shape, dtype=np.uint8)).size_px == (6, 4)


@pytest.mark.parametrize(
    "pixels",
    [
        np.zeros((4, 6), dtype=np.float64),
        np.zeros((4, 6), dtype=np.uint16),
        np.zeros((4, 6, 4), dtype=np.uint8),
        np.zeros((4, 6, 1), dtype=np.uint8),
        np.zeros(4, dtype=np.uint8),
        np.zeros((1, 4, 6, 3), dtype=np.uint8),
        np.zeros((0, 6), dtype=np.uint8),
        np.zeros((4, 0, 3), dtype=np.uint8),
    ],
)
def test_what_is_no_picture_is_refused(pixels: Any) -> None:
    with pytest.raises(ValueError, match="pixels: expected"):
        Image("top", 0, 0, pixels)


def test_a_detection_holds_what_it_was_given() -> None:
    one = found()
    assert one.found
    assert one.reason is None
    assert one.repeats == 0
    np.testing.assert_array_equal(one.curve_px, np.arange(6.0).reshape(3, 2))


@pytest.mark.parametrize("name", ["curve_px", "normal_px", "sigma_px", "half_width_px", "tip_px"])
def test_a_detections_arrays_are_read_only(name: str) -> None:
    array = getattr(found(), name)
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 7.0


def test_a_detections_fields_cannot_be_set() -> None:
    with pytest.raises(FrozenInstanceError):
        found().seq = 4  # type: ignore[misc]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"curve_px": np.zeros((3, 3))}, "curve_px: expected shape"),
        ({"normal_px": np.zeros(6)}, "normal_px: expected shape"),
        ({"sigma_px": np.zeros((3, 1))}, "sigma_px: expected shape"),
        ({"half_width_px": np.zeros((1, 3))}, "half_width_px: expected shape"),
        ({"tip_px": np.zeros(3)}, "tip_px: expected shape"),
        ({"curve_px": np.full((3, 2), np.nan)}, "curve_px: expected finite"),
        ({"normal_px": np.zeros((2, 2))}, "expected 3 normals"),
        ({"sigma_px": np.ones(4)}, "expected 3 normals"),
        ({"half_width_px": np.ones(2)}, "expected 3 normals"),
        ({"sigma_px": np.array([0.1, -0.1, 0.1])}, "at least 0"),
        ({"half_width_px": np.array([0.1, -0.1, 0.1])}, "at least 0"),
        ({"tip_sigma_px": float("nan")}, "tip_sigma_px: expected a finite number"),
        ({"tip_sigma_px": -1.0}, "tip_sigma_px: expected a finite number"),
        ({"tip_px": None}, "either a curve with its tip, or a reason"),
        ({"tip_sigma_px": None}, "either a curve with its tip, or a reason"),
        ({"reason": "no catheter"}, "either a curve with its tip, or a reason"),
    ],
)
def test_a_detection_that_contradicts_itself_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        found(**changes)


@pytest.mark.parametrize("reason", [None, "no catheter"])
@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_points_are_no_curve(count: int, reason: str | None) -> None:
    fields: dict[str, Any] = {
        "curve_px": np.zeros((count, 2)),
        "normal_px": np.zeros((count, 2)),
        "sigma_px": np.zeros(count),
        "half_width_px": np.zeros(count),
    }
    if reason is None:
        with pytest.raises(ValueError, match="either a curve with its tip, or a reason"):
            found(**fields)
    elif count == 1:
        with pytest.raises(ValueError, match="either a curve with its tip, or a reason"):
            Detection("top", 0, 0, reason=reason, **fields)
    else:
        assert not Detection("top", 0, 0, reason=reason, **fields).found


def test_an_empty_detection_needs_a_reason() -> None:
    assert not Detection("top", 0, 0, reason="black picture").found
    with pytest.raises(ValueError, match="or a reason"):
        Detection("top", 0, 0)


def test_an_observation_finds_its_detections_by_camera() -> None:
    top, front = found(), found(camera="front")
    one = Observation(0, 5, (top, front), skew_ns=7)
    assert one.detection("top") is top
    assert one.detection("front") is front
    assert one.detection("side") is None
    assert one.roll_rad is None


@pytest.mark.parametrize("roll", [np.nan, np.inf])
def test_an_observations_roll_is_finite_or_absent(roll: float) -> None:
    with pytest.raises(ValueError, match="roll_rad: expected a finite number or None"):
        Observation(0, 5, (), roll_rad=roll)


def test_readings_compare_by_value_and_cannot_be_set() -> None:
    assert Reading(1, 2, 3) == Reading(1, 2, 3, illegal=0, flags=0)
    assert Reading(1, 2, 3) != Reading(1, 2, 4)
    with pytest.raises(FrozenInstanceError):
        Reading(1, 2, 3).count = 4  # type: ignore[misc]


def test_a_valid_roll_needs_nothing_and_a_prediction_needs_a_roll() -> None:
    assert not RollStatus(True, False, "jig", "Set roll zero.").valid
    for wrong in ((False, True), (True, True, "confirm"), (True, True, "", "Something.")):
        with pytest.raises(ValueError, match="valid roll"):
            RollStatus(*wrong)
    with pytest.raises(ValueError, match="predicted"):
        Observation(0, 0, (), roll_predicted=True)
    with pytest.raises(ValueError, match="predicted"):
        Track(0, 0, Status.LOST, "no picture", roll_predicted=True)
