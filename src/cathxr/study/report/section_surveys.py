"""The section on surveys: ratings, scores, and the published table beside those of the same ten questions."""

import statistics

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.data import StudyData
from cathxr.study.analysis.estimates import number, p_cell, percent
from cathxr.study.analysis.paper_table import PAPER_RATINGS, PAPER_REMARK
from cathxr.study.analysis.survey_table import Row
from cathxr.study.report.document import Block, Heading, Paragraph, Table
from cathxr.study.report.figures_survey import ratings

_PAPER = "paper"
_MOST_COLUMNS = 8
_MOST_WORDS = 100


def surveys(analysis: Analysis) -> list[Block]:
    """Return the tables and pictures of every survey that has answers."""
    if not analysis.survey and not analysis.scores and not any(each.text for each in analysis.data.answers):
        return []
    blocks: list[Block] = [Heading("Surveys")]
    if analysis.scores:
        blocks += [_scores(analysis), *_compared(analysis)]
    scored = {each.survey for each in analysis.scores}
    for survey in dict.fromkeys(row.item.survey for row in analysis.survey):
        rows = tuple(row for row in analysis.survey if row.item.survey == survey)
        title = next((row.item.title for row in rows if row.item.title), survey)
        if survey in scored:
            blocks.append(_by_occasion(rows, title, analysis.data))
            continue
        for occasion in dict.fromkeys(row.occasion for row in rows):
            asked = tuple(row for row in rows if row.occasion == occasion)
            name = f"{title}, asked {analysis.data.occasion_of(occasion)}"
            blocks += [_table(asked, name, paper=survey == _PAPER), ratings(asked, name)]
    blocks += _words(analysis.data)
    if any(row.item.survey == _PAPER for row in analysis.survey):
        blocks.append(Paragraph(PAPER_REMARK, "small"))
    return blocks


def _compared(analysis: Analysis) -> list[Block]:
    if not analysis.score_comparisons:
        return []
    shown = tuple(
        (
            each.scale,
            analysis.data.occasion_of(each.first),
            analysis.data.occasion_of(each.second),
            str(each.n),
            number(each.difference),
            p_cell(each.test.p if each.test else None),
        )
        for each in analysis.score_comparisons
    )
    table = Table(
        "Scores after one view and after the other, by those who have both.",
        ("scale", "first", "second", "people", "mean difference", "p, signed-rank"),
        shown,
        numbers=(3, 4, 5),
        note="Exact signed-rank test, not corrected for the number of scales.",
        widths=(1.6, 1.3, 1.3, 0.7, 1.3, 1.2),
    )
    return [table, *(Paragraph(each.reading, "reading") for each in analysis.score_comparisons)]


def _by_occasion(rows: tuple[Row, ...], title: str, data: StudyData) -> Table:
    """Return one row a question and one column an occasion: of a scale whose score counts, not its single questions."""
    occasions = list(dict.fromkeys(row.occasion for row in rows))
    by_place = {(row.item.item, row.occasion): row for row in rows}
    shown = []
    for item in dict.fromkeys(row.item for row in rows):
        found = [by_place.get((item.item, occasion)) for occasion in occasions]
        shown.append((item.words, *(_mean(each) + f" ({each.n})" if each else "–" for each in found)))
    return Table(
        f"{title}, by question: mean ± SD of the sample (number of answers).",
        ("question", *(data.occasion_of(each) for each in occasions)),
        tuple(shown),
        numbers=tuple(range(1, len(occasions) + 1)),
        widths=(4.0, *([1.7] * len(occasions))),
    )


def _words(data: StudyData) -> list[Block]:
    """Return what was answered in words, question by question, as it was written."""
    given: dict[tuple[str, str], list[tuple[str, str, str]]] = {}
    for each in data.answers:
        if each.text:
            row = (each.participant, data.occasion_of(each.occasion), each.text)
            given.setdefault((each.survey, each.item), []).append(row)
    named = {(each.survey, each.item): each for each in data.items}
    blocks: list[Block] = []
    for (survey, item), rows in given.items():
        known = named.get((survey, item))
        title, asked = (survey, item) if known is None else (known.title or survey, known.words)
        left_out = len(rows) - _MOST_WORDS
        blocks.append(
            Table(
                f"{title}, in words: {asked}",
                ("participant", "asked", "answer"),
                tuple(rows[:_MOST_WORDS]),
                note=f"{left_out} more are in the export of the answers." if left_out > 0 else "",
                widths=(1.0, 1.2, 5.0),
            )
        )
    return blocks


def _mean(row: Row) -> str:
    return f"{row.mean:.2f}" + (f" ± {row.sd:.2f}" if row.sd is not None else "")


def _table(rows: tuple[Row, ...], name: str, *, paper: bool) -> Table:
    codes = sorted({code for row in rows for code, _ in row.ratings})
    listed = codes if len(codes) <= _MOST_COLUMNS else []
    keyed = all(len(row.item.item) <= 4 for row in rows)
    head = [*([""] if keyed else []), "question", *listed, "n", "mean ± SD", *([] if listed else ["median"])]
    head += ["paper: mean ± SD"] if paper else []
    shown = []
    for row in rows:
        given = dict(row.ratings)
        cells = [*([row.item.item.upper()] if keyed else []), row.item.words]
        cells += [f"{given[code]:g}" if code in given else "–" for code in listed]
        cells += [str(row.n), _mean(row), *([] if listed else [f"{row.median:g}"])]
        if paper:
            theirs = PAPER_RATINGS.get(row.item.item)
            cells.append(f"{statistics.mean(theirs):.2f} ± {statistics.stdev(theirs):.2f}" if theirs else "–")
        shown.append(tuple(cells))
    widths = [*([0.9] if keyed else []), 4.0, *([1.3] * len(listed)), 0.5, 2.3, *([] if listed else [1.2])]
    return Table(
        f"{name}. SD: of the sample (n − 1).",
        tuple(head),
        tuple(shown),
        numbers=tuple(range(2 if keyed else 1, len(head))),
        widths=(*widths, *([2.3] if paper else [])),
    )


def _scores(analysis: Analysis) -> Table:
    rows = tuple(
        (
            each.scale if each.survey.upper() in each.scale.upper() else f"{each.survey.upper()}: {each.scale}",
            analysis.data.occasion_of(each.occasion),
            str(each.n),
            number(each.mean) + (f" ± {number(each.sd)}" if each.sd is not None else ""),
            f"{number(each.interval[0])} to {number(each.interval[1])}" if each.interval else "–",
            each.unit,
        )
        for each in analysis.scores
    )
    return Table(
        "Scores of the surveys.",
        ("scale", "asked", "n", "mean ± SD", f"{percent(1.0 - analysis.data.alpha)} interval", "range of the scale"),
        rows,
        numbers=(2, 3, 4),
        note="A participant who left an item of a scale out has no score of it. Intervals end where the scale does.",
        widths=(2.4, 1.2, 0.5, 1.4, 1.5, 1.5),
    )
