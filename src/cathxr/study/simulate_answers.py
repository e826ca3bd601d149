"""Answers of simulated people to surveys: drawn, with a known lean towards the good end of every scale."""

from collections.abc import Sequence

import numpy as np

from cathxr.core.trials import Answer
from cathxr.study.surveys import Item, Kind, Survey

_SPREAD = 8.0
"""Of the beta distribution: its two parameters' sum."""
_WELL = 0.93
_CONTENT, _MORE_CONTENT = 0.58, 0.72


def simulated_answers(
    survey: Survey, participant: str, rng: np.random.Generator, *, occasion: str, at: str, rank: int = 0
) -> tuple[Answer, ...]:
    """Return one participant's answer to every rating of a survey. at: UTC; rank: of the condition asked about, from 0.

    Sickness (SSQ) is hardly felt; everything else leans to the good end, a little more for later conditions. Which end
    is the good one follows from the survey's scores; without them it is the upper one.
    """
    mood = _WELL if survey.key == "ssq" else (_MORE_CONTENT if rank else _CONTENT)
    found = []
    for item in survey.items:
        if item.kind is Kind.RATING:
            share = float(rng.beta(_SPREAD * mood, _SPREAD * (1.0 - mood)))
            value = _on_scale(item, share if _is_upper_good(survey, item.key) else 1.0 - share)
            found.append(Answer(participant, survey.key, item.key, occasion, at, value))
    return tuple(found)


def answers_of_people(
    surveys: Sequence[tuple[Survey, str, int]], participants: Sequence[str], rng: np.random.Generator, *, at: str
) -> tuple[Answer, ...]:
    """Return everybody's answers. surveys: each with the occasion it is asked on and the rank of its condition."""
    return tuple(
        answer
        for survey, occasion, rank in surveys
        for code in participants
        for answer in simulated_answers(survey, code, rng, occasion=occasion, at=at, rank=rank)
    )


def _is_upper_good(survey: Survey, item: str) -> bool:
    for score in survey.scores:
        weight = score.weights.get(item, 0.0)
        if weight and score.better != "neither":
            return (weight > 0.0) == (score.better == "higher")
    return True


def _on_scale(item: Item, share: float) -> float:
    return item.minimum + item.step * round(share * (item.maximum - item.minimum) / item.step)
