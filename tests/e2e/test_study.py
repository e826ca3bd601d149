"""`cathxr study` as a person runs it, from the design to the deleted participant."""

import csv
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from cathxr.app.cli import main
from cathxr.core.trials import Outcome, TargetResult, TrialRecord, TrialStart
from cathxr.storage.study_store import StudyStore

TABLE_1 = Path(__file__).with_name("table_1.csv")
AT = "2026-01-01T00:00:00Z"


def study(*arguments: object, typed: str | None = None) -> Result:
    return CliRunner().invoke(main, ["study", *map(str, arguments)], input=typed)


def said(done: Result) -> str:
    assert done.exit_code == 0, done.output
    assert done.stderr == ""
    return done.stdout


def told(done: Result) -> str:
    """Return the one sentence of a failure."""
    assert done.exit_code == 1, done.output
    assert done.stderr.startswith("Error: ")
    assert done.stderr.count("\n") == 1
    return done.stderr


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def trial(code: str, condition: str, number: int, period: int, **more: object) -> TrialRecord:
    fields: dict[str, object] = {
        "id": f"{code}-{condition}-{number}", "participant": code, "task": "six_targets", "condition": condition,
        "number": number, "period": period, "began": f"2026-01-01T10:0{number}:00Z", "outcome": Outcome.COMPLETED,
        "active_s": 31.25, "targets": (TargetResult("a", 0.0, 31.25, 80.5),), "measures": {"t": 31.25, "sparc": -2.5},
        "session": f"{code}-{condition}-{number}", "box": "box-1", "software": "1.0",
    }  # fmt: skip
    return TrialRecord(**(fields | more))  # type: ignore[arg-type]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "views"
    said(study("init", made, "--title", 'The "views"', "--planned", 8))
    return made


def test_a_study_from_its_design_to_its_export(folder: Path, tmp_path: Path) -> None:
    here = ("--study", folder)
    assert 'title = "The \\"views\\""' in (folder / "study.toml").read_text("utf-8")
    sequence = {}
    for code in ("P01", "p02", "P03"):
        words = said(study("allocate", code, *here))
        sequence[code.upper()] = ("2d", "3d") if "2D view then 3D view" in words else ("3d", "2d")
    assert "draw 1" in said(study("allocate", "P01", *here))
    assert said(study("allocate", "--check", *here)) == "All 3 draws are those that the seed gives.\n"
    assert said(study("next", "P01", *here)) == "P01: survey ssq, before.\n"
    typed = "7\n" + "0\n" * 16
    asked = said(study("survey", "P01", "ssq", "--occasion", "before", *here, typed=typed))
    assert "expected a number from 0 to 3" in asked
    assert asked.endswith("Kept 16 answers of P01 to ssq, before.\n")
    first, second = sequence["P01"]
    step = json.loads(said(study("next", "P01", *here, "--json")))
    assert (step["kind"], step["condition"], step["task"]) == ("practice", first, "practice")
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        store.record(trial("P01", first, 1, 0, practice=True, id="practice"), at=AT)
        store.record_all([trial("P01", first, number, 1) for number in (1, 2)], at=AT)
        store.record(trial("P01", second, 1, 2, unseen_share=0.5), at=AT)
        store.begin(TrialStart("cut", "P01", "six_targets", first, 3, 1, AT, session="cut"), at=AT)
    assert "Trial cut began at" in said(study("next", "P01", *here))
    shown = said(study("board", *here))
    assert f"{first} 2/3, {second} 0/3 (+1 invalid)" in shown
    assert "0 of 8 planned participants are done; 3 are enrolled." in shown
    assert "Trial cut of P01" in shown
    said(study("mark", "cut", "--interrupted", *here))
    said(study("mark", f"P01-{first}-2", "--invalid", "slipped", *here))
    assert "trial 2 of 3" in said(study("next", "P01", *here))
    out = tmp_path / "data"
    said(study("export", out, *here))
    trials = {each["trial"]: each for each in table(out / "trials.csv")}
    assert {key: each["counts"] for key, each in trials.items()} == {
        "practice": "0", f"P01-{first}-1": "0", f"P01-{first}-2": "0", f"P01-{second}-1": "0", "cut": "0",
    }  # fmt: skip
    assert trials[f"P01-{first}-2"]["why_not"] == "slipped"
    # P01 has no trial that counts in the second condition, and one rule is that such a participant does not count
    assert "valid trials is below 1" in trials[f"P01-{first}-1"]["why_not"]
    assert trials[f"P01-{first}-1"]["m_sparc"] == "-2.5"
    assert trials["cut"]["m_t"] == ""
    dictionary = table(out / "dictionary.csv")
    assert ("m_t", "s") in {(each["column"], each["unit"]) for each in dictionary}
    for path in out.iterdir():
        columns = [each["column"] for each in dictionary if each["file"] == path.name]
        with path.open(encoding="utf-8", newline="") as file:
            header = next(csv.reader(file))
        assert header == columns or path.name == "dictionary.csv"
    assert all(each["meaning"] for each in dictionary)
    assert "there already" in told(study("export", out, *here))


