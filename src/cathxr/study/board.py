"""How far a study is, and what a participant does next."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from cathxr.core.trials import Answer, Outcome, Participant, TrialRecord
from cathxr.study.design import Asked, PracticeWhen, StudyDesign
from cathxr.study.exclusion import is_valid
from cathxr.study.surveys import Kind, Survey

T = TypeVar("T", TrialRecord, Answer)


class StepKind(StrEnum):
    """What comes next."""

    ALLOCATE = "allocate"
    SURVEY = "survey"
    PRACTICE = "practice"
    TRIAL = "trial"
    DONE = "done"


@dataclass(frozen=True)
class Step:
    """What a participant does next. Fields that a kind does not need are "" or 0.

    period: of the condition in the participant's order, from 1, 0 for practice; number: what the trial's record will
    have; of: which valid trial of the condition it is to be, from 1.
    """

    kind: StepKind
    participant: str
    condition: str = ""
    view: str = ""
    period: int = 0
    number: int = 0
    of: int = 0
    task: str = ""
    survey: str = ""
    occasion: str = ""


@dataclass(frozen=True)
class ConditionProgress:
    """The trials of a participant in one condition: that count, that do not, and how many are wanted."""

    condition: str
    valid: int
    invalid: int
    wanted: int


@dataclass(frozen=True)
class BoardRow:
    """How far one participant is. practice: outcome of the last one, "" before. surveys: done and asked for in all."""

    participant: Participant
    practice: str
    conditions: tuple[ConditionProgress, ...]
    surveys_done: int
    surveys_asked: int
    next: Step


@dataclass(frozen=True)
class Board:
    """How far a study is. by_sequence: how many participants there are of each, 0 included."""

    rows: tuple[BoardRow, ...]
    planned: int
    done: int
    by_sequence: tuple[tuple[str, int], ...]


def next_step(
    design: StudyDesign,
    surveys: Mapping[str, Survey],
    participant: Participant,
    *,
    trials: Sequence[TrialRecord],
    answers: Sequence[Answer],
) -> Step:
    """Return what a participant does next; trials that do not count are done again.

    surveys: by key, those of the design. trials and answers: this participant's, or everybody's.
    """
    code = participant.code
    if not participant.conditions:
        return Step(StepKind.ALLOCATE, code)
    mine = [each for each in trials if each.participant == code]
    given = {(each.survey, each.occasion, each.item) for each in answers if each.participant == code}
    if (step := _survey_due(design, surveys, participant, Asked.BEFORE, given)) is not None:
        return step
    for period, key in enumerate(participant.conditions, 1):
        view = design.condition(key).view
        if (practice := _practice_due(design, mine, key, period)) is not None:
            number = _next_number(mine, key, practice=True)
            return Step(StepKind.PRACTICE, code, key, view, number=number, of=1, task=practice)
        of = 1 + sum(is_valid(design, each) for each in mine if each.condition == key and not each.practice)
        if of <= design.trials_a_condition:
            number = _next_number(mine, key, practice=False)
            return Step(StepKind.TRIAL, code, key, view, period, number, of, design.task_of(of))
        if (step := _survey_due(design, surveys, participant, Asked.EACH, given, key)) is not None:
            return step
    return _survey_due(design, surveys, participant, Asked.END, given) or Step(StepKind.DONE, code)


def board(
    design: StudyDesign,
    surveys: Mapping[str, Survey],
    participants: Iterable[Participant],
    *,
    trials: Iterable[TrialRecord],
    answers: Iterable[Answer],
) -> Board:
    """Return how far every participant and the study are. surveys: by key, those of the design."""
    trials_of = _by_participant(trials)
    answers_of = _by_participant(answers)
    rows = tuple(
        _row(design, surveys, each, trials_of.get(each.code, []), answers_of.get(each.code, []))
        for each in participants
    )  # fmt: skip
    drawn = [row.participant.sequence for row in rows]
    sequences = [">".join(each) for each in design.sequences]
    sequences += sorted({each for each in drawn if each and each not in sequences})
    done = sum(row.next.kind is StepKind.DONE for row in rows)
    return Board(rows, design.planned, done, tuple((each, drawn.count(each)) for each in sequences))


def _row(
    design: StudyDesign,
    surveys: Mapping[str, Survey],
    participant: Participant,
    trials: list[TrialRecord],
    answers: list[Answer],
) -> BoardRow:
    practised = sorted((each.began, each.outcome.value) for each in trials if each.practice and not each.invalid)
    counts = []
    for key in participant.conditions or tuple(each.key for each in design.conditions):
        here = [is_valid(design, each) for each in trials if each.condition == key and not each.practice]
        counts.append(ConditionProgress(key, sum(here), len(here) - sum(here), design.trials_a_condition))
    given = {(each.survey, each.occasion, each.item) for each in answers}
    asked = [
        (surveys[plan.survey], occasion)
        for plan in design.surveys
        for occasion in design.occasions(plan, participant.conditions)
    ]
    done = sum(_answered(survey, occasion, given) for survey, occasion in asked)
    step = next_step(design, surveys, participant, trials=trials, answers=answers)
    return BoardRow(participant, practised[-1][1] if practised else "", tuple(counts), done, len(asked), step)


def _survey_due(
    design: StudyDesign,
    surveys: Mapping[str, Survey],
    participant: Participant,
    asked: Asked,
    given: set[tuple[str, str, str]],
    condition: str = "",
) -> Step | None:
    for plan in design.surveys:
        if plan.asked is asked:
            occasion = f"after:{condition}" if condition else asked.value
            if not _answered(surveys[plan.survey], occasion, given):
                return Step(
                    StepKind.SURVEY, participant.code, condition, survey=plan.survey, occasion=occasion
                )  # fmt: skip
    return None


def _answered(survey: Survey, occasion: str, given: set[tuple[str, str, str]]) -> bool:
    """Whether every item that has to be answered is; words may always be left out."""
    needed = [each for each in survey.items if each.kind is Kind.RATING and not each.optional]
    return all((survey.key, occasion, each.key) in given for each in needed)


def _practice_due(design: StudyDesign, trials: list[TrialRecord], condition: str, period: int) -> str | None:
    """Return the practice task that comes before a condition; None when it was done to its end, or none is wanted."""
    plan = design.practice
    if plan is None or (plan.when is PracticeWhen.FIRST and period > 1):
        return None
    ended = (Outcome.COMPLETED, Outcome.TIMED_OUT)
    done = any(each.practice and each.condition == condition and each.outcome in ended and not each.invalid
               for each in trials)  # fmt: skip
    return None if done else plan.task


def _next_number(trials: list[TrialRecord], condition: str, *, practice: bool) -> int:
    taken = (each.number for each in trials if each.condition == condition and each.practice == practice)
    return 1 + max(taken, default=0)


def _by_participant(items: Iterable[T]) -> dict[str, list[T]]:
    found: dict[str, list[T]] = {}
    for each in items:
        found.setdefault(each.participant, []).append(each)
    return found
