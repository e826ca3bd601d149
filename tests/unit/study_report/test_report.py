"""The report: what it must say, that it asks nothing of a network, that both writers take every block."""

import base64
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cathxr.core.trials import Answer
from cathxr.study.analysis.analyse import analyse
from cathxr.study.analysis.data import Condition, Measure, StudyData, SurveyItem
from cathxr.study.analysis.estimates import verb_of
from cathxr.study.analysis.paper_table import PAPER_RATINGS
from cathxr.study.report.compose import Made, report
from cathxr.study.report.document import Bullets, Document, Figure, Heading, Paragraph, Table, numbered
from cathxr.study.report.figures_paths import TrialPath
from cathxr.study.report.html import html
from cathxr.study.report.pdf import pdf
from cathxr.study.simulate import EVERYBODY_2D_FIRST, Effects, Plan, simulated

SIMULATED = "These data are simulated: no person took part."
MADE = Made(
    "2026-01-09T10:00:00Z",
    "0.0",
    (("statsmodels", "0"),),
    question="Is 3D faster?",
    simulated=SIMULATED,
)
CONDITIONS = (Condition("2d", "2D view"), Condition("3d", "3D <view>"))


def _data(plan: Plan, limit_s: float | None = 190.0) -> StudyData:
    study = simulated(plan, Effects(limit_s=limit_s), np.random.default_rng(1))
    answers = tuple(
        Answer(study.participants[at].code, "paper", item, "after", "2026-01-09T10:00:00Z", float(value))
        for item, row in PAPER_RATINGS.items()
        for at, value in enumerate(row[: len(study.participants)])
    )
    items = tuple(SurveyItem("paper", item, f"Question {item}?", 1.0, 5.0) for item in PAPER_RATINGS)
    secondary = (
        Measure("sparc", "SPARC", "", "higher"), Measure("path_length", "Path length", "mm", log=True),
        Measure("breach_count", "Virtual wall breaches", count=True),
    )  # fmt: skip
    return StudyData(
        "A & B <study>", CONDITIONS, study.participants, study.trials, answers, secondary=secondary, items=items,
        rules=("A trial that was unseen for over 20 % does not count.",),
    )  # fmt: skip


def _path(trial: str, condition: str) -> TrialPath:
    tip = np.cumsum(np.random.default_rng(2).normal(0.0, 1.0, (60, 3)), axis=0)
    seen = np.ones(60, dtype=bool)
    seen[20:30] = False
    return TrialPath(trial, condition, tip, seen, np.zeros((1, 3)))


@cache
def _document() -> Document:
    data = _data(Plan(participants=6, practice=1))
    return report(analyse(data), MADE, [_path("a", "2d"), _path("b", "3d")])


def _words(document: Document) -> str:
    told = []
    for block in document.blocks:
        if isinstance(block, Heading | Paragraph):
            told.append(block.text)
        elif isinstance(block, Bullets):
            told += block.items
        elif isinstance(block, Table):
            told += [block.caption, block.note, *block.head, *(cell for row in block.rows for cell in row)]
        else:
            told += [block.caption, block.alt]
    return "\n".join(told)


def test_it_says_what_it_must() -> None:
    words = _words(_document())
    for what in (
        "Flow of participants", "Wilcoxon signed-rank", "Paired permutation", "0.031", "6 participants", "SIM001",
        "Kaplan-Meier", "Learning curves", "hazard ratio", "Hodges-Lehmann", "p, Holm", "Paths of the tip",
        "carry-over", "3.67 ± 1.63", "3.67 ± 1.03", "paper prints 3.6", "simulated: no person took part",
        "Exclusion rules", "not a medical device", "Familiarisation", "between-within", "view × period",
        "Does the view do the same in both periods?", "model for counts", "Mancl", "virtual wall breaches were",
    ):  # fmt: skip
        assert what in words, what
    assert "nan" not in words.lower().split()


def test_the_page_asks_nothing_of_a_network_and_is_escaped() -> None:
    page = html(_document())
    assert "A &amp; B &lt;study&gt;" in page
    assert "<script" not in page
    assert "3D <view>" not in page
    assert "\u00a0%" in page
    assert " %" not in re.sub(r"<[^>]*>", "", page.split("<body", 1)[1])  # no line ends before a per cent sign
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert sources
    assert all(each.startswith(("data:", "#")) for each in sources)
    assert "url(" not in page
    figures = [block for block in _document().blocks if isinstance(block, Figure)]
    assert page.count("<img") == len(figures) > 5
    for data in re.findall(r"data:image/svg\+xml;base64,([^\"]+)", page):
        svg = base64.b64decode(data).decode()
        assert "<svg" in svg
        assert not re.search(r'href="(?!#|data:)', svg)
        assert "<dc:date>" not in svg
    assert len(re.findall('alt="[^"]{10,}"', page)) == len(figures)


