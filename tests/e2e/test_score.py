"""`cathxr score` and `cathxr tasks` as a person runs them, on recordings of a scripted hand."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from cathxr.app.cli import main
from cathxr.core import Event, Track
from cathxr.core.trials import Outcome, Participant, TrialRecord
from cathxr.heart import builtin_path, read_heart
from cathxr.registration import read_registration
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionWriter
from cathxr.storage.study_store import StudyStore
from cathxr.study.design_template import design_template
from cathxr.training import Trial, find_task, order_of, place_task, task_sha256
from cathxr.twin import TwinWorld

from ..training_support.hand import steered

START = np.array([30.0, 0.0, 0.0, 0.0])


def cathxr(*args: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cathxr", *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")


def here(*args: object) -> Result:
    """Run a command in this process, which takes a tenth of the time."""
    return CliRunner().invoke(main, [str(each) for each in args])


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


def stored(folder: Path, done: Trial) -> Path:
    """Return the folder of a study in which P01 has done three trials, the last the recorded one, and others theirs."""
    text = design_template(key="s", title="s", task="six_targets", practice="practice", planned=8)
    folder.mkdir()
    (folder / "study.toml").write_text(text, encoding="utf-8")
    result = done.result()

    def record(identifier: str, code: str, day: int, t_s: float) -> TrialRecord:
        return TrialRecord(
            identifier, code, "six_targets", "3d", day, 1, f"2026-01-{day:02d}T09:00:00Z", Outcome.COMPLETED, t_s,
            measures={"t": t_s, "sparc": -2.0 - 0.001 * t_s},
        )  # fmt: skip

    mine = [record("A", "P01", 1, 2.0 * result.active_s), record("B", "P01", 2, 1.5 * result.active_s)]
    mine.append(record("T-1", "P01", 3, result.active_s))
    others = [record(f"O{n}", f"Q{n}", 1, share * result.active_s) for n, share in enumerate((0.5, 0.9, 1.2, 3.0, 4.0))]
    with StudyStore.create(folder / "study.sqlite", study="s", seed=1, software="0", at="2026-01-01") as store:
        store.adopt(text, at="2026-01-01")
        for code in sorted({each.participant for each in (*mine, *others)}):
            store.enrol(Participant(code), at="2026-01-01")
        store.record_all([*mine, *others], at="2026-01-03")
    return folder


def test_a_score_card_compares_with_own_best_and_cohort(session: tuple[Path, Trial], tmp_path: Path) -> None:
    study = stored(tmp_path / "study", session[1])
    done = here("score", session[0], "--no-wall", "--study", study, "--out", tmp_path / "s.json")
    assert done.exit_code == 0, done.output
    assert "P01: trial 3 of this task in this view. Better than ever before: Completion time" in done.output
    assert "5 others have done it." in done.output
    (scored,) = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))["trials"]
    time = next(each for each in scored["card"]["lines"] if each["metric"] == "t")
    mine = session[1].result().active_s
    assert [value for _, value in time["history"]] == [2.0 * mine, 1.5 * mine, mine]
    # Two of five others were faster: 60 % are slower.
    assert (time["best_before"], time["is_best"], time["percentile"], time["others"]) == (1.5 * mine, True, 60.0, 5)
    assert "60 % of 5" in done.output
    assert "█▄▁" in done.output


def test_a_score_card_needs_a_trial_of_the_study(session: tuple[Path, Trial], tmp_path: Path) -> None:
    study = stored(tmp_path / "study", session[1])
    with StudyStore.open(study / "study.sqlite", study="s") as store:
        store.delete("P01", at="2026-01-04")
    for more, sentence in (((), "has no trial T-1"), (("--task", "six_targets"), "leave it or --study out")):
        done = here("score", session[0], "--no-wall", "--study", study, *more)
        assert done.exit_code == 1
        assert sentence in done.output


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
