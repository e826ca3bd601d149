"""The rig's nouns: what each refuses, and how encoder counts become roll."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cathxr.core import Catheter, Intrinsics, Marker, Pose, Provenance, Rig, RigCamera, Roi, Roll

LENS = Intrinsics(np.array([1357.7, 1357.7]), np.array([640.0, 360.0]))
TOP = RigCamera("top", (1280, 720), 60.0, LENS, Pose.identity())
FRONT = replace(TOP, name="front")
ROI = Roi(np.array([0.0, -60.0, -60.0]), np.array([120.0, 60.0, 60.0]))
CATHETER = Catheter("9F ICE", 3.0)
RIG = Rig("example box", ROI, CATHETER, {"top": TOP, "front": FRONT})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"focal_px": np.ones(3)}, "focal_px: expected shape"),
        ({"centre_px": np.ones(1)}, "centre_px: expected shape"),
        ({"distortion": np.zeros(4)}, "distortion: expected shape"),
        ({"focal_px": np.array([1.0, 0.0])}, "focal_px: expected positive"),
        ({"focal_px": np.array([-1.0, 1.0])}, "focal_px: expected positive"),
        ({"focal_px": np.array([np.nan, 1.0])}, "focal_px: expected finite"),
        ({"distortion": np.full(5, np.inf)}, "distortion: expected finite"),
    ],
)
def test_intrinsics_refuse(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(LENS, **changes)


def test_intrinsics_give_opencvs_matrix() -> None:
    lens = Intrinsics(np.array([10.0, 11.0]), np.array([3.0, 4.0]))
    np.testing.assert_array_equal(lens.matrix, [[10.0, 0.0, 3.0], [0.0, 11.0, 4.0], [0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(lens.distortion, np.zeros(5))


@pytest.mark.parametrize("name", ["focal_px", "centre_px", "distortion"])
def test_intrinsics_are_read_only(name: str) -> None:
    with pytest.raises(ValueError, match="read-only"):
        getattr(LENS, name)[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"size_px": (1280,)}, "size_px: expected width and height"),
        ({"size_px": (15, 720)}, "size_px: expected width and height"),
        ({"size_px": (1280, 16385)}, "size_px: expected width and height"),
        ({"rate_hz": 0.0}, "rate_hz: expected a positive rate"),
        ({"rate_hz": -30.0}, "rate_hz: expected a positive rate"),
        ({"rate_hz": np.nan}, "rate_hz: expected a positive rate"),
        ({"rate_hz": np.inf}, "rate_hz: expected a positive rate"),
    ],
)
def test_a_camera_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(TOP, **changes)


@pytest.mark.parametrize("size", [(16, 16), (16384, 16384)])
def test_a_cameras_size_may_reach_its_limits(size: tuple[int, int]) -> None:
    assert replace(TOP, size_px=size).size_px == size


@pytest.mark.parametrize("position", [np.zeros(2), np.zeros((1, 3)), np.array([0.0, 0.0, np.nan])])
def test_a_marker_needs_a_point(position: Any) -> None:
    with pytest.raises(ValueError, match="position_mm: expected"):
        Marker("mT1", position, "red")


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("change", [0.0, -1.0])
def test_a_region_of_interest_has_a_size_on_every_axis(axis: int, change: float) -> None:
    high = np.array([120.0, 60.0, 60.0])
    high[axis] = ROI.min_mm[axis] + change
    with pytest.raises(ValueError, match="max_mm greater than min_mm"):
        Roi(ROI.min_mm, high)


def test_a_region_of_interest_has_eight_corners() -> None:
    corners = Roi(np.array([0.0, 1.0, 2.0]), np.array([3.0, 4.0, 5.0])).corners_mm
    assert {tuple(each) for each in corners.tolist()} == {(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)}


@pytest.mark.parametrize("diameter", [0.0, 0.09, 20.1, -3.0, np.nan, np.inf])
def test_a_catheter_has_a_catheters_diameter(diameter: float) -> None:
    with pytest.raises(ValueError, match=r"diameter_mm: expected 0\.1 to 20 mm"):
        Catheter("", diameter)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"counts_per_turn": 0.0}, "expected positive counts_per_turn"),
        ({"counts_per_turn": -2400.0}, "expected positive counts_per_turn"),
        ({"counts_per_turn": np.nan}, "expected positive counts_per_turn"),
        ({"gear_ratio": 0.0}, "expected positive counts_per_turn and gear_ratio"),
        ({"gear_ratio": np.inf}, "expected positive counts_per_turn and gear_ratio"),
        ({"direction": 0}, "direction: expected 1 or -1, got 0"),
        ({"direction": 2}, "direction: expected 1 or -1, got 2"),
        ({"zero_count": np.nan}, "zero_count: expected a finite number"),
        ({"zero_direction": np.zeros(3)}, "zero_direction: expected a vector of length 1"),
        ({"zero_direction": np.array([0.0, 1.002, 0.0])}, "zero_direction: expected a vector of length 1"),
        ({"zero_direction": np.ones(2)}, "zero_direction: expected shape"),
    ],
)
def test_a_roll_scale_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(Roll(2400.0), **changes)


def test_a_zero_direction_of_about_unit_length_is_normalised() -> None:
    roll = Roll(2400.0, zero_direction=np.array([0.0, 0.0, 1.0005]))
    np.testing.assert_array_equal(roll.zero_direction, [0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="read-only"):
        roll.zero_direction[0] = 1.0


@pytest.mark.parametrize(
    ("count", "gear", "direction", "zero", "turns"),
    [
        (2400.0, 1.0, 1, 0.0, 1.0),
        (2400.0, 2.0, 1, 0.0, 0.5),  # two encoder turns for one of the catheter
        (2400.0, 2.0, -1, 0.0, -0.5),
        (-600.0, 1.0, 1, 0.0, -0.25),
        (100.0, 1.0, 1, 100.0, 0.0),
        (100.0, 0.5, -1, 400.0, 0.25),
        (24000.0, 1.0, 1, 0.0, 10.0),  # unwrapped
    ],
)
def test_counts_become_roll(count: float, gear: float, direction: int, zero: float, turns: float) -> None:
    roll = Roll(2400.0, gear_ratio=gear, direction=direction, zero_count=zero)
    assert roll.angle_rad(count) == pytest.approx(2.0 * np.pi * turns, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("kept", [(), ("top",), ("front",)])
def test_a_rig_has_both_cameras(kept: tuple[str, ...]) -> None:
    absent = sorted({"top", "front"} - set(kept))
    with pytest.raises(ValueError, match=f"expected top and front, {' and '.join(absent)} missing"):
        replace(RIG, cameras=dict.fromkeys(kept, TOP))


def test_a_rig_keeps_its_own_cameras_and_markers() -> None:
    cameras, markers = {"top": TOP, "front": FRONT}, {"top": [Marker("mT1", np.zeros(3), "red")]}
    rig = replace(RIG, cameras=cameras, markers=markers)
    cameras.clear()
    markers["top"].clear()
    assert set(rig.cameras) == {"top", "front"}
    assert [each.name for each in rig.markers["top"]] == ["mT1"]
    with pytest.raises(TypeError):
        rig.cameras["side"] = TOP  # type: ignore[index]
    with pytest.raises(TypeError):
        rig.markers["front"] = ()  # type: ignore[index]


def test_roll_zero_points_to_minus_y_unless_the_rig_says_otherwise() -> None:
    np.testing.assert_array_equal(RIG.zero_direction, [0.0, -1.0, 0.0])
    turned = replace(RIG, roll=Roll(2400.0, zero_direction=np.array([0.0, 0.0, 1.0])))
    np.testing.assert_array_equal(turned.zero_direction, [0.0, 0.0, 1.0])


def test_a_pose_covariance_is_six_by_six() -> None:
    assert Provenance().covariance is None
    given = Provenance(covariance=np.eye(6)).covariance
    assert given is not None
    assert not given.flags.writeable
    with pytest.raises(ValueError, match="covariance: expected shape"):
        Provenance(covariance=np.eye(3))
