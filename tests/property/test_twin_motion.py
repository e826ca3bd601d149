"""Properties of the twin's motion: smooth whatever a hand does, and a pure function of seed and time until then."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cathxr.storage.rig_file import example_rig
from cathxr.twin import TwinSettings, TwinWorld
from cathxr.twin.manoeuvres import NAMES, script

RIG = example_rig()
NS = 1_000_000_000
controls = st.fixed_dictionaries(
    {},
    optional={
        "insertion_mm": st.floats(0.0, 140.0),
        "roll_deg": st.floats(-400.0, 400.0),
        "anterior_deg": st.floats(-200.0, 200.0),
        "left_deg": st.floats(-200.0, 200.0),
    },
)
commands = st.lists(
    st.tuples(st.floats(0.01, 2.0), st.one_of(controls, st.sampled_from(NAMES))), min_size=1, max_size=6
)


def carry_out(world: TwinWorld, moves: list[tuple[float, object]]) -> list[float]:
    """Carry out the moves, each some seconds after the one before, and return when each was, s."""
    now, whens = 5.0, []
    for wait, move in moves:
        now += wait
        if isinstance(move, str):
            world.manoeuvre(round(now * NS), move)
        else:
            world.steer(round(now * NS), **move)  # type: ignore[arg-type]
        whens.append(now)
    return whens


@given(name=st.sampled_from(NAMES), seed=st.integers(0, 1000), t_s=st.floats(-50.0, 5000.0))
def test_scripts_give_rates_and_accelerations_that_fit_their_values(name: str, seed: int, t_s: float) -> None:
    motion, h = script(name, seed=seed), 1e-4
    before, here, after = motion.at(t_s - h), motion.at(t_s), motion.at(t_s + h)
    # Central differences of sines of at most 10 rad/s and 200 deg: third derivatives of 2e5 give 2e5 h²/6 = 3e-4.
    assert np.abs((after[:2] - before[:2]) / (2 * h) - here[1:]).max() < 2e-2


@settings(max_examples=25)
@given(moves=commands, seed=st.integers(0, 50))
def test_motion_stays_smooth_whatever_a_hand_does(moves: list[tuple[float, object]], seed: int) -> None:
    world = TwinWorld(RIG, seed=seed)
    for when in carry_out(world, moves):
        # Positions 20 us before and after a command differ by rate times time only: no jump of value or of rate.
        times = [round((when + k * 1e-5) * NS) for k in (-2, -1, 1, 2)]
        values = np.array([world.controls(t).array() for t in times])
        rates = (values[1] - values[0], values[3] - values[2])
        # Fastest rates: 360 deg/s from a limit plus what a script brings; accelerations: 9 / s times that.
        assert np.abs(values[2] - values[1]).max() < 2e-5 * 1500.0
        assert np.abs(rates[1] - rates[0]).max() / 1e-5 < 3e-5 * 30000.0


@settings(max_examples=25)
@given(moves=commands, seed=st.integers(0, 50))
def test_what_was_seen_before_a_command_stays_true(moves: list[tuple[float, object]], seed: int) -> None:
    steered, untouched = TwinWorld(RIG, seed=seed), TwinWorld(RIG, seed=seed)
    first = carry_out(steered, moves)[0]
    for t_ns in (0, round(3.3 * NS), round(first * NS) - 1):
        assert np.array_equal(steered.truth(t_ns).shape_box, untouched.truth(t_ns).shape_box)


@settings(max_examples=25)
@given(moves=commands, target=controls, seed=st.integers(0, 50))
def test_setpoints_are_reached_within_their_ranges(
    moves: list[tuple[float, object]], target: dict[str, float], seed: int
) -> None:
    world = TwinWorld(RIG, seed=seed)
    last = carry_out(world, moves)[-1]
    world.steer(round((last + 0.1) * NS), **target)
    # The slowest follows a turn of 800 deg at 360 deg/s: after 40 s nothing is left of it.
    settled = dict(zip(world.control_ranges, world.controls(round((last + 40.0) * NS)).array(), strict=True))
    for name, value in target.items():
        least, most = world.control_ranges[name]
        assert settled[name] == pytest.approx(np.clip(value, least, most), abs=0.02)
    for name, (least, most) in world.control_ranges.items():
        assert least - 0.02 <= settled[name] <= most + 0.02


@given(name=st.sampled_from(NAMES), seed=st.integers(0, 200), t_s=st.floats(0.0, 1000.0))
def test_every_script_stays_in_the_region_of_interest(name: str, seed: int, t_s: float) -> None:
    world = TwinWorld(RIG, seed=seed, settings=TwinSettings(manoeuvre=name))
    shape = world.state(round(t_s * NS)).shape_box
    # The tilt in the inlet may put the first millimetres aside, never behind the entry plane.
    assert (shape >= RIG.roi.min_mm - 1e-9).all()
    assert (shape <= RIG.roi.max_mm).all()


@given(seed=st.integers(0, 1000), t_s=st.floats(0.0, 1000.0))
def test_the_world_is_a_pure_function_of_seed_and_time(seed: int, t_s: float) -> None:
    t_ns = round(t_s * NS)
    first, second = TwinWorld(RIG, seed=seed), TwinWorld(RIG, seed=seed)
    second.truth(t_ns + NS)
    assert np.array_equal(first.truth(t_ns).shape_box, second.truth(t_ns).shape_box)
    other = TwinWorld(RIG, seed=seed + 1).truth(t_ns)
    assert not np.array_equal(first.truth(t_ns).shape_box, other.shape_box)
