"""`cathxr study simulate` and `cathxr study report` by the command line: from nothing to a page and a PDF."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from cathxr.app.cli import main


def _run(*arguments: str) -> str:
    result = CliRunner().invoke(main, ["study", *arguments])
    assert result.exit_code == 0, result.output
    return result.output


def test_a_simulated_study_from_nothing_to_its_report(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    told = _run("simulate", str(folder), "--participants", "6", "--limit", "200", "--seed", "4")
    assert "6 participants" in told
    told = _run("report", "--study", str(folder))
    assert "3D view" in told
    page = (folder / "report" / "report.html").read_text(encoding="utf-8")
    for what in (
        "These data are simulated",
        "Wilcoxon signed-rank",
        "0.031",
        "SIM006",
        "Workload (raw TLX)",
        "paper prints 3.6",
    ):
        assert what in page, what
    assert (folder / "report" / "report.pdf").read_bytes().startswith(b"%PDF-")
    assert sorted(each.name for each in (folder / "report").iterdir()) == ["report.html", "report.pdf"]


def test_one_order_for_all_is_said_on_the_console(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    _run("simulate", str(folder), "--participants", "4", "--2d-first")
    assert "not the view's alone" in _run("report", "--study", str(folder), "--out", str(tmp_path / "out"))


def test_what_is_there_is_not_overwritten(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["study", "simulate", str(tmp_path)])
    assert result.exit_code == 1
    assert "name a new folder" in result.output


def test_a_missing_library_is_said_in_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "reportlab", None)
    result = CliRunner().invoke(main, ["study", "report", "--study", str(tmp_path)])
    assert result.exit_code == 1
    assert "pip install 'cathxr[study]'" in result.output
