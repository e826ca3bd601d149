"""A scripted hand does the built-in tasks on the twin's kinematics: Tracks in, trials and measures out."""

import numpy as np
import pytest

from cathxr.core import FloatArray
from cathxr.core.trials import Outcome
from cathxr.heart import builtin_path, read_heart
from cathxr.registration import read_registration
from cathxr.storage.rig_file import example_rig
from cathxr.training import builtin_tasks, find_task, order_of, place_task, run_task
from cathxr.training.metrics import Run, measured, motion_of, values
from cathxr.training.placing import PlacedTask
from cathxr.twin import TwinWorld

from ...training_support.hand import steered

START = np.array([30.0, 0.0, 0.0, 0.0])


def placed(key: str) -> PlacedTask:
    heart = read_heart(builtin_path())
    assert heart.registration is not None
    matrix = read_registration(heart.registration).matrix
    return place_task(find_task(key), ct_from_box=matrix, points_ct=heart.points_ct, roi=example_rig().roi)


@pytest.mark.parametrize(
    "key", [each.key for each in builtin_tasks() if each.key not in ("practice", "random_targets")]
)
def test_the_hand_completes_every_task(key: str) -> None:
    task, body = placed(key), TwinWorld(example_rig()).body
    order = order_of(find_task(key), row=2)
    tracks = steered(body, task, order, start=START, rate_hz=30.0)
    trial = run_task(task, order, tracks).trial
    result = trial.result()
    assert result.outcome is Outcome.COMPLETED, trial.state
    # Each target is reached during its own move or hold, and never before the hand sets out for it.
    for at, each in enumerate(result.targets):
        assert each.reached_s is not None
        assert 3.5 * at < each.reached_s < 3.5 * (at + 1)


def test_six_targets_measured() -> None:
    task, body = placed("six_targets"), TwinWorld(example_rig()).body
    order = order_of(find_task("six_targets"))
    rng = np.random.default_rng(11)

    def noise(_: int) -> FloatArray:
        return rng.normal(scale=0.01, size=3)  # the tracker's, docs/benchmarks.md

    tracks = steered(body, task, order, start=START, noise=noise)
    result = run_task(task, order, tracks).trial.result()
    assert result.outcome is Outcome.COMPLETED
    measures = values(measured(Run(result, task, motion_of(tracks, result.stretches))))
    assert measures["nT"] == 6.0
    assert measures["tT"] == pytest.approx(measures["t"] / 6.0)
    # The tip cannot go shorter than straight from place to place, less the radius of 5 mm at both ends.
    points = np.array([tracks[0].tip_box, *(task.target(key).point_box for key in order)])
    assert measures["path_length"] > np.linalg.norm(np.diff(points, axis=0), axis=1).sum() - 11 * 5.0
    assert measures["tip_distance"] < 5.0
    # Minimum jerk in the controls is smooth at the tip; LDLJ of one such way alone would be -5.3.
    assert -3.0 < measures["sparc"] < -1.3
    assert -12.0 < measures["ldlj"] < -4.0
    assert "plane_angle" not in measures


def test_every_place_of_the_random_task_can_be_reached() -> None:
    task, body = placed("random_targets"), TwinWorld(example_rig()).body
    order = [each.key for each in task.targets]
    tracks = steered(body, task, order, start=START, rate_hz=20.0)
    assert run_task(task, order, tracks).trial.result().reached == 12


def test_practice_ends_after_three_in_a_row() -> None:
    task, body = placed("practice"), TwinWorld(example_rig()).body
    order = order_of(find_task("practice"), seed=3)
    result = run_task(task, order, steered(body, task, order, start=START, rate_hz=30.0)).trial.result()
    assert (result.outcome, result.reached) == (Outcome.COMPLETED, 3)
