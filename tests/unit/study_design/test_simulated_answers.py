"""Simulated answers fit their items, and lean to the good end of every scale, whichever that is."""

import numpy as np
import pytest

from cathxr.core.trials import Answer
from cathxr.study.simulate_answers import answers_of_people, simulated_answers
from cathxr.study.surveys import Kind, Survey, builtin_surveys, scores_of

AT = "2026-01-05T09:00:00Z"
SURVEYS = {each.key: each for each in builtin_surveys()}


def answers(survey: Survey, rank: int = 0, people: int = 60) -> tuple[Answer, ...]:
    codes = [f"P{each}" for each in range(people)]
    return answers_of_people([(survey, "end", rank)], codes, np.random.default_rng(1), at=AT)


@pytest.mark.parametrize("survey", SURVEYS.values(), ids=SURVEYS)
def test_every_rating_is_answered_on_its_scale(survey: Survey) -> None:
    given = simulated_answers(survey, "P1", np.random.default_rng(0), occasion="end", at=AT)
    assert [each.item for each in given] == [each.key for each in survey.items if each.kind is Kind.RATING]
    for each in given:
        item = survey.item(each.item)
        assert item is not None
        assert item.fault(each.value, each.text) is None


def test_scores_lean_to_the_good_end() -> None:
    def mean(key: str, score: str, rank: int = 0) -> float:
        survey = SURVEYS[key]
        found = [each.value for each in scores_of(survey, answers(survey, rank)) if each.score == score]
        return float(np.mean([each for each in found if each is not None]))

    # On 0 to 100 a mood of 0.58 gives 58 and 42; of 0.72, 72 and 28; 60 people with six or ten items: within 3 or so.
    assert mean("sus", "sus") == pytest.approx(58.0, abs=5.0)
    assert mean("tlx", SURVEYS["tlx"].scores[0].key) == pytest.approx(42.0, abs=5.0)
    assert mean("tlx", SURVEYS["tlx"].scores[0].key, rank=1) == pytest.approx(28.0, abs=5.0)
    total = next(each for each in SURVEYS["ssq"].scores if "otal" in each.name)
    assert mean("ssq", total.key) < 0.15 * total.maximum
