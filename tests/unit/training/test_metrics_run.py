"""The metrics of whole trials: what they give, and when they give a reason instead."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from cathxr.core import FloatArray, Status
from cathxr.training.metrics import METRICS, Run, catalogue_text, measured, motion_of, values
from cathxr.training.metrics import curves as distances
from cathxr.training.metrics.motion import Motion
from cathxr.training.metrics.wall import breaches
from cathxr.training.placing import PlacedTarget
from cathxr.training.replay import run_task

from ...training_support.tracks import MS, placed, tip_target, track

RATE = 50


def ease(start: float, end: float, seconds: float) -> FloatArray:
    s = np.arange(round(seconds * RATE)) / (seconds * RATE)
    return start + (end - start) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def straight(rolls: Callable[[int], float | None] = lambda i: 0.0) -> list:
    """Along x: rest, 60 mm in 2 s, rest, back by 30 mm in 1 s, rest."""
    x = np.concatenate(
        [np.full(25, 10.0), ease(10.0, 70.0, 2.0), np.full(50, 70.0), ease(70.0, 40.0, 1.0), np.full(50, 40.0)]
    )
    return [track(i * 20 * MS, (each, 0.0, 0.0), roll_rad=rolls(i), seq=i) for i, each in enumerate(x)]


TASK = placed(
    tip_target("far", (70.0, 0.0, 0.0), radius=1.0, dwell_s=0.5),
    tip_target("back", (40.0, 0.0, 0.0), radius=1.0, dwell_s=0.5),
)


def run_of(stream: list, task=TASK, order=("far", "back"), **more: object) -> Run:
    result = run_task(task, order, stream).trial.result()
    return Run(result, task, motion_of(stream, result.stretches), **more)


def test_a_straight_run() -> None:
    measures = values(measured(run_of(straight())))
    assert measures["nT"] == 2.0
    # Along the line, every path is as straight as can be; the filter and the radius cost a little.
    assert measures["path_length"] == pytest.approx(90.0, abs=0.1)
    assert measures["axial_motion"] == pytest.approx(measures["path_length"])
    assert measures["path_inefficiency"] == pytest.approx(0.0, abs=0.2)
    # Minimum jerk: 1.875 times the mean speed.
    assert measures["peak_speed"] == pytest.approx(1.875 * 30.0, rel=0.01)
    assert measures["mean_speed"] == pytest.approx(measures["path_length"] / measures["t"], rel=0.01)
    assert measures["tT"] == pytest.approx(measures["t"] / 2.0)
    assert measures["translation_actions"] == 2.0
    assert measures["rotation_total"] == measures["rotation_actions"] == 0.0
    assert measures["tip_distance"] < 1.0
    # Minimum jerk, cut at 5 % of its greatest speed, s (1 − s) = sqrt(0.05 / 16): 0.881 of the time and 0.58 of the
    # squared jerk are left, −ln(0.881³ · 0.58 · 204.8) = −4.40; a step of 50 samples a second at each end is 0.1 of it.
    assert measures["ldlj"] == pytest.approx(-4.40, abs=0.2)
    assert -1.6 < measures["sparc"] < -1.3
    assert measures["unseen"] == 0.0
    # Rest at the start and both dwells, each with the slow ends of the moves beside it (under 1 mm/s: 0.1 s each).
    assert measures["idle_time"] == pytest.approx(0.5 + 0.5 + 0.5, abs=0.5)


def test_a_censored_trial_has_no_time() -> None:
    measures = measured(run_of(straight()[:150]))
    assert measures["nT"].value == 1.0
    for key in ("t", "tT"):
        assert measures[key].value is None
        assert "not completed" in measures[key].reason


def test_what_was_not_seen_is_said_and_not_summed() -> None:
    stream = straight()
    hidden = [track(each.t_ns, None) if 40 <= i < 90 else each for i, each in enumerate(stream)]
    measures = measured(run_of(hidden))
    for key in ("path_length", "mean_speed", "peak_speed", "rotation_total", "idle_time", "axial_motion"):
        assert "not seen in" in measures[key].reason
    # The way to the first target was hidden: only the second movement counts.
    assert measures["path_inefficiency"].value == pytest.approx(0.0, abs=0.3)
    coasting = [
        dataclasses.replace(each, status=Status.COASTING, reason="hidden") if 40 <= i < 90 else each
        for i, each in enumerate(stream)
    ]
    assert measured(run_of(coasting))["path_length"].value is None


def test_nothing_seen_at_all_gives_reasons_only() -> None:
    stream = [track(i * 20 * MS, None) for i in range(100)]
    measures = measured(run_of(stream, depth=lambda points: points[:, 0], expert_box=np.eye(3)))
    assert set(values(measures)) == {"nT", "misses", "unseen"}
    assert measures["unseen"].value == 100.0
    assert all(each.reason for each in measures.values() if each.value is None)


def test_roll_economy() -> None:
    there = run_of(straight(lambda i: 0.01 * i))
    assert values(measured(there))["roll_economy"] == pytest.approx(100.0)
    # To and fro by half a turn on the way: 1 rad net; 3 made.
    swing = run_of(
        straight(lambda i: min(i, 100) / 50.0 - max(0, min(i - 100, 50)) / 50.0), placed(TASK.targets[0]), ["far"]
    )
    assert values(measured(swing))["roll_economy"] == pytest.approx(100.0 * 1.0 / 3.0, rel=0.5)
    unknown = measured(run_of(straight(lambda i: None)))
    assert "hardly any known roll" in unknown["roll_economy"].reason


def test_beams_and_planes_are_measured_where_they_were_reached() -> None:
    beam = PlacedTarget("beam", "beam", "beam", np.array([50.0, -30.0, 2.0]), 5.0, range_mm=60.0)
    tip = [track(i * 20 * MS, (51.0, 0.0, 0.0)) for i in range(3)]
    measures = values(measured(run_of(tip, placed(beam), ["beam"])))
    assert measures["beam_distance"] == pytest.approx(math.hypot(1.0, 2.0))
    assert measures["aim_angle"] == pytest.approx(math.degrees(math.atan2(math.hypot(1.0, 2.0), 30.0)))
    tilted = np.array([math.sin(0.1), 0.0, -math.cos(0.1)])
    plane = PlacedTarget(
        "plane", "plane", "plane", np.array([20.0, -25.0, 1.5]), 3.0, angle_deg=10.0, up_deg=20.0,
        direction_box=tilted, up_box=np.array([0.0, -math.cos(0.15), math.sin(0.15)]),
    )  # fmt: skip
    measures = values(measured(run_of(tip, placed(plane), ["plane"])))
    assert measures["plane_angle"] == pytest.approx(math.degrees(0.1))
    assert measures["plane_direction"] == pytest.approx(math.degrees(0.15))
    assert measures["plane_offset"] == pytest.approx(1.5)
    assert "beam_distance" not in measures


def test_wall_breaches_of_a_sine() -> None:
    t = np.arange(0.0, 10.0, 0.001)
    x = 3.0 * np.sin(2.0 * np.pi * t / 5.0)
    motion = Motion.of(t, np.column_stack([x, 0.0 * t, 0.0 * t]))
    found = breaches(motion, lambda points: points[:, 0])
    # From 1 mm on, asin(1/3) after each upward crossing, until it crosses downwards; twice in 10 s.
    late = 5.0 * math.asin(1.0 / 3.0) / (2.0 * math.pi)
    assert found.count == 2
    assert found.time_s == pytest.approx(2.0 * (2.5 - late), abs=0.003)
    assert found.path_mm == pytest.approx(2.0 * (2.0 + 3.0), abs=0.02)
    assert found.depth_mm == pytest.approx(3.0, abs=1e-4)
    assert breaches(motion, lambda points: points[:, 0] - 2.5).count == 0


def test_wall_breaches_do_not_count_what_was_not_seen() -> None:
    at = np.arange(100)
    t = 0.01 * at
    motion = Motion.of(t, np.column_stack([5.0 + 10.0 * t, 0.0 * t, 0.0 * t]))
    hidden = Motion(**{**vars(motion), "seen": (at < 30) | (at > 70)})
    found = breaches(hidden, lambda points: points[:, 0])
    assert (found.count, found.time_s) == (2, pytest.approx(0.29 + 0.28))


def slow_frechet(first: FloatArray, second: FloatArray) -> float:
    """As its definition says, by recursion."""

    def down(i: int, j: int) -> float:
        here = float(np.linalg.norm(first[i] - second[j]))
        before = [down(a, b) for a, b in ((i - 1, j), (i, j - 1), (i - 1, j - 1)) if a >= 0 and b >= 0]
        return max(here, min(before)) if before else here

    return down(len(first) - 1, len(second) - 1)


def slow_dtw(first: FloatArray, second: FloatArray) -> float:
    def down(i: int, j: int) -> tuple[float, int]:
        here = float(np.linalg.norm(first[i] - second[j]))
        before = [down(a, b) for a, b in ((i - 1, j), (i, j - 1), (i - 1, j - 1)) if a >= 0 and b >= 0]
        cost, pairs = min(before) if before else (0.0, 0)
        return cost + here, pairs + 1

    cost, pairs = down(len(first) - 1, len(second) - 1)
    return cost / pairs


def test_distances_to_an_expert_against_closed_forms() -> None:
    x = np.linspace(0.0, 100.0, 400)
    line = np.column_stack([x, 0.0 * x, 0.0 * x])
    beside = line + np.array([0.0, 3.0, 4.0])
    for function in (distances.frechet_mm, distances.hausdorff_mm, distances.dtw_mm):
        assert function(line, beside) == pytest.approx(5.0)
        assert function(line, line) == 0.0
    # Backwards: as sets the same, as paths the length apart.
    assert distances.hausdorff_mm(line, line[::-1]) == 0.0
    assert distances.frechet_mm(line, line[::-1]) == pytest.approx(100.0)


def test_distances_to_an_expert_against_plain_references() -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        first, second = rng.normal(size=(6, 3)), rng.normal(size=(5, 3))
        assert distances.frechet_mm(first, second) == pytest.approx(slow_frechet(first, second))
        assert distances.dtw_mm(first, second) == pytest.approx(slow_dtw(first, second))


def test_pace_does_not_matter_to_a_path() -> None:
    stream = straight()
    expert = distances.path_points(run_of(stream).motion)
    measures = values(measured(run_of(stream[::2], expert_box=expert)))
    # Every second sample: the same way, at 400 points within half a step of each other.
    assert measures["frechet"] < 0.5
    assert measures["dtw"] < 0.5


def test_the_catalogue_is_whole_and_documented(repo_root) -> None:
    assert len({each.key for each in METRICS}) == len(METRICS)
    assert all(each.formula and each.source and each.name for each in METRICS)
    assert catalogue_text() in (repo_root / "docs" / "metrics.md").read_text(encoding="utf-8"), (
        "docs/metrics.md is old: put in what cathxr.training.metrics.catalogue_text() returns"
    )
