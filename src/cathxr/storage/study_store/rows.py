"""Rows of the store's tables from the nouns of a study, and back. Numbers keep every bit."""

import json
from collections.abc import Mapping
from typing import Any

from cathxr.core.trials import Answer, Draw, Outcome, Participant, TargetResult, TrialRecord, TrialStart

_SHARED = (
    "id", "participant", "task", "condition", "number", "period", "began", "practice", "session", "box", "software",
    "task_sha256",
)  # fmt: skip


def participant_row(participant: Participant) -> dict[str, Any]:
    """Return a participant as a row."""
    return {
        "code": participant.code, "sequence": participant.sequence, "group": participant.group,
        "joined": participant.joined,
    }  # fmt: skip


def participant_of(row: Mapping[Any, Any]) -> Participant:
    """Return the participant of a row."""
    return Participant(row["code"], row["sequence"], row["group"], row["joined"])


def draw_of(row: Mapping[Any, Any]) -> Draw:
    """Return the draw of a row."""
    return Draw(row["group"], row["number"], row["sequence"], row["participant"], row["drawn"])


def start_row(start: TrialStart) -> dict[str, Any]:
    """Return a trial that has begun as a row."""
    return {key: getattr(start, key) for key in _SHARED}


def start_of(row: Mapping[Any, Any]) -> TrialStart:
    """Return the trial that has begun of a row."""
    return TrialStart(**{key: row[key] for key in _SHARED})


def trial_row(trial: TrialRecord) -> dict[str, Any]:
    """Return a trial as a row."""
    targets = [[each.key, each.offered_s, each.reached_s, each.path_mm, each.misses] for each in trial.targets]
    return {key: getattr(trial, key) for key in _SHARED} | {
        "outcome": trial.outcome.value,
        "active_s": float(trial.active_s),
        "unseen_share": float(trial.unseen_share),
        "invalid": trial.invalid,
        "measures": json.dumps({key: float(value) for key, value in sorted(trial.measures.items())}, allow_nan=False),
        "targets": json.dumps(targets, allow_nan=False),
    }


def trial_of(row: Any) -> TrialRecord:
    """Return the trial of a row of the table's columns, by name."""
    return TrialRecord(
        id=row.id, participant=row.participant, task=row.task, condition=row.condition, number=row.number,
        period=row.period, began=row.began, outcome=Outcome(row.outcome), active_s=row.active_s,
        targets=tuple(TargetResult(*each) for each in json.loads(row.targets)), measures=json.loads(row.measures),
        unseen_share=row.unseen_share, practice=row.practice, invalid=row.invalid, session=row.session, box=row.box,
        software=row.software, task_sha256=row.task_sha256,
    )  # fmt: skip


def answer_row(answer: Answer) -> dict[str, Any]:
    """Return an answer as a row."""
    return {
        "participant": answer.participant, "survey": answer.survey, "item": answer.item, "occasion": answer.occasion,
        "answered": answer.answered, "value": answer.value, "words": answer.text,
    }  # fmt: skip


def answer_of(row: Mapping[Any, Any]) -> Answer:
    """Return the answer of a row."""
    return Answer(
        row["participant"], row["survey"], row["item"], row["occasion"], row["answered"], row["value"], row["words"]
    )
