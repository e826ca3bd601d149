"""A study as CSV files with a data dictionary: one file a kind of thing, one row a thing, every column explained."""

import csv
import shutil
import uuid
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from cathxr.core import DataError
from cathxr.core.trials import Answer, Draw, Participant, TrialRecord
from cathxr.storage.atomic import os_reason
from cathxr.storage.study_store.nouns import LogEntry, StoredDesign

Cell = str | float | int | None


@dataclass(frozen=True)
class Column:
    """One column. unit: "" for none; source: where a metric is published, or the table's own meaning."""

    name: str
    kind: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class ExportTable:
    """One file of an export, NAME.csv. rows: as many cells as there are columns; None is an empty cell."""

    name: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class MeasureWords:
    """How a metric is explained in the dictionary."""

    name: str
    unit: str
    meaning: str


def export_tables(
    *,
    participants: Sequence[Participant],
    trials: Sequence[TrialRecord],
    answers: Sequence[Answer],
    draws: Sequence[Draw],
    designs: Sequence[StoredDesign],
    log: Sequence[LogEntry],
    measures: Mapping[str, MeasureWords],
    counts: Mapping[str, str],
) -> tuple[ExportTable, ...]:
    """Return the tables of a study. measures: words for metrics by key; counts: by trial why it does not count."""
    return (
        ExportTable("participants", _PARTICIPANT, tuple((p.code, p.group, p.sequence, p.joined) for p in participants)),
        _trials(trials, measures, counts),
        _targets(trials),
        ExportTable(
            "answers", _ANSWER,
            tuple((a.participant, a.survey, a.item, a.occasion, a.value, a.text, a.answered) for a in answers),
        ),
        ExportTable("draws", _DRAW, tuple((d.group, d.number, d.sequence, d.participant, d.drawn) for d in draws)),
        ExportTable("designs", _DESIGN, tuple((d.version, d.adopted, d.sha256, d.reason, d.text) for d in designs)),
        ExportTable("log", _LOG, tuple((e.at, e.what, e.participant, e.detail) for e in log)),
    )  # fmt: skip


def write_export(folder: Path, tables: Iterable[ExportTable]) -> tuple[Path, ...]:
    """Return the files of a new folder with the tables and dictionary.csv; it is there as a whole or not at all.

    Raises:
        DataError: the folder is there already, or cannot be written.
    """
    if folder.exists():
        raise DataError(f"{folder}: there is something there already; give the name of a new folder.")
    part = folder.with_name(f".{folder.name}.{uuid.uuid4().hex[:12]}.part")
    chosen = tuple(tables)
    try:
        part.mkdir()
        for table in chosen:
            _write(part / f"{table.name}.csv", [each.name for each in table.columns], table.rows)
        entries = [(f"{table.name}.csv", c.name, c.kind, c.unit, c.meaning) for table in chosen for c in table.columns]
        _write(part / "dictionary.csv", ["file", "column", "kind", "unit", "meaning"], entries)
        part.rename(folder)
    except OSError as error:
        raise DataError(
            f"{folder}: cannot write the export ({os_reason(error)}); check the folder and the disk."
        ) from error
    finally:
        with suppress(OSError):
            shutil.rmtree(part, ignore_errors=True)
    return tuple(folder / f"{name}.csv" for name in (*(each.name for each in chosen), "dictionary"))


