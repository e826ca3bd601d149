"""Metrics of paths, turns and smoothness against closed forms, and against the authors' own implementation."""

import numpy as np
import pytest
from monalysa.quality import smoothness as monalysa
from scipy.spatial.transform import Rotation

from cathxr.core import FloatArray
from cathxr.training.metrics import path, turning
from cathxr.training.metrics.motion import CUTOFF_HZ, Motion, smoothed, turns_rad
from cathxr.training.metrics.smoothness import ldlj, sparc

RATE = 100.0
T = np.arange(0.0, 4.0 + 1e-9, 1.0 / RATE)


def helix(t: FloatArray = T) -> FloatArray:
    """Radius 20 mm, one turn in 4 s, 10 mm up a turn."""
    angle = 2.0 * np.pi * t / 4.0
    return np.column_stack([20.0 * np.cos(angle), 20.0 * np.sin(angle), 10.0 * t / 4.0])


HELIX_MM = float(np.hypot(2.0 * np.pi * 20.0, 10.0))


def minimum_jerk(t: FloatArray, duration: float, distance: float) -> FloatArray:
    """Flash, Hogan 1985: the speed of the smoothest way from rest to rest."""
    s = t / duration
    return 30.0 * distance / duration * s**2 * (1.0 - s) ** 2


def test_path_and_speeds_of_a_helix() -> None:
    motion = Motion.of(T, helix())
    # Chords instead of arcs: shorter by (pi / 400)^2 / 6.
    assert path.path_mm(motion) == pytest.approx(HELIX_MM, rel=2e-5)
    (segment,) = motion.segments()
    assert segment.speed_mm_s == pytest.approx(np.full(400, HELIX_MM / 4.0), rel=2e-5)
    assert path.seen_s(motion) == pytest.approx(4.0)


def test_axial_motion_is_the_part_along_the_tip() -> None:
    tip = np.column_stack([30.0 * T, 40.0 * T, 0.0 * T])
    # z of the tip along x.
    rotation = np.tile(np.column_stack([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]), (len(T), 1, 1))
    assert path.axial_mm(Motion.of(T, tip, rotation)) == pytest.approx(120.0)
    to_and_fro = np.column_stack([10.0 * np.abs(np.mod(T, 2.0) - 1.0), 0.0 * T, 0.0 * T])
    assert path.axial_mm(Motion.of(T, to_and_fro, rotation)) == pytest.approx(40.0)


def test_gaps_and_pauses_are_never_bridged() -> None:
    tip = np.column_stack([10.0 * T, 0.0 * T, 0.0 * T])
    plain = Motion.of(T, tip)
    seen = (np.arange(len(T)) < 100) | (np.arange(len(T)) > 200)
    unseen = Motion(**{**vars(plain), "seen": seen, "tip_box": np.where(seen[:, None], tip, 1e6)})
    assert path.path_mm(unseen) == pytest.approx(0.99 * 10.0 + 1.99 * 10.0)
    paused = Motion(**{**vars(plain), "stretch": (np.arange(len(T)) > 200).astype(np.int64)})
    assert path.path_mm(paused) == pytest.approx(39.9)
    slow = Motion.of(T[::50], tip[::50])  # half a second apart: each step is a gap
    assert path.path_mm(slow) == 0.0
    assert not list(slow.segments())
    assert not unseen.whole
    assert plain.whole
    assert path.path_mm(smoothed(unseen)) == pytest.approx(0.99 * 10.0 + 1.99 * 10.0, rel=1e-6)


def test_smoothing_keeps_the_motion_and_removes_noise() -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(scale=0.05, size=(len(T), 3))
    noisy = smoothed(Motion.of(T, helix() + noise))
    inside = slice(30, -30)
    off = noisy.tip_box[inside] - helix()[inside]
    # White noise through a filter that passes about CUTOFF of RATE / 2, twice: a fifth to a half of it is left; the
    # helix at 0.25 Hz loses (0.25 / 6)^4, 3e-6 of its radius.
    assert 0.2 * 0.05 < off.std() < 0.5 * 0.05
    assert path.path_mm(Motion.of(T, helix() + noise)) > 1.02 * HELIX_MM
    assert path.path_mm(noisy) == pytest.approx(HELIX_MM, rel=0.02)
    assert CUTOFF_HZ == 6.0


