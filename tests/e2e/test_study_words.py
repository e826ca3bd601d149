"""Answers in words: from a survey of one's own over every way in, to the export and the report."""

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner

from cathxr.app.cli import main
from cathxr.app.study_folder import open_study
from cathxr.app.training_parts import study_here
from cathxr.core import ConfigError
from cathxr.runtime.training_nouns import Known
from cathxr.runtime.training_say import survey_message
from cathxr.runtime.training_surveys import checked_answers, with_answers

from ..training_support.surveys import WITH_WORDS


def _run(*arguments: object, typed: str = "") -> str:
    result = CliRunner().invoke(main, [str(each) for each in arguments], input=typed)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study that asks a survey of its own at the end, of three people."""
    made = tmp_path / "study"
    _run("study", "init", made)
    design = (made / "study.toml").read_text(encoding="utf-8")
    design += '\n[[surveys]]\nsurvey = "course"\nasked = "end"\n'
    (made / "study.toml").write_text(design, encoding="utf-8", newline="\n")
    (made / "surveys").mkdir(exist_ok=True)
    (made / "surveys" / "course.toml").write_text(WITH_WORDS, encoding="utf-8", newline="\n")
    _run("study", "init", made)
    for code in ("P01", "P02", "P03"):
        _run("study", "allocate", code, "--study", made)
    return made


def test_words_go_all_the_way(folder: Path, tmp_path: Path) -> None:
    # at the console, from paper, and from the page
    _run("study", "survey", "P01", "course", "--study", folder, typed="4\nThe <knob> was stiff; größer wäre besser\n")
    paper = tmp_path / "paper.csv"
    paper.write_text('participant,clear,remark\nP02,5,"more time, please"\n', encoding="utf-8", newline="\n")
    _run("study", "enter", paper, "--survey", "course", "--study", folder)
    here = study_here(folder, None)
    asked = survey_message(here.surveys["course"], "P03", "end", ())
    with pytest.raises(ConfigError, match="expected words"):
        checked_answers(here, asked, {"remark": 3.0}, done=False, at="2026-01-01T00:00:00Z")
    given = checked_answers(here, asked, {"clear": 3.0, "remark": " nothing "}, done=True, at="2026-01-01T00:00:00Z")
    with open_study(folder, None) as study:
        study.store.answer(given, at="2026-01-01T00:00:00Z")
        kept = study.store.answers()
    assert with_answers(here, Known(answers=kept), asked).answers == {"clear": 3.0, "remark": "nothing"}
    _run("study", "export", tmp_path / "out", "--study", folder)
    with (tmp_path / "out" / "answers.csv").open(encoding="utf-8", newline="") as file:
        rows = {each["participant"]: each for each in csv.DictReader(file) if each["item"] == "remark"}
    said = {code: row["words"] for code, row in rows.items()}
    assert said == {
        "P01": "The <knob> was stiff; größer wäre besser", "P02": "more time, please", "P03": "nothing",
    }  # fmt: skip
    _run("study", "report", "--study", folder)
    page = (folder / "report" / "report.html").read_text(encoding="utf-8")
    assert "After the course, in words: Anything else?" in page
    assert "The &lt;knob&gt; was stiff; größer wäre besser" in page
    assert "more time, please" in page