def _write(path: Path, header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        # repr keeps every bit of a number; an empty cell is "not there", never 0
        writer.writerows([repr(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)


def _trials(
    trials: Sequence[TrialRecord], measures: Mapping[str, MeasureWords], counts: Mapping[str, str]
) -> ExportTable:
    keys = sorted({key for each in trials for key in each.measures})
    none = MeasureWords("", "", "a metric that this version of the program does not know")
    words = {key: measures.get(key, none) for key in keys}
    columns = tuple(
        Column(f"m_{key}", "number", words[key].unit, f"{words[key].name}: {words[key].meaning}".lstrip(": "))
        for key in keys
    )  # fmt: skip
    rows = tuple(
        (
            t.id, t.participant, t.condition, t.period, t.number, t.task, int(t.practice), t.began, t.outcome.value,
            t.active_s, t.reached, len(t.targets), t.unseen_share, t.invalid, int(not counts.get(t.id, "")),
            counts.get(t.id, ""), t.session, t.box, t.software, t.task_sha256, *(t.measures.get(key) for key in keys),
        )
        for t in trials
    )  # fmt: skip
    return ExportTable("trials", (*_TRIAL, *columns), rows)


def _targets(trials: Sequence[TrialRecord]) -> ExportTable:
    rows = tuple(
        (t.id, t.participant, place, each.key, each.offered_s, each.reached_s, each.path_mm, each.misses)
        for t in trials
        for place, each in enumerate(t.targets, 1)
    )
    return ExportTable("targets", _TARGET, rows)


_CODE = Column("participant", "text", "", "the participant's code")
_PARTICIPANT = (
    Column("code", "text", "", "the participant's code; who it is, is nowhere in this data"),
    Column("group", "text", "", "the group that was allocated apart, empty where there are none"),
    Column("sequence", "text", "", "the order of conditions that was drawn, joined by >; empty without a draw"),
    Column("joined", "time", "UTC", "when the participant was enrolled, ISO 8601"),
)
_TRIAL = (
    Column("trial", "text", "", "the trial's id"),
    _CODE,
    Column("condition", "text", "", "key of the condition, as in study.toml"),
    Column("period", "whole number", "", "place of the condition in the participant's order, from 1; 0 for practice"),
    Column("number", "whole number", "", "number of the trial within participant and condition, from 1"),
    Column("task", "text", "", "key of the task"),
    Column("practice", "0 or 1", "", "1: familiarisation, never counted"),
    Column("began", "time", "UTC", "when it began, ISO 8601"),
    Column("outcome", "text", "", "completed, timed_out (time to completion censored), aborted, interrupted"),
    Column("active_s", "number", "s", "from start to end without pauses"),
    Column("targets_reached", "whole number", "", "how many targets were reached"),
    Column("targets_offered", "whole number", "", "how many targets there were"),
    Column("unseen_share", "number", "1", "share of the active time without a tracked pose, 0 to 1"),
    Column("marked_invalid", "text", "", "why a person marked the trial as invalid; empty: nobody did"),
    Column("counts", "0 or 1", "", "1: part of the analysis by the rules of study.toml"),
    Column("why_not", "text", "", "why it is not part of the analysis"),
    Column("session", "text", "", "the folder of its recording"),
    Column("box", "text", "", "the station it was recorded at"),
    Column("software", "text", "", "version of cathxr that made it"),
    Column("task_sha256", "text", "", "digest of the task's text"),
)
_TARGET = (
    Column("trial", "text", "", "the trial's id"),
    _CODE,
    Column("place", "whole number", "", "place in the order in which the targets were offered, from 1"),
    Column("target", "text", "", "key of the target"),
    Column("offered_s", "number", "s", "active time from the trial's start until it was offered"),
    Column("reached_s", "number", "s", "active time from the trial's start until it was reached; empty: it was not"),
    Column("path_mm", "number", "mm", "path of the tip while it was the target"),
    Column("misses", "whole number", "", "how often the tip left it before the dwell was over"),
)
_ANSWER = (
    _CODE,
    Column("survey", "text", "", "key of the survey"),
    Column("item", "text", "", "key of the item"),
    Column("occasion", "text", "", "when it was asked: before, after:CONDITION, end"),
    Column("value", "number", "", "the answer on the item's own scale; empty where the item takes words"),
    Column("words", "text", "", "the answer in words"),
    Column("answered", "time", "UTC", "when it was given or entered, ISO 8601"),
)
_DRAW = (
    Column("group", "text", "", "the group that was drawn in, empty where there are none"),
    Column("number", "whole number", "", "the draw's number in its group, from 1"),
    Column("sequence", "text", "", "the sequence that was drawn"),
    Column("participant", "text", "", "for whom; empty once that participant was deleted"),
    Column("drawn", "time", "UTC", "when, ISO 8601"),
)
_DESIGN = (
    Column("version", "whole number", "", "1 for the first design, one more for every change"),
    Column("adopted", "time", "UTC", "when it was adopted, ISO 8601"),
    Column("sha256", "text", "", "digest of study.toml's text"),
    Column("reason", "text", "", "why it replaced the one before"),
    Column("text", "text", "", "study.toml"),
)
_LOG = (
    Column("at", "time", "UTC", "when, ISO 8601"),
    Column("what", "text", "", "what was done"),
    Column("participant", "text", "", "about whom; empty once that participant was deleted"),
    Column("detail", "text", "", "more about it"),
)
