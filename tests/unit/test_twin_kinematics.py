"""The twin's catheter against independent integration and against what its controls promise."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cathxr.core import FloatArray
from cathxr.geometry import arc_length, tip_pose
from cathxr.twin import Controls
from cathxr.twin.kinematics import CatheterBody, centreline, sphere_path

MINUS_Y = np.array([0.0, -1.0, 0.0])
PLAIN = CatheterBody.of(radius_mm=1.5, tilt_rad=np.zeros(2), zero_direction=MINUS_Y, memory_per_mm=np.zeros(2))
BENT = CatheterBody.of(
    radius_mm=1.5, tilt_rad=np.array([0.02, -0.03]), zero_direction=MINUS_Y, memory_per_mm=np.array([0.001, -0.002])
)
POSES = [
    Controls(95.0, 30.0, 80.0, -40.0),
    Controls(88.0, -200.0, 150.0, 220.0),
    Controls(20.0, 500.0, 60.0, 0.0),
    Controls(5.0, 10.0, -90.0, 20.0),
    Controls(130.0, 0.0, 0.0, 0.0),
]


def ramp(x: float) -> float:
    x = min(1.0, max(0.0, x))
    return 6 * x**5 - 15 * x**4 + 10 * x**3


def by_ode(body: CatheterBody, controls: Controls) -> tuple[FloatArray, FloatArray]:
    """The tip and its transported frame by an adaptive eighth-order integration of Bishop's equations."""
    roll = np.deg2rad(controls.roll_deg)
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])

    def slope(s: float, state: FloatArray) -> FloatArray:
        first, second, tangent = state[3:].reshape(3, 3)
        from_end = controls.insertion_mm - s - 5.0
        body_share = ramp((from_end - 44.0) / 8.0)
        bend = ramp(from_end / 8.0) * (1.0 - body_share) / 44.0
        flexion = np.deg2rad([controls.anterior_deg, controls.left_deg])
        k1, k2 = ramp(s / 6.0) * (turn @ (bend * flexion + body_share * body.memory_per_mm))
        return np.concatenate([tangent, -k1 * tangent, -k2 * tangent, k1 * first + k2 * second])

    start = np.concatenate([np.zeros(3), body.entry_frame.T.ravel()])
    end = solve_ivp(slope, (0.0, controls.insertion_mm), start, "DOP853", rtol=1e-10, atol=1e-11, max_step=0.5).y[:, -1]
    first, second, tangent = end[3:].reshape(3, 3)
    x = np.cos(roll) * first + np.sin(roll) * second
    return end[:3], np.column_stack([x, np.cross(tangent, x), tangent])


@pytest.mark.parametrize("body", [PLAIN, BENT])
@pytest.mark.parametrize("controls", POSES)
def test_tip_pose_agrees_with_independent_integration(body: CatheterBody, controls: Controls) -> None:
    # Midpoint arcs of 0.25 mm: the error is of order h² k' / 24 (1e-5 rad, 1e-3 mm), far below any tracker's.
    shape, box_from_tip = centreline(body, controls, points=50)
    tip, frame = by_ode(body, controls)
    assert np.abs(shape[0] - tip).max() < 1e-3
    assert np.abs(box_from_tip.translation_mm - tip).max() < 1e-3
    assert np.abs(box_from_tip.rotation - frame).max() < 5e-5


@pytest.mark.parametrize("controls", POSES)
def test_centreline_starts_at_the_inlet_and_is_as_long_as_the_insertion(controls: Controls) -> None:
    shape, _ = centreline(BENT, controls, points=401)
    assert np.array_equal(shape[-1], np.zeros(3))
    # A chord of step h falls short of its arc by h (k h)² / 24: with k up to 0.12 / mm and 0.33 mm, 7e-5 of the length.
    assert arc_length(shape)[-1] == pytest.approx(controls.insertion_mm, rel=1e-4)
    steps = np.linalg.norm(np.diff(shape, axis=0), axis=1)
    assert steps.max() - steps.min() < 1e-3 * steps.mean()


