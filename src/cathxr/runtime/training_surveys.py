"""Surveys while the system is live: which is due, and answers to it, item by item or all at once. Pure."""

import math
from collections.abc import Mapping
from typing import Any

from cathxr.core import ConfigError
from cathxr.core.trials import Answer
from cathxr.runtime.training_choice import step_of
from cathxr.runtime.training_nouns import Known, StudyHere
from cathxr.runtime.training_say import survey_message
from cathxr.study.board import StepKind
from cathxr.study.surveys import Kind, Survey
from cathxr.wire.training_messages import SurveyDescription

_LONGEST = 4000


def survey_due(study: StudyHere, known: Known, code: str) -> SurveyDescription | None:
    """Return the survey that a participant is to answer next, None where something else comes first."""
    if known.participant(code) is None:
        return None
    step = step_of(study, known, code)
    if step.kind is not StepKind.SURVEY:
        return None
    return survey_message(study.surveys[step.survey], code, step.occasion, known.answers)


def with_answers(study: StudyHere, known: Known, asked: SurveyDescription) -> SurveyDescription:
    """Return a survey that is being asked with the answers that there are now."""
    return survey_message(study.surveys[asked.survey], asked.participant, asked.occasion, known.answers)


def checked_answers(
    study: StudyHere, asked: SurveyDescription, given: Any, *, done: bool, at: str
) -> tuple[Answer, ...]:
    """Return the answers that a client gave to the survey that is asked. done: nothing more comes.

    Raises:
        ConfigError: an answer does not fit its item, or ratings are missing where nothing more comes.
    """
    survey = study.surveys[asked.survey]
    if not isinstance(given, Mapping):
        raise ConfigError("survey_answer: answers must be an object: an item's key and its answer.")
    answers = tuple(
        each for key, value in given.items() if (each := _answer(survey, asked, str(key), value, at)) is not None
    )
    if done:
        there = {*asked.answers, *(each.item for each in answers)}
        missing = [
            each.text
            for each in survey.items
            if each.kind is Kind.RATING and not each.optional and each.key not in there
        ]
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            raise ConfigError(f"{survey.name}: not answered yet: {missing[0]!r}{more}.")
    return answers


def _answer(survey: Survey, asked: SurveyDescription, key: str, value: Any, at: str) -> Answer | None:
    item = survey.item(key)
    if item is None:
        raise ConfigError(f"{survey.name} has no item {key[:40]!r}.")
    number, text = None, ""
    if isinstance(value, str):
        text = value.strip()
        if not text and item.kind is Kind.WORDS:
            return None
        if len(text) > _LONGEST:
            raise ConfigError(f"{survey.name}: {item.text!r}: at most {_LONGEST} characters.")
    elif isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        number = float(value)
    else:
        raise ConfigError(f"{survey.name}: {item.text!r}: expected a number or words, got {str(value)[:40]!r}.")
    fault = item.fault(number, text)
    if fault is not None:
        raise ConfigError(f"{survey.name}: {item.text!r}: {fault}.")
    return Answer(asked.participant, survey.key, key, asked.occasion, at, number, text)