def test_numbers_of_tables_and_figures_are_in_order() -> None:
    labels = [each.label for each in numbered(_document().blocks) if each.label]
    tables = [each for each in labels if each.startswith("Table")]
    assert tables == [f"Table {at}" for at in range(1, len(tables) + 1)]


def test_the_pdf_is_one_and_the_same_each_time() -> None:
    first = pdf(_document())
    assert first.startswith(b"%PDF-")
    assert first.rstrip().endswith(b"%%EOF")
    assert first == pdf(_document())


def test_one_order_for_all_warns_and_does_not_claim() -> None:
    data = _data(Plan(participants=6, sequences=EVERYBODY_2D_FIRST), limit_s=None)
    document = report(analyse(data), MADE)
    warnings = [b.text for b in document.blocks if isinstance(b, Paragraph) and b.kind == "warning"]
    assert any("cannot be told from practice" in each for each in warnings)
    assert "speaks in favour" not in _words(document)


@pytest.mark.parametrize("people", [0, 1, 2])
def test_a_study_that_has_hardly_begun_has_a_report(people: int) -> None:
    data = _data(Plan(participants=people, trials=1))
    document = report(analyse(data), replace(MADE, simulated=""))
    assert html(document)
    assert pdf(document).startswith(b"%PDF-")


def test_a_path_keeps_its_gap() -> None:
    runs = _path("a", "2d").runs()
    assert [len(each) for each in runs] == [20, 30]


def test_three_views_in_a_latin_square() -> None:
    plan = Plan(
        participants=6, conditions=("2d", "3d", "free"),
        sequences=(("2d", "3d", "free"), ("3d", "free", "2d"), ("free", "2d", "3d")),
    )  # fmt: skip
    study = simulated(plan, Effects(), np.random.default_rng(3))
    conditions = tuple(Condition(each, each.upper()) for each in plan.conditions)
    found = analyse(StudyData("three", conditions, study.participants, study.trials))
    assert len(found.primary.model.of_kind("view")) == 2
    assert len(found.primary.holm_p) == 2
    assert pdf(report(found, MADE)).startswith(b"%PDF-")


def test_a_primary_outcome_that_is_a_count_and_one_without_any() -> None:
    data = _data(Plan(participants=6), limit_s=None)
    counts = replace(data, primary=Measure("breach_count", "Virtual wall breaches", count=True), secondary=())
    words = _words(report(analyse(counts), MADE))
    assert "Model for counts" in words
    assert "~ view + period + trial, Poisson regression" in words
    assert "virtual wall breaches were" in words
    none = tuple(replace(t, measures={**t.measures, "breach_count": 0.0 if t.condition == "3d" else 2.0})
                 for t in data.trials)  # fmt: skip
    words = _words(report(analyse(replace(data, trials=none)), MADE))
    assert "none at all with 3D <view>" in words
    assert "0.031" in words


def test_tables_must_fit_their_heads() -> None:
    with pytest.raises(ValueError, match="2 cells"):
        Table("x", ("a", "b"), (("1",),))


def test_groups_are_told_apart_where_there_are_some() -> None:
    data = _data(Plan(participants=8))
    assert "Groups compared" not in _words(report(analyse(data), MADE))
    people = tuple(replace(each, group=("novice", "expert")[at // 2 % 2]) for at, each in enumerate(data.participants))
    document = report(analyse(replace(data, participants=people)), MADE)
    words = _words(document)
    for what in ("expert − novice", "by group and view", "Nobody is put into a group by chance", "In group expert, "):
        assert what in words
    assert "expert − novice" in html(document)
    assert pdf(document).startswith(b"%PDF")


def test_what_is_counted_is_told_in_the_plural() -> None:
    assert [verb_of(each) for each in ("Completion time", "Virtual wall breaches", "Targets reached")] == [
        "was", "were", "were",
    ]  # fmt: skip
    assert [verb_of(each) for each in ("Smoothness (SPARC)", "Motion along the tip's axis")] == ["was", "was"]
