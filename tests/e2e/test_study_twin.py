"""`cathxr study simulate --twin`, the small case: from nothing to a report whose every number is in a recording."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from cathxr.app.cli import main
from cathxr.app.heart_registration import registration_of
from cathxr.app.score_inputs import wall_depth
from cathxr.core.trials import Outcome, TrialRecord
from cathxr.heart import builtin_path, read_heart
from cathxr.runtime.training_numbers import measures_of, record_of
from cathxr.runtime.training_recordings import LABEL, labelled, recorded_trial
from cathxr.storage.study_store import StudyStore


def _run(*arguments: object) -> str:
    result = CliRunner().invoke(main, [str(each) for each in arguments])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Two simulated people, one trial in each view."""
    folder = tmp_path_factory.mktemp("twin") / "whole"
    told = _run("study", "simulate", folder, "--twin", "--participants", 2, "--trials", 1, "--seed", 3)
    return folder, told


def _trials(folder: Path) -> tuple[TrialRecord, ...]:
    with StudyStore.open(folder / "study.sqlite", study="simulated") as store:
        assert not store.unfinished()
        return store.trials()


def test_everybody_is_done_and_the_report_is_there(whole: tuple[Path, str]) -> None:
    folder, told = whole
    assert "Simulated 2 participants" in told
    assert "2 of 2 planned participants are done" in _run("study", "board", "--study", folder)
    page = (folder / "report" / "report.html").read_text(encoding="utf-8")
    for what in ("Simulated hands steered the digital twin", "Paths of the tip", "SIM002-2-", "System Usability Scale"):
        assert what in page, what
    assert (folder / "report" / "report.pdf").read_bytes().startswith(b"%PDF-")


def test_every_number_is_in_its_recording(whole: tuple[Path, str]) -> None:
    folder, _ = whole
    heart = read_heart(builtin_path())
    depth = wall_depth(heart, registration_of(heart))
    trials = _trials(folder)
    starts = {each.id: each for each in labelled(folder / "recordings", study="simulated")}
    assert len(trials) == len(starts) >= 6
    for trial in trials:
        again = recorded_trial(folder / "recordings" / trial.session, trial.id)
        assert again.is_same
        measures = measures_of(again.result, again.replayed.trial.placed, again.tracks, depth)
        assert record_of(starts[trial.id], again.result, measures) == trial
        assert trial.box == "digital twin"
        assert trial.outcome in (Outcome.COMPLETED, Outcome.ABORTED)
    counted = [each for each in trials if each.outcome is Outcome.COMPLETED and not each.practice]
    assert sorted((each.participant, each.condition) for each in counted) == [
        (code, view) for code in ("SIM001", "SIM002") for view in ("2d", "3d")
    ]
    # Six targets up to 80 mm apart at 22 mm/s and more cannot be had within 6 s, nor do hands need minutes.
    assert all(6.0 < each.active_s < 120.0 for each in counted)
    assert all(each.measures["path_length"] > 150.0 and "breach_depth" in each.measures for each in counted)


def test_a_score_card_of_its_recording(whole: tuple[Path, str]) -> None:
    folder, _ = whole
    trial = next(each for each in _trials(folder) if not each.practice and each.outcome is Outcome.COMPLETED)
    told = _run("score", folder / "recordings" / trial.session, "--study", folder, "--no-wall")
    assert f"{trial.participant}: trial 1 of this task in this view, the first one" in told
    assert "1 other has done it" in told


def test_recordings_go_with_a_participant(whole: tuple[Path, str]) -> None:
    folder, _ = whole
    mine = [each.session for each in _trials(folder) if each.participant == "SIM002"]
    _run("study", "delete", "SIM002", "--study", folder, "--recordings", "--yes")
    assert {each.participant for each in _trials(folder)} == {"SIM001"}
    left = {each.parent.name for each in (folder / "recordings").glob(f"*/{LABEL}")}
    assert left
    assert left.isdisjoint(mine)


def test_what_does_not_go_together_is_refused(tmp_path: Path) -> None:
    for options, sentence in (
        (("--twin", "--limit", "60"), "the task's own time limit counts"),
        (("--rendered", "1"), "goes with --twin"),
    ):
        result = CliRunner().invoke(main, ["study", "simulate", str(tmp_path / "new"), *options])
        assert result.exit_code == 1
        assert sentence in result.output
        assert not (tmp_path / "new").exists()