@pytest.mark.parametrize("controls", POSES)
def test_tangent_has_no_kink(controls: Controls) -> None:
    shape, _ = centreline(BENT, controls, points=801)
    along = np.diff(shape, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    turned = np.linalg.norm(np.diff(along, axis=0), axis=1) / (controls.insertion_mm / 800)
    # Curvature stays at most the flexion over the even part of the distal section, plus the body's own.
    flexion = np.deg2rad(np.hypot(controls.anterior_deg, controls.left_deg))
    assert turned.max() < 1.01 * flexion / 44.0 + 0.003
    assert np.abs(np.diff(turned)).max() < 0.01


@pytest.mark.parametrize("roll_deg", [0.0, 35.0, -120.0, 400.0])
def test_straight_catheter_has_the_beam_at_the_zero_direction_turned_by_roll(roll_deg: float) -> None:
    _, box_from_tip = centreline(PLAIN, Controls(60.0, roll_deg, 0.0, 0.0), points=50)
    roll = np.deg2rad(roll_deg)
    # Right-handed about +x, starting from -y: -y goes to -z.
    assert box_from_tip.rotation[:, 0] == pytest.approx([0.0, -np.cos(roll), -np.sin(roll)], abs=1e-12)
    assert box_from_tip.rotation[:, 2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("roll_deg", [0.0, 50.0, 200.0])
def test_anterior_flexion_bends_towards_the_beam_and_left_to_its_left(roll_deg: float) -> None:
    _, straight = centreline(PLAIN, Controls(80.0, roll_deg, 0.0, 0.0), points=50)
    anterior, _ = centreline(PLAIN, Controls(80.0, roll_deg, 60.0, 0.0), points=50)
    left, _ = centreline(PLAIN, Controls(80.0, roll_deg, 0.0, 60.0), points=50)
    for shape, axis in ((anterior, 0), (left, 1)):
        offset = shape[0] - straight.translation_mm
        sideways = straight.rotation.T @ offset
        assert sideways[axis] > 10.0
        assert abs(sideways[1 - axis]) < 1e-9


@pytest.mark.parametrize("roll_deg", [40.0, -170.0])
def test_roll_turns_the_whole_flexed_shape_about_the_insertion_axis(roll_deg: float) -> None:
    before, _ = centreline(PLAIN, Controls(90.0, 0.0, 110.0, -30.0), points=50)
    after, _ = centreline(PLAIN, Controls(90.0, roll_deg, 110.0, -30.0), points=50)
    c, s = np.cos(np.deg2rad(roll_deg)), np.sin(np.deg2rad(roll_deg))
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    assert np.abs(before @ turn.T - after).max() < 1e-9


@pytest.mark.parametrize("controls", POSES)
def test_swept_ball_ends_one_radius_before_the_tip(controls: Controls) -> None:
    shape, box_from_tip = centreline(BENT, controls, points=50)
    path = sphere_path(BENT, controls, steps=400, behind_mm=7.0)
    assert np.abs(path[-1] + BENT.radius_mm * box_from_tip.rotation[:, 2] - shape[0]).max() < 1e-3
    assert path[0] == pytest.approx(-7.0 * BENT.entry_frame[:, 2])
    assert path[1] == pytest.approx(np.zeros(3))


def test_the_tip_pose_is_the_one_that_the_geometry_package_defines() -> None:
    controls = Controls(100.0, 70.0, 120.0, 60.0)
    shape, box_from_tip = centreline(BENT, controls, points=4001)
    expected = tip_pose(shape, zero_direction=MINUS_Y, roll_rad=np.deg2rad(70.0))
    # Finite-difference tangents at 0.025 mm: (k h)² is 1e-5.
    assert np.abs(expected.rotation - box_from_tip.rotation).max() < 2e-4
