"""Rows of the store's tables from the nouns of a study, and back. Numbers keep every bit."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from pydantic_core import from_json

from cathxr.core.trials import Answer, Draw, Outcome, Participant, TargetResult, TrialRecord, TrialStart

_SHARED = (
    "id", "participant", "task", "condition", "number", "period", "began", "practice", "session", "box", "software",
    "task_sha256",
)  # fmt: skip
TRIAL_COLUMNS = (*_SHARED, "outcome", "active_s", "unseen_share", "invalid", "measures", "targets")
"""What `trials_of` takes, in this order."""
ANSWER_COLUMNS = ("participant", "survey", "item", "occasion", "answered", "value", "words")
"""What `answers_of` takes, in this order."""


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


def trials_of(found: Iterable[Sequence[Any]]) -> Iterator[TrialRecord]:
    """Yield the trials of rows of `TRIAL_COLUMNS`. Many thousands are read at once, so that this is kept short."""
    ended = {each.value: each for each in Outcome}
    for (
        identifier, participant, task, condition, number, period, began, practice, session, box, software, task_sha256,
        outcome, active_s, unseen_share, invalid, measures, targets,
    ) in found:  # fmt: skip
        yield TrialRecord(
            identifier, participant, task, condition, number, period, began, ended[outcome], active_s,
            tuple([TargetResult(*each) for each in from_json(targets)]), from_json(measures), unseen_share,
            bool(practice), invalid, session, box, software, task_sha256,
        )  # fmt: skip


def answer_row(answer: Answer) -> dict[str, Any]:
    """Return an answer as a row."""
    return {
        "participant": answer.participant, "survey": answer.survey, "item": answer.item, "occasion": answer.occasion,
        "answered": answer.answered, "value": answer.value, "words": answer.text,
    }  # fmt: skip


def answers_of(found: Iterable[Sequence[Any]]) -> Iterator[Answer]:
    """Yield the answers of rows of `ANSWER_COLUMNS`."""
    for participant, survey, item, occasion, answered, value, words in found:
        yield Answer(participant, survey, item, occasion, answered, value, words)
