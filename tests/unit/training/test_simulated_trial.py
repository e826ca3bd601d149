"""Simulated hands on the twin: what they are tracked by and its errors, their limits, and that a seed gives it all."""

import numpy as np
import pytest

from cathxr.core import ConfigError, Rig
from cathxr.core.trials import Outcome
from cathxr.runtime.simulated_eye import SIGMA_MM, TANGENT_STD_DEG, TIP_STD_MM, Encoder, TruthEye
from cathxr.runtime.simulated_hand import Skill, SteeringHand
from cathxr.runtime.simulated_trial import SimulatedRun, simulated_run
from cathxr.storage.rig_file import example_rig
from cathxr.training.events import BEGUN, ENDED
from cathxr.twin import TwinWorld
from cathxr.twin.world import CONTROL_RANGES

from ...training_support.tracks import placed, tip_target

NEAR = tip_target("near", (45.0, 0.0, 0.0), radius=6.0)
ASIDE = tip_target("aside", (68.0, -20.0, 0.0), radius=6.0)
SECOND = 1_000_000_000


def run(seed: int, *, abort_s: float | None = None, skill: Skill | None = None) -> SimulatedRun:
    rig, rng = example_rig(), np.random.default_rng(seed)
    world, task = TwinWorld(rig, start_ns=SECOND), placed(NEAR, ASIDE, limit_s=60.0)
    hand = SteeringHand(world.body, task, skill or Skill(), rng)
    return simulated_run(
        task, ("near", "aside"), world=world, eye=TruthEye(world, rig, rng), hand=hand, trial="T", abort_s=abort_s
    )


def test_a_hand_reaches_its_targets_and_a_seed_gives_the_same_again() -> None:
    first, again, other = run(1), run(1), run(2)
    result = first.trial.result()
    assert result.outcome is Outcome.COMPLETED
    assert first.events == again.events != other.events
    assert [each.payload["what"] for each in (first.events[0], first.events[-1])] == [BEGUN, ENDED]
    # half a second is recorded on either side
    assert first.tracks[0].t_ns < result.began_ns < result.ended_ns < first.tracks[-1].t_ns
    assert result.unseen_share == 0.0


def test_who_misses_more_takes_longer() -> None:
    def middle(aside: float) -> float:
        return float(np.median([run(seed, skill=Skill(aside=aside)).trial.result().active_s for seed in range(5)]))

    assert middle(0.5) > middle(0.1)


def test_who_gives_up_aborts() -> None:
    result = run(1, abort_s=1.0).trial.result()
    assert result.outcome is Outcome.ABORTED
    assert result.active_s == pytest.approx(1.0, abs=1.0 / 30.0)


def test_controls_stay_in_their_ranges() -> None:
    rig = example_rig()
    far = placed(tip_target("far", (119.0, 0.0, 0.0), radius=3.0))
    hand = SteeringHand(TwinWorld(rig).body, far, Skill(aside=3.0), np.random.default_rng(0))
    world = TwinWorld(rig, start_ns=SECOND)
    rng = np.random.default_rng(1)
    done = simulated_run(far, ("far",), world=world, eye=TruthEye(world, rig, rng), hand=hand, trial="T", abort_s=8.0)
    low, high = np.array(list(CONTROL_RANGES.values())).T
    for track in done.tracks[::10]:
        values = world.controls(track.t_ns).array()
        # the soft floor of the insertion lets it be a little longer, never shorter
        assert (values >= low - 1e-9).all()
        assert (values <= high + 1.0).all()


def test_the_truth_is_seen_with_the_trackers_errors() -> None:
    rig = example_rig()
    world = TwinWorld(rig, start_ns=SECOND)
    eye = TruthEye(world, rig, np.random.default_rng(3))
    count, tips, angles = 600, [], []
    for seq in range(count):
        t_ns = SECOND + seq * 20_000_000
        seen, truth = eye.track(seq, t_ns), world.truth(t_ns, points=20)
        assert seen.tip_box is not None
        assert truth.tip_box is not None
        assert seen.direction_box is not None
        assert truth.direction_box is not None
        tips.append(seen.tip_box - truth.tip_box)
        angles.append(np.degrees(np.arccos(min(1.0, float(seen.direction_box @ truth.direction_box)))))
        assert seen.sigma_mm == SIGMA_MM
        assert seen.shape_box is not None
        assert truth.shape_box is not None
        np.testing.assert_array_equal(seen.shape_box[-1], truth.shape_box[-1])
    # A standard deviation out of n normal values is known to 1 / sqrt(2 n), a Rayleigh mean to 0.52 / sqrt(n); x4.
    assert np.std(tips) == pytest.approx(TIP_STD_MM, rel=4.0 / np.sqrt(2 * 3 * count))
    assert np.mean(angles) == pytest.approx(TANGENT_STD_DEG * np.sqrt(np.pi / 2.0), rel=4.0 * 0.53 / np.sqrt(count))


def test_the_roll_is_read_to_the_count() -> None:
    rig = example_rig()
    assert rig.roll is not None
    world = TwinWorld(rig, start_ns=SECOND)
    encoder = Encoder(world, rig)
    step = 2.0 * np.pi / (rig.roll.counts_per_turn * rig.roll.gear_ratio)
    for k in range(200):
        t_ns = SECOND + k * 20_000_000
        off = encoder.roll_rad(t_ns) - np.deg2rad(world.controls(t_ns).roll_deg)
        assert abs(off) <= 0.5 * step + 1e-12


def test_a_rig_without_an_encoder_is_refused() -> None:
    rig = example_rig()
    bare = Rig(**{**vars(rig), "roll": None})
    with pytest.raises(ConfigError, match=r"no \[roll\]"):
        Encoder(TwinWorld(rig), bare)
