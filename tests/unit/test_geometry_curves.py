"""Curves against circles, helices and straight lines, whose lengths, tangents and frames are known."""

import numpy as np
import pytest

from cathxr.geometry import arc_length, resampled, tangents, tip_pose, transported

RADIUS, RISE = 20.0, 6.0  # mm; a turn of the helix rises by 2 pi x RISE
SPEED = np.hypot(RADIUS, RISE)


def helix(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points, unit tangents and Frenet normals (N, 3) of a right-handed helix about z."""
    c, s = np.cos(angles), np.sin(angles)
    points = np.stack([RADIUS * c, RADIUS * s, RISE * angles], axis=1)
    along = np.stack([-RADIUS * s, RADIUS * c, np.full_like(c, RISE)], axis=1) / SPEED
    return points, along, np.stack([-c, -s, np.zeros_like(c)], axis=1)


def analytic_transport(angles: np.ndarray) -> np.ndarray:
    """Return the rotation-minimising normal (N, 3) along the helix that begins with its Frenet normal.

    Write U = cos(f) N + sin(f) B. With Frenet's N' = -k T + t B and B' = -t N, U' has a part across T of
    (f' + t) (-sin(f) N + cos(f) B), which is zero for f' = -t. The torsion is t = RISE / SPEED^2 and the length SPEED
    per radian, so that f = -(RISE / SPEED) angle: -2 pi cos(a) a turn, a being the tangent's angle to the axis.
    """
    _, along, normal = helix(angles)
    turned = -(RISE / SPEED) * (angles - angles[0])
    return np.asarray(
        np.cos(turned)[:, None] * normal + np.sin(turned)[:, None] * np.cross(along, normal), dtype=np.float64
    )


def test_arc_length_of_a_polyline_is_the_sum_of_its_steps() -> None:
    np.testing.assert_allclose(arc_length(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 6.0], [3.0, 6.0]])), [0, 5, 7, 7])
    np.testing.assert_array_equal(arc_length(np.zeros((1, 3))), [0.0])


def test_arc_length_of_a_helix_converges_to_the_analytic_one() -> None:
    # A chord of angle d is short by k^2 (SPEED d)^3 / 24 of SPEED d.
    step = 2.0 * np.pi / 200
    length = arc_length(helix(np.linspace(0.0, 2.0 * np.pi, 201))[0])[-1]
    curvature = RADIUS / SPEED**2
    short = 2.0 * np.pi * SPEED * (curvature * SPEED * step) ** 2 / 24.0
    assert 2.0 * np.pi * SPEED - length == pytest.approx(short, rel=1e-2)


@pytest.mark.parametrize("count", [2, 3, 50, 200])
def test_resampling_keeps_the_ends_to_the_bit(count: int) -> None:
    points = helix(np.linspace(0.1, 3.3, 77))[0]
    result = resampled(points, count)
    assert result.shape == (count, 3)
    np.testing.assert_array_equal(result[0], points[0])
    np.testing.assert_array_equal(result[-1], points[-1])


def test_resampling_is_uniform_in_arc_length() -> None:
    # Unevenly given, evenly returned: 4000 chords make the polyline a circle to 1e-7 of its radius.
    angles = 2.0 * np.linspace(0.0, 1.0, 4001) ** 2
    circle = np.stack([RADIUS * np.cos(angles), RADIUS * np.sin(angles)], axis=1)
    result = resampled(circle, 21)
    turned = np.unwrap(np.arctan2(result[:, 1], result[:, 0]))
    np.testing.assert_allclose(turned, np.linspace(0.0, 2.0, 21), atol=1e-6)


def test_resampling_follows_a_bent_polyline_around_its_corner() -> None:
    corner = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 1.0]])
    expected = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 0, 1]]
    np.testing.assert_allclose(resampled(corner, 5), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("points", "count", "message"),
    [
        (np.zeros((1, 3)), 5, "at least 2 points in and out, got 1 in"),
        (np.zeros((0, 3)), 5, "at least 2 points in and out, got 0 in"),
        (np.eye(3), 1, "got 3 in and 1 out"),
        (np.ones((4, 3)), 5, "one of length 0"),
        (np.array([[0.0, np.nan], [1.0, 1.0]]), 5, "a curve with a length"),
    ],
)
def test_what_is_no_curve_cannot_be_resampled(points: np.ndarray, count: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        resampled(points, count)


@pytest.mark.parametrize("every_other", [1.0, 2.0], ids=["even", "every other step twice as long"])
def test_tangents_are_second_order_in_the_spacing(every_other: float) -> None:
    errors = []
    for count in (33, 65, 129):
        at = np.concatenate([[0.0], np.cumsum(np.tile([1.0, every_other], count // 2))])
        points, expected, _ = helix(4.0 * at / at[-1])
        got = tangents(points)
        np.testing.assert_allclose(np.linalg.norm(got, axis=1), 1.0, atol=1e-14)
        errors.append([np.abs(got - expected).max(), np.abs(got - expected)[[0, -1]].max()])
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    # Half the spacing leaves a quarter of the error, inside and at the ends; first order would leave a half.
    assert (ratios > 3.4).all()
    assert (ratios < 4.6).all()


def test_tangents_of_two_points_are_their_chord() -> None:
    np.testing.assert_allclose(tangents(np.array([[0.0, 0.0], [3.0, 4.0]])), [[0.6, 0.8], [0.6, 0.8]])


def test_tangents_of_an_unevenly_given_line_are_exact() -> None:
    points = np.array([0.0, 1.0, 1.5, 4.0])[:, None] * np.array([[1.0, 2.0, 2.0]]) / 3.0
    np.testing.assert_allclose(tangents(points), np.tile([[1.0, 2.0, 2.0]], (4, 1)) / 3.0, atol=1e-15)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((1, 3)), "at least 2, got 1"),
        (np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), "distinct neighbours"),
        (np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]), "does not turn back"),
    ],
)
def test_curves_without_tangents_are_refused(points: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tangents(points)


def test_transport_along_a_helix_is_fourth_order() -> None:
    errors = []
    for count in (17, 33, 65):
        angles = np.linspace(0.0, 2.0 * np.pi, count)
        points, along, normal = helix(angles)
        got = transported(points, along, normal[0])
        errors.append(np.abs(got - analytic_transport(angles)).max())
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert (ratios > 13.0).all()  # 2^4 = 16; third order would give 8, fifth 32
    assert (ratios < 20.0).all()
    assert errors[-1] < 1e-4


def test_a_turn_of_a_helix_turns_the_frame_by_its_holonomy() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 2001)
    points, along, normal = helix(angles)
    last = transported(points, along, normal[0])[-1]
    # After one turn T, N, B are back: what is left is the turn of -2 pi cos(a) about T.
    turned = np.arctan2(last @ np.cross(along[-1], normal[-1]), last @ normal[-1])
    expected = -2.0 * np.pi * RISE / SPEED
    assert np.cos(turned - expected) == pytest.approx(1.0, abs=1e-12)
    assert turned == pytest.approx(np.arctan2(np.sin(expected), np.cos(expected)), abs=1e-8)


@pytest.mark.parametrize("sweep", [0.3, np.pi / 2, np.pi, 5.0])
def test_along_a_planar_arc_the_normal_stays_in_or_out_of_the_plane(sweep: float) -> None:
    angles = np.linspace(0.0, sweep, 31)
    zero = np.zeros_like(angles)
    points = RADIUS * np.stack([np.sin(angles), 1.0 - np.cos(angles), zero], axis=1)
    along = np.stack([np.cos(angles), np.sin(angles), zero], axis=1)
    inwards = np.stack([-np.sin(angles), np.cos(angles), zero], axis=1)
    # Mirror images of circles are exact: rounding of 30 steps only.
    np.testing.assert_allclose(transported(points, along, inwards[0]), inwards, atol=1e-13)
    across = np.tile([0.0, 0.0, 1.0], (31, 1))
    np.testing.assert_allclose(transported(points, along, across[0]), across, atol=1e-13)
    both = np.array([0.0, 0.6, 0.8])
    np.testing.assert_allclose(transported(points, along, both), 0.6 * inwards + 0.8 * across, atol=1e-13)


def test_the_first_normal_is_made_normal_to_the_tangent() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])  # coincident neighbours are passed over
    along = np.tile([1.0, 0.0, 0.0], (3, 1))
    got = transported(points, along, np.array([5.0, 0.0, 2.0]))
    np.testing.assert_array_equal(got, np.tile([0.0, 0.0, 1.0], (3, 1)))
    with pytest.raises(ValueError, match="parallel to the tangent"):
        transported(points, along, np.array([-2.0, 0.0, 0.0]))


MINUS_Y = np.array([0.0, -1.0, 0.0])


@pytest.mark.parametrize("count", [2, 3, 50])
@pytest.mark.parametrize("roll", [0.0, np.pi / 2, -1.0, 7.0])
def test_the_tip_of_a_straight_catheter(count: int, roll: float) -> None:
    shape = np.linspace([80.0, 3.0, -2.0], [0.0, 3.0, -2.0], count)
    pose = tip_pose(shape, zero_direction=MINUS_Y, roll_rad=roll)
    np.testing.assert_array_equal(pose.translation_mm, shape[0])
    np.testing.assert_allclose(pose.rotation[:, 2], [1.0, 0.0, 0.0], atol=1e-14)
    # Right-handed about the insertion +x: from -y the beam turns to -z, as y turns to z.
    np.testing.assert_allclose(pose.rotation[:, 0], [0.0, -np.cos(roll), -np.sin(roll)], atol=1e-14)


@pytest.mark.parametrize("sweep", [0.5, 1.5, 3.0])
@pytest.mark.parametrize(("zero", "in_plane"), [(MINUS_Y, True), (np.array([0.0, 0.0, 1.0]), False)])
def test_the_tip_of_a_catheter_bent_in_one_plane(sweep: float, zero: np.ndarray, in_plane: bool) -> None:
    angles = np.linspace(sweep, 0.0, 101)  # tip first
    shape = RADIUS * np.stack([np.sin(angles), 1.0 - np.cos(angles), np.zeros_like(angles)], axis=1)
    pose = tip_pose(shape, zero_direction=zero, roll_rad=0.0)
    # The tangents come from the points, to second order: at an end the error is a third of the step's angle squared.
    most = np.square(sweep / 100.0)
    direction = np.array([np.cos(sweep), np.sin(sweep), 0.0])
    np.testing.assert_allclose(pose.rotation[:, 2], direction, atol=most)
    expected = np.array([np.sin(sweep), -np.cos(sweep), 0.0]) if in_plane else np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(pose.rotation[:, 0], expected, atol=2.0 * most if in_plane else 1e-13)


def test_the_tip_of_a_helical_catheter_and_its_second_order() -> None:
    sweep = 4.0
    zero = np.array([0.2, -0.1, 1.0])
    roll = 0.7
    errors = []
    for count in (51, 101, 201):
        angles = np.linspace(0.0, sweep, count)
        points, along, normal = helix(angles)
        pose = tip_pose(points[::-1], zero_direction=zero, roll_rad=roll)
        # From the entry: zero made normal there, as an angle from the Frenet normal, less the holonomy, plus the roll.
        start = np.arctan2(zero @ np.cross(along[0], normal[0]), zero @ normal[0])
        angle = start - (RISE / SPEED) * sweep + roll
        beam = np.cos(angle) * normal[-1] + np.sin(angle) * np.cross(along[-1], normal[-1])
        expected = np.column_stack([beam, np.cross(along[-1], beam), along[-1]])
        np.testing.assert_array_equal(pose.translation_mm, points[-1])
        errors.append(np.abs(pose.rotation - expected).max())
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert (ratios > 3.4).all()  # the tangents' order
    assert (ratios < 4.6).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_zero_direction_along_the_insertion_is_refused(sign: float) -> None:
    shape = np.linspace([80.0, 0.0, 0.0], [0.0, 0.0, 0.0], 5)
    with pytest.raises(ValueError, match="parallel to the tangent"):
        tip_pose(shape, zero_direction=np.array([sign, 0.0, 0.0]), roll_rad=0.0)


def test_the_orientation_does_not_depend_on_how_the_zero_direction_leans() -> None:
    shape = np.linspace([80.0, 0.0, 0.0], [0.0, 0.0, 0.0], 5)
    leaning = tip_pose(shape, zero_direction=np.array([3.0, -1.0, 0.0]) / np.sqrt(10.0), roll_rad=0.3)
    upright = tip_pose(shape, zero_direction=MINUS_Y, roll_rad=0.3)
    np.testing.assert_allclose(leaning.rotation, upright.rotation, atol=1e-14)
