"""Which trial comes next: by the study's design, or as an operator chooses outside a study. Pure."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from cathxr.core import ConfigError
from cathxr.core.participant_code import participant_code_fault
from cathxr.runtime.training_nouns import Chosen, Known, StudyHere, TaskHere, TrainingParts
from cathxr.study.board import Step, StepKind, next_step
from cathxr.training import PlacedTask, Practice, order_of, practice_of
from cathxr.training.task import VIEWS
from cathxr.wire.training_messages import TrainingView

VIEW_WORDS: Mapping[str, str] = MappingProxyType({"2d": "2D view", "3d": "3D view", "free": "free view"})
_PRACTICE = Practice(in_a_row=3, limit_s=600.0)
_PRACTICE_TARGET_S = 30.0


def participant_code(value: Any) -> str:
    """Return a participant's code in capitals.

    Raises:
        ConfigError: it is none; the sentence says why.
    """
    code = value.strip().upper() if isinstance(value, str) else ""
    fault = participant_code_fault(code)
    if fault is not None:
        raise ConfigError(f"Participant code: {fault}.")
    return code


def check_nothing_unfinished(known: Known, code: str) -> None:
    """Return when a participant has no trial of which no end is known.

    Raises:
        ConfigError: there is one.
    """
    for each in known.unfinished:
        if each.participant == code:
            raise ConfigError(
                f"A trial of {code} began at {each.began} and has no end: go on with it, or mark it invalid, first; or "
                "it runs at another station."
            )


def chosen_by_hand(parts: TrainingParts, known: Known, code: str, args: Mapping[str, Any]) -> Chosen:
    """Return the trial that an operator asks for outside a study: task, view, and practice or not.

    Raises:
        ConfigError: what is asked for is not there, or cannot be done here.
    """
    here = _task(parts, args.get("task"))
    practice = args.get("practice", here.task.practice is not None)
    if not isinstance(practice, bool):
        raise ConfigError(f"training_prepare: practice must be true or false, got {practice!r}.")
    if here.task.practice is not None and not practice:
        raise ConfigError(f"{here.task.name} is practice, and nothing else: choose another task for a trial.")
    view = _view(here, args.get("view", here.task.view))
    alike = [
        each for each in known.trials if (each.participant, each.condition, each.practice) == (code, view, practice)
    ]
    number = 1 + max((each.number for each in alike), default=0)
    return _chosen(
        parts, here, code, view=view, condition=view, words=VIEW_WORDS[view], number=number,
        period=0 if practice else 1, practice=practice, row=number - 1,
    )  # fmt: skip


def step_of(study: StudyHere, known: Known, code: str) -> Step:
    """Return what a participant of the study does next.

    Raises:
        ConfigError: nobody is enrolled under that code.
    """
    participant = known.participant(code)
    if participant is None:
        raise ConfigError(
            f"{code} is not enrolled in this study: allocate that code first with `cathxr study allocate {code}`."
        )
    return next_step(study.design, study.surveys, participant, trials=known.trials, answers=known.answers)


def chosen_by_design(
    parts: TrainingParts, study: StudyHere, known: Known, code: str, step: Step, args: Mapping[str, Any]
) -> Chosen:
    """Return the trial that the design says comes next; what is asked for besides must agree with it.

    Raises:
        ConfigError: the design has no trial for that participant now, or another than the one asked for.
    """
    if step.kind is StepKind.ALLOCATE:
        raise ConfigError(f"{code} has no order of conditions yet: draw one with `cathxr study allocate {code}`.")
    if step.kind is StepKind.DONE:
        raise ConfigError(f"{code} has done everything that the study asks.")
    practice = step.kind is StepKind.PRACTICE
    wanted = {"task": step.task, "view": step.view, "practice": practice}
    for name, value in wanted.items():
        if name in args and args[name] != value:
            raise ConfigError(
                f"By the study's design {code} does {step_words(study, step)} next; {name} {str(args[name])[:40]!r} is "
                "not that: leave it out."
            )
    here = _task(parts, step.task)
    place = next(i for i, each in enumerate(known.participants) if each.code == code)
    words = study.design.condition(step.condition).name
    return _chosen(
        parts, here, code, view=view_of(step.view), condition=step.condition, words=words, number=step.number,
        period=step.period, practice=practice, row=place + _before(known, code),
    )  # fmt: skip


def step_words(study: StudyHere, step: Step) -> str:
    """Return a step in words, for people."""
    if step.kind is StepKind.ALLOCATE:
        return "to be allocated"
    if step.kind is StepKind.DONE:
        return "done"
    if step.kind is StepKind.SURVEY:
        return f"survey: {study.surveys[step.survey].name}"
    name = study.design.condition(step.condition).name
    if step.kind is StepKind.PRACTICE:
        return f"{name}, practice"
    return f"{name}, trial {step.of} of {study.design.trials_a_condition}"


def folder_name(chosen: Chosen) -> str:
    """Return the name of the recording of a trial: code, task, condition, number, id."""
    task = re.sub(r"[^a-z0-9]+", "-", chosen.placed.key.lower())[:24].strip("-") or "task"
    condition = re.sub(r"[^a-z0-9]+", "-", chosen.condition.lower())[:12].strip("-") or "view"
    return f"{chosen.participant}_{task}_{condition}_{chosen.number}_{chosen.id}"


def _before(known: Known, code: str) -> int:
    """Return how many trials that are no practice a participant has done, so that each has another order."""
    return sum(each.participant == code and not each.practice for each in known.trials)


def _view(here: TaskHere, asked: Any) -> TrainingView:
    view = next((each for each in VIEWS if each == asked), None)
    if view is None:
        raise ConfigError(f"training_prepare: view must be one of {', '.join(VIEWS)}, got {str(asked)[:40]!r}.")
    if here.task.view not in ("free", view):
        raise ConfigError(
            f"{here.task.name} is done in the {VIEW_WORDS[here.task.view]}, as its file says; {VIEW_WORDS[view]} was "
            "asked for."
        )
    return view


def view_of(value: str) -> TrainingView:
    """Return a view that a design or a record names; one that there is not is free."""
    return next((each for each in VIEWS if each == value), "free")


def _task(parts: TrainingParts, key: Any) -> TaskHere:
    here = parts.task(key) if isinstance(key, str) else None
    if here is None:
        known = ", ".join(each.task.key for each in parts.tasks)
        raise ConfigError(f"training_prepare: expected a task, one of {known}, got {str(key)[:40]!r}.")
    if here.placed is None:
        raise ConfigError(f"{here.task.name} cannot be done here: {here.problem}")
    return here


def _chosen(
    parts: TrainingParts,
    here: TaskHere,
    code: str,
    *,
    view: TrainingView,
    condition: str,
    words: str,
    number: int,
    period: int,
    practice: bool,
    row: int,
) -> Chosen:
    task, placed = here.task, here.placed
    assert placed is not None
    if practice and task.practice is None:
        limit_s = task.target_limit_s or _PRACTICE_TARGET_S
        task = practice_of(task, _PRACTICE, target_limit_s=limit_s)
        placed = _practised(placed, task.key, limit_s)
    drawn = hashlib.sha256(f"{parts.key}/{code}/{condition}/{number}/{practice}".encode()).digest()
    order = order_of(task, seed=int.from_bytes(drawn[:8], "big"), row=row)
    return Chosen(
        parts.new_id(), code, here.task.key, placed, task.text, order, view, condition, words, number, period, practice
    )  # fmt: skip


def _practised(placed: PlacedTask, key: str, target_limit_s: float) -> PlacedTask:
    """Return the placed task to practise on."""
    return replace(
        placed, key=key, limit_s=_PRACTICE.limit_s, target_limit_s=target_limit_s, in_a_row=_PRACTICE.in_a_row
    )