def test_the_papers_table_1_is_entered(folder: Path, tmp_path: Path) -> None:
    here = ("--study", folder)
    sentence = told(study("enter", TABLE_1, "--survey", "paper", *here))
    assert "not enrolled: S1, S2, S3, S4, S5, S6" in sentence
    assert said(study("enter", TABLE_1, "--survey", "paper", "--enrol", *here)).startswith("60 of 60 answers are new")
    assert said(study("enter", TABLE_1, "--survey", "paper", *here)).startswith("0 of 60 answers are new")
    out = tmp_path / "data"
    said(study("export", out, *here))
    answers = table(out / "answers.csv")
    third = [float(each["value"]) for each in answers if each["item"] == "q3"]
    assert len(third) == 6
    # the paper prints 3.6
    assert round(statistics.mean(third), 2) == 3.67
    assert round(statistics.stdev(third), 2) == 1.63


def test_a_wrong_cell_enters_nothing(folder: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("participant,q1,q2\nS1,3,6\nAnna,3,3\nS2,x,1\nS1,1,1\n", encoding="utf-8")
    sentence = told(study("enter", wrong, "--survey", "paper", "--enrol", "--study", folder))
    for words in ("line 2: S1, q2: expected a number from 1 to 5", "line 3: Participant code: ANNA looks like a name",
                  "line 4: S2, q1", "Nothing was entered"):  # fmt: skip
        assert words in sentence
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        assert store.answers() == ()
        assert store.participants() == ()
    wrong.write_text("participant,survey,item,occasion,value\nS1,paper,q1,end,3\nS1,paper,q1,end,4\n", encoding="utf-8")
    assert "answers q1 twice" in told(study("enter", wrong, "--enrol", "--study", folder))
    long = "participant,survey,item,occasion,value,answered\nS1,paper,q1,end,3,"
    for text, words in (
        (long + "yesterday\n", "line 2: answered: expected a date and time"),
        (long.replace(",end,", ",never,") + "\n", "line 2: occasion: expected one of end, got never"),
        (long + "9" * 140_000, "line 2: field larger than field limit"),
        (long + '"2026\n', "line 2: unexpected end of data"),
        (long.replace(",", ";") + "\n", "expected commas between the cells"),
        ("\n\n", "got an empty file"),
    ):
        wrong.write_text(text, encoding="utf-8")
        assert words in told(study("enter", wrong, "--enrol", "--study", folder))
    wrong.write_text("participant,q99\nS1,3\n", encoding="utf-8")
    assert "got the column 'q99'" in told(study("enter", wrong, "--survey", "paper", "--study", folder))


def test_the_design_is_fixed_by_the_first_draw(folder: Path) -> None:
    file = folder / "study.toml"
    first = file.read_text("utf-8")
    file.write_text(first.replace("above = 0.25", "above = 0.5"), encoding="utf-8")
    assert "is not the design that was adopted" in told(study("allocate", "P01", "--study", folder))
    assert "Design version 2" in said(study("init", folder))
    said(study("allocate", "P01", "--study", folder))
    file.write_text(first, encoding="utf-8")
    assert "the design is fixed" in told(study("init", folder))
    assert "Design version 3" in said(study("init", folder, "--reason", "a pilot showed it"))
    for old, new, words in (
        ('primary = "t"', 'primary = "speed"', "no metric speed"),
        ('tasks = ["six_targets"]', 'tasks = ["seven"]', "no task seven"),
        ('survey = "tlx"', 'survey = "mood"', "no survey mood"),
        ('tasks = ["six_targets"]', 'tasks = ["practice"]', "practice is practice and nothing else"),
        ('primary = "t"', 'primary = "frechet"', "frechet needs an expert's run"),
    ):
        file.write_text(first.replace(old, new), encoding="utf-8")
        assert words in told(study("init", folder, "--reason", "x"))
    file.write_text(first, encoding="utf-8")
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        assert [each.reason for each in store.designs()] == ["", "", "a pilot showed it"]


def test_a_participant_is_deleted_with_the_recordings(folder: Path) -> None:
    here = ("--study", folder)
    for code in ("P01", "P02"):
        said(study("allocate", code, *here))
    recordings = folder / "recordings"
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        for code in ("P01", "P02"):
            store.record(trial(code, "2d", 1, 1), at=AT)
            store.record(trial(code, "2d", 2, 1, session="both"), at=AT)
        store.record(trial("P01", "3d", 1, 2, session="gone-already"), at=AT)
    for name in ("P01-2d-1", "P02-2d-1", "both"):
        (recordings / name).mkdir(parents=True)
        (recordings / name / "session.toml").write_text("", encoding="utf-8")
    assert study("delete", "P01", *here, typed="n\n").exit_code == 1
    words = said(study("delete", "P01", "--recordings", "--yes", *here))
    assert "Deleted P01: 3 trials, 0 answers, 1 recordings." in words
    assert "gone-already was not there any more" in words
    assert "both stays: it holds other participants' trials too" in words
    assert sorted(each.name for each in recordings.iterdir()) == ["P02-2d-1", "both"]
    assert b"P01" not in (folder / "study.sqlite").read_bytes()
    assert "no participant P01" in told(study("delete", "P01", "--yes", *here))


@pytest.mark.parametrize("session", ["../outside", "/etc", "no-session", "."])
def test_nothing_else_than_a_session_is_deleted(folder: Path, session: str) -> None:
    said(study("allocate", "P01", "--study", folder))
    for path in (folder / "outside", folder / "recordings" / "no-session"):
        path.mkdir(parents=True)
        (path / "thesis.txt").write_text("x", encoding="utf-8")
    (folder / "outside" / "session.toml").write_text("", encoding="utf-8")
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        store.record(trial("P01", "2d", 1, 1, session=session), at=AT)
    told(study("delete", "P01", "--recordings", "--yes", "--study", folder))
    assert (folder / "outside" / "thesis.txt").is_file()
    assert (folder / "recordings" / "no-session" / "thesis.txt").is_file()
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        assert len(store.trials()) == 1


def test_without_the_extra_one_sentence_says_what_to_install(folder: Path, tmp_path: Path) -> None:
    fake = tmp_path / "fake" / "sqlalchemy"
    fake.mkdir(parents=True)
    lines = 'raise ModuleNotFoundError("No module named \'sqlalchemy\'", name="sqlalchemy")\n'
    (fake / "__init__.py").write_text(lines, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path / "fake"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "cathxr", "study", "board", "--study", str(folder)],
        capture_output=True, text=True, encoding="utf-8", check=False, env=os.environ | {"PYTHONPATH": path},
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr == "Error: Studies need sqlalchemy, which is not installed: pip install 'cathxr[study]'.\n"


def test_a_survey_that_is_broken_off_keeps_nothing(folder: Path) -> None:
    said(study("allocate", "P01", "--study", folder))
    done = study("survey", "P01", "sus", "--study", folder, typed="1\n2\n")
    assert done.exit_code == 1
    with StudyStore.open(folder / "study.sqlite", study="views") as store:
        assert store.answers() == ()
    assert "--occasion: expected one of before, after:" in told(study("survey", "P01", "ssq", "--study", folder))