def test_total_rotation() -> None:
    about = Rotation.from_rotvec(np.column_stack([0.0 * T, 0.0 * T, np.deg2rad(30.0) * T])).as_matrix()
    assert turning.rotation_deg(Motion.of(T, helix(), about)) == pytest.approx(120.0)
    there_and_back = Rotation.from_rotvec(
        np.column_stack([np.deg2rad(50.0) * np.sin(2.0 * np.pi * T / 4.0), 0.0 * T, 0.0 * T])
    ).as_matrix()
    assert turning.rotation_deg(Motion.of(T, helix(), there_and_back)) == pytest.approx(200.0)
    tiny = Rotation.from_rotvec(np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [np.pi - 1e-6, 0.0, 0.0]])).as_matrix()
    assert turns_rad(tiny) == pytest.approx([1e-9, np.pi - 1e-6], rel=1e-6)


def test_actions_begin_at_the_threshold_and_end_below_half_of_it() -> None:
    steps = np.full(400, 0.01)
    rates = np.zeros(400)
    rates[50:150] = 6.0
    rates[80:100] = 3.0  # not below half
    rates[200:210] = 9.0  # a tenth of a second is none
    rates[300:] = 5.0  # until the end
    assert turning.actions(rates, steps, 5.0) == 2
    rates[80:100] = 2.4
    assert turning.actions(rates, steps, 5.0) == 3


def test_idle_time_needs_half_a_second() -> None:
    speed = np.where((T < 1.0) | ((T > 2.0) & (T < 2.3)), 0.0, 10.0)
    tip = np.column_stack([np.concatenate([[0.0], np.cumsum(speed[:-1]) / RATE]), 0.0 * T, 0.0 * T])
    (segment,) = Motion.of(T, tip).segments()
    still = turning.turn_rates(segment)
    assert turning.idle_s(segment, still) == pytest.approx(1.0, abs=0.011)
    assert turning.idle_s(segment, still + 6.0) == 0.0
    turned = Rotation.from_rotvec(np.column_stack([np.deg2rad(20.0) * T, 0.0 * T, 0.0 * T])).as_matrix()
    (segment,) = Motion.of(T, tip, turned).segments()
    assert turning.turn_rates(segment) == pytest.approx(np.full(400, 20.0))


@pytest.mark.parametrize("rate", [30.0, 60.0, 100.0])
def test_smoothness_is_what_monalysa_says(rate: float) -> None:
    rng = np.random.default_rng(int(rate))
    t = np.arange(0.0, 3.0, 1.0 / rate)
    for speed in (minimum_jerk(t, 3.0, 80.0), np.abs(rng.normal(size=len(t))) + np.sin(t) ** 2):
        assert sparc(speed, rate) == pytest.approx(monalysa.sparc(speed, rate)[0], rel=1e-9)
        assert ldlj(speed, rate) == pytest.approx(monalysa.log_dimensionless_jerk(speed, rate), rel=1e-12)
    velocity = rng.normal(size=(len(t), 3))
    assert ldlj(velocity, rate) == pytest.approx(monalysa.log_dimensionless_jerk(velocity, rate), rel=1e-12)


def test_smoothness_of_the_published_example() -> None:
    # The figures that monalysa's documentation prints for exp(-5 t^2) from -1 to 1 s at 100 Hz.
    t = np.arange(-1.0, 1.0, 0.01)
    speed = np.exp(-5.0 * t**2)
    assert sparc(speed, 100.0) == pytest.approx(-1.41403, abs=5e-6)
    assert ldlj(speed, 100.0) == pytest.approx(-5.81636, abs=5e-6)


def test_ldlj_of_minimum_jerk_is_its_closed_form() -> None:
    # T^3 / v_peak^2 * integral of the squared second derivative of the speed: 720 / 1.875^2.
    # Second differences leave out a step at each end, where the integrand is 5 times its mean: 2 * 5 / 2000 of the sum.
    t = np.arange(0.0, 2.0, 1e-3)
    assert ldlj(minimum_jerk(t, 2.0, 50.0), 1000.0) == pytest.approx(-np.log(720.0 / 1.875**2), abs=6e-3)


def test_smoother_is_nearer_to_zero() -> None:
    t = np.arange(0.0, 3.0, 0.01)
    whole = minimum_jerk(t, 3.0, 60.0)
    halting = np.tile(minimum_jerk(t[:100], 1.0, 20.0), 3)
    for function in (sparc, ldlj):
        assert function(halting, 100.0) < function(whole, 100.0) < 0.0
        # Neither size nor pace matters.
        assert function(7.0 * whole, 100.0) == pytest.approx(function(whole, 100.0))
    assert ldlj(whole, 50.0) == pytest.approx(ldlj(whole, 100.0))


def test_smoothness_of_nothing_is_refused() -> None:
    for function in (sparc, ldlj):
        with pytest.raises(ValueError, match="expected"):
            function(np.zeros(50), 100.0)
        with pytest.raises(ValueError, match="expected"):
            function(np.ones(1), 100.0)
