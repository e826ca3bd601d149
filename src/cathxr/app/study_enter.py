"""`cathxr study enter`: answers from a CSV file, all of them or none."""

import csv
import datetime
import io
import math
from collections.abc import Mapping
from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.study_folder import StudyAtHand, checked_code, now, open_study, read_small, study_options
from cathxr.app.study_survey import occasion_of
from cathxr.core import ConfigError, DataError
from cathxr.core.trials import Answer, Participant
from cathxr.study.surveys import Kind, Survey

_LONG = {"participant", "survey", "item", "occasion", "value"}
_SHOWN = 5


@click.command("enter")
@click.argument("file", type=click.Path(path_type=Path))
@study_options
@click.option("--survey", help="The survey, where the file has a column for every item.")
@click.option("--occasion", help="When it was asked.  [default: the design's, where it is only one]")
@click.option("--enrol", is_flag=True, help="Enrol codes that are new, without a draw.")
@click.option("--replace", is_flag=True, help="Put these answers in place of others; the log keeps the old ones.")
@told_in_a_sentence
def enter(
    file: Path, folder: Path, store: str | None, survey: str | None, occasion: str | None, enrol: bool, replace: bool
) -> None:
    """Enter answers that were given on paper or elsewhere.

    FILE is a CSV with a column participant and one for each item (then --survey says which survey), or with the columns
    participant, survey, item, occasion, value. An empty cell is no answer.

    \b
    Examples:
      cathxr study enter table1.csv --survey paper --enrol
      cathxr study enter answers.csv
    """
    with open_study(folder, store) as study:
        at = now()
        answers = read_answers(study, read_small(file), name=str(file), survey=survey, occasion=occasion, at=at)
        known = {each.code for each in study.store.participants()}
        new = sorted({each.participant for each in answers} - known)
        if new and not enrol:
            raise DataError(f"{file}: not enrolled: {', '.join(new)}; allocate them first, or give --enrol.")
        changed = study.store.answer(
            answers, at=at, replace=replace, enrol=[Participant(each, joined=at) for each in new]
        )
        click.echo(
            f"{changed} of {len(answers)} answers are new or changed"
            + (f"; enrolled {', '.join(new)}." if new else ".")
        )


def read_answers(
    study: StudyAtHand, text: str, *, name: str, survey: str | None, occasion: str | None, at: str
) -> list[Answer]:
    """Return the answers of a CSV text, in either form.

    Raises:
        ConfigError: a column is missing or unknown.
        DataError: cells hold what they must not; the sentence names the first few with their lines.
    """
    rows = _rows(text, name=name)
    header = rows[0][1]
    long = "item" in header
    _check_header(study, header, name=name, long=long, survey=survey)
    faults: list[str] = []
    answers: list[Answer] = []
    seen: set[tuple[str, str, str, str]] = set()
    for line, row in rows[1:]:
        where = f"line {line}"
        if len(row) != len(header):
            faults.append(f"{where}: expected {len(header)} cells, got {len(row)}")
            continue
        cells = dict(zip(header, row, strict=True))
        try:
            found = _long_row(study, cells, at) if long else _wide_row(study, cells, survey or "", occasion, at)
        except ConfigError as error:
            faults.append(f"{where}: {str(error).rstrip('.').removeprefix('--')}")
            continue
        for each in found:
            place = (each.participant, each.survey, each.item, each.occasion)
            if place in seen:
                faults.append(f"{where}: {each.participant} answers {each.item} twice")
            seen.add(place)
        answers += found
    if faults:
        more = f" and {len(faults) - _SHOWN} more" if len(faults) > _SHOWN else ""
        raise DataError(f"{name}: {'; '.join(faults[:_SHOWN])}{more}. Nothing was entered.")
    if not answers:
        raise DataError(f"{name}: expected answers, got none.")
    return answers


def _rows(text: str, *, name: str) -> list[tuple[int, list[str]]]:
    """Return every row that is not empty with the line it ends in; the first is the header.

    Raises:
        DataError: this is no CSV, or there is nothing in it.
    """
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        rows = [(reader.line_num, [each.strip() for each in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise DataError(f"{name}: line {reader.line_num}: {error}; correct that line. Nothing was entered.") from error
    if not rows:
        raise DataError(f"{name}: expected a header and answers, got an empty file.")
    if len(rows[0][1]) == 1 and (";" in rows[0][1][0] or "\t" in rows[0][1][0]):
        raise DataError(f"{name}: expected commas between the cells, got semicolons or tabs; save it with commas.")
    return rows


def _check_header(study: StudyAtHand, header: list[str], *, name: str, long: bool, survey: str | None) -> None:
    if long:
        expected = _LONG
        allowed = _LONG | {"words", "answered"}
    else:
        if survey is None:
            raise ConfigError(f"{name}: give --survey, or a column item.")
        expected = {"participant"}
        allowed = expected | {each.key for each in study.survey(survey).items} | {"occasion"}
    missing = sorted(expected - set(header))
    odd = [each for each in header if each not in allowed]
    if missing or odd or len(set(header)) != len(header):
        told = f"no column {missing[0]}" if missing else f"the column {odd[0]!r}" if odd else "a column twice"
        raise ConfigError(f"{name}: expected the columns {', '.join(sorted(allowed))}, got {told}.")


def _wide_row(study: StudyAtHand, cells: Mapping[str, str], survey: str, occasion: str | None, at: str) -> list[Answer]:
    code = checked_code(cells["participant"])
    when = occasion_of(study, survey, code, cells.get("occasion") or occasion)
    chosen = study.survey(survey)
    items = ((key, cell) for key, cell in cells.items() if key not in ("participant", "occasion") and cell)
    return [_answer(chosen, code, key, when, cell, at) for key, cell in items]


def _long_row(study: StudyAtHand, cells: Mapping[str, str], at: str) -> list[Answer]:
    code = checked_code(cells["participant"])
    chosen = study.survey(cells["survey"])
    when = occasion_of(study, chosen.key, code, cells["occasion"])
    cell = cells["value"] or cells.get("words", "")
    answered = _instant(cells.get("answered") or at)
    return [_answer(chosen, code, cells["item"], when, cell, answered)] if cell else []


def _answer(survey: Survey, code: str, key: str, when: str, cell: str, at: str) -> Answer:
    item = survey.item(key)
    if item is None:
        raise ConfigError(f"{survey.key} has no item {key}.")
    if item.kind is Kind.WORDS:
        fault = item.fault(None, cell)
        if fault is not None:
            raise ConfigError(f"{code}, {key}: {fault}.")
        return Answer(code, survey.key, key, when, at, None, cell)
    value = _number(cell)
    fault = item.fault(value, cell)
    if fault is not None:
        raise ConfigError(f"{code}, {key}: {fault}.")
    return Answer(code, survey.key, key, when, at, value)


def _instant(cell: str) -> str:
    """Return an instant in UTC, ISO 8601; one without a zone is taken for UTC."""
    try:
        told = datetime.datetime.fromisoformat(cell)
    except ValueError as error:
        raise ConfigError(
            f"answered: expected a date and time such as 2026-03-05T14:30:00Z, got {cell!r:.40}."
        ) from error
    zoned = told if told.tzinfo is not None else told.replace(tzinfo=datetime.UTC)
    return zoned.astimezone(datetime.UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _number(cell: str) -> float | None:
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
