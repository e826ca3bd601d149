"""`cathxr score` and `cathxr tasks` as a person runs them, on recordings of a scripted hand."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cathxr.core import Event, Track
from cathxr.heart import builtin_path, read_heart
from cathxr.registration import read_registration
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionWriter
from cathxr.training import Trial, find_task, order_of, place_task, task_sha256
from cathxr.twin import TwinWorld

from ..training_support.hand import steered

START = np.array([30.0, 0.0, 0.0, 0.0])


def cathxr(*args: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cathxr", *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")


def recorded(folder: Path, tracks: list[Track], events: list[Event]) -> Path:
    clock = (tracks[0].t_ns, "2026-01-01T00:00:00Z")
    writer = SessionWriter(folder, rig=example_rig(), config={}, clock_pair=clock, videos=False)
    for each in tracks:
        writer.write_track(each)
    for event in events:
        writer.write_event(event)
    writer.close()
    return folder


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Trial]:
    """Six targets done live, with a pause, into a recording that begins earlier."""
    heart, task = read_heart(builtin_path()), find_task("six_targets")
    assert heart.registration is not None
    placed = place_task(
        task, ct_from_box=read_registration(heart.registration).matrix, points_ct=heart.points_ct,
        roi=example_rig().roi, sha256=task_sha256(task),
    )  # fmt: skip
    order = order_of(task, row=1)
    tracks = steered(TwinWorld(example_rig()).body, placed, order, start=START, start_ns=1_000_000_000, rate_hz=30.0)
    trial, events = Trial(placed, order, trial="T-1"), []
    for i, track in enumerate(tracks):
        events += trial.take(track)
        if i == 10:
            events += trial.begin(track.t_ns + 40_000_000)
        elif i == 200:
            events += trial.pause(track.t_ns + 55_000_000)
        elif i == 215:
            events += trial.resume(track.t_ns + 10_000_000)
    return recorded(tmp_path_factory.mktemp("score") / "first", tracks, events), trial


def test_a_recorded_trial_is_scored_as_it_was(session: tuple[Path, Trial], tmp_path: Path) -> None:
    folder, trial = session
    done = cathxr("score", folder, "--out", tmp_path / "score.json", "--expert", folder)
    assert done.returncode == 0, done.stderr
    assert "Six targets: completed, 6 reached" in done.stdout
    document = json.loads((tmp_path / "score.json").read_text(encoding="utf-8"))
    (scored,) = document["trials"]
    result = trial.result()
    assert (scored["trial"], scored["outcome"], scored["active_s"]) == ("T-1", "completed", result.active_s)
    assert scored["targets"] == [dict(vars(each)) for each in result.targets]
    assert scored["task_sha256"] == task_sha256(find_task("six_targets"))
    assert scored["measures"]["t"] == result.active_s
    assert scored["measures"]["breach_depth"] > 0.0  # through the septum
    # The expert's path holds the whole recording, the trial only its own part and no pause.
    assert scored["measures"]["dtw"] < 2.0
    assert set(scored["measures"]) & set(scored["absent"]) == set()
    assert scored["absent"]["plane_angle"] == "no view was reached"


def test_a_task_is_done_on_any_recording(session: tuple[Path, Trial], tmp_path: Path) -> None:
    done = cathxr("score", session[0], "--task", "six_targets", "--row", 1, "--no-wall", "--out", tmp_path / "s.json")
    assert done.returncode == 0, done.stderr
    (scored,) = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))["trials"]
    assert scored["outcome"] == "completed"
    assert "no wall is known" in scored["absent"]["breach_count"]
    other = cathxr("score", session[0], "--task", "clockwise_sweep", "--no-wall")
    assert other.returncode == 0, other.stderr
    assert "not completed" in other.stdout


def test_failures_are_one_sentence(session: tuple[Path, Trial], tmp_path: Path) -> None:
    plain = recorded(tmp_path / "plain", [Track(0, 1, *_lost())], [])
    for args, sentence in (
        ((plain,), "no trial was recorded here"),
        ((tmp_path / "none",), "expected a session folder"),
        ((session[0], "--task", "nothing"), "There is no task 'nothing'"),
        ((session[0], "--out", tmp_path / "no" / "s.json"), "does not exist"),
    ):
        done = cathxr("score", *args)
        assert done.returncode == 1
        assert sentence in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1


def test_tasks(tmp_path: Path) -> None:
    listed = cathxr("tasks", "list")
    assert "clockwise_sweep" in listed.stdout
    mine = tmp_path / "mine.toml"
    mine.write_text(cathxr("tasks", "show", "six_targets").stdout, encoding="utf-8")
    checked = cathxr("tasks", "check", mine)
    assert checked.returncode == 0, checked.stderr
    assert "6 targets: the task fits." in checked.stdout
    mine.write_text(mine.read_text(encoding="utf-8").replace("tricuspid_valve\"\nname", "x\"\nname").replace(
        'landmark = "tricuspid_valve"', 'landmark = "foramen"'), encoding="utf-8")  # fmt: skip
    refused = cathxr("tasks", "check", mine)
    assert refused.returncode == 1
    assert "foramen" in refused.stderr


def _lost() -> tuple[object, str]:
    from cathxr.core import Status

    return Status.LOST, "no catheter"
