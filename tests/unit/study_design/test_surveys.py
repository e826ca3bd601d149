"""Surveys: the published scoring, the paper's Table 1, and answers that do not fit."""

import math
import statistics

import pytest

from cathxr.core import ConfigError
from cathxr.core.trials import Answer
from cathxr.study.survey_summary import item_summaries
from cathxr.study.surveys import BUILT_IN, Survey, builtin_survey_text, builtin_surveys, scores_of, survey_from_text

# Ratings of S1 to S6, and the mean and spread that follow: where the paper prints 3.6 for Q3 and Q4, 3.67 follows.
TABLE_1 = {
    "q1": ([2, 5, 5, 1, 1, 1], 2.5, 1.97), "q2": ([3, 5, 5, 1, 1, 1], 2.67, 1.97),
    "q3": ([3, 3, 5, 1, 5, 5], 3.67, 1.63), "q4": ([3, 5, 3, 3, 5, 3], 3.67, 1.03),
    "q5": ([3, 5, 2, 2, 5, 3], 3.33, 1.37), "q6": ([4, 3, 5, 3, 5, 5], 4.17, 0.98),
    "q7": ([4, 4, 4, 4, 5, 4], 4.17, 0.41), "q8": ([4, 5, 4, 4, 5, 4], 4.33, 0.52),
    "q9": ([4, 4, 5, 3, 5, 5], 4.33, 0.82), "q10": ([2, 5, 3, 1, 4, 1], 2.67, 1.63),
}  # fmt: skip


def survey(key: str) -> Survey:
    return next(each for each in builtin_surveys() if each.key == key)


def answers(key: str, values: dict[str, float], participant: str = "P01") -> list[Answer]:
    return [Answer(participant, key, item, "end", "", value) for item, value in values.items()]


def score(key: str, values: dict[str, float]) -> dict[str, float | None]:
    return {each.score: each.value for each in scores_of(survey(key), answers(key, values))}


def test_the_papers_table_1() -> None:
    given = [
        Answer(f"S{person}", "paper", item, "end", "", float(value))
        for item, (values, _, _) in TABLE_1.items()
        for person, value in enumerate(values, 1)
    ]
    summaries = item_summaries(survey("paper"), reversed(given))
    assert [each.item.key for each in summaries] == list(TABLE_1)
    for each in summaries:
        values, mean, std = TABLE_1[each.item.key]
        assert each.count == 6
        assert [value for _, value in each.values] == values
        assert each.mean is not None
        assert each.std is not None
        # printed with two digits
        assert abs(each.mean - mean) <= 0.005
        assert abs(each.std - std) <= 0.005
        assert math.isclose(each.std, math.sqrt(sum((x - each.mean) ** 2 for x in values) / 5))


def test_means_with_few_answers() -> None:
    (first, *others) = item_summaries(survey("paper"), answers("paper", {"q1": 4.0}))
    assert (first.mean, first.std) == (4.0, None)
    assert {(each.count, each.mean, each.std) for each in others} == {(0, None, None)}
    assert item_summaries(survey("paper"), []) == ()


def test_sus_by_its_own_rule() -> None:
    values = {f"q{number}": float(1 + number * 7 % 5) for number in range(1, 11)}
    by_hand = 2.5 * sum(x - 1 if int(key[1:]) % 2 else 5 - x for key, x in values.items())
    assert score("sus", values) == {"sus": by_hand}
    best = {f"q{number}": 5.0 if number % 2 else 1.0 for number in range(1, 11)}
    assert score("sus", best) == {"sus": 100.0}
    assert score("sus", {key: 6 - value for key, value in best.items()}) == {"sus": 0.0}
    assert score("sus", dict.fromkeys(best, 3.0)) == {"sus": 50.0}


def test_raw_tlx_is_the_mean_of_six() -> None:
    values = dict(zip([each.key for each in survey("tlx").items], [10.0, 35.0, 80.0, 5.0, 100.0, 60.0], strict=True))
    (workload,) = score("tlx", values).values()
    assert workload == pytest.approx(statistics.fmean(values.values()))


def test_ssq_by_its_published_extremes_and_columns() -> None:
    items = [each.key for each in survey("ssq").items]
    assert len(items) == 16
    # Kennedy and others 1993: the greatest scores there can be
    assert score("ssq", dict.fromkeys(items, 3.0)) == pytest.approx(
        {"nausea": 200.34, "oculomotor": 159.18, "disorientation": 292.32, "total": 235.62}
    )
    assert set(score("ssq", dict.fromkeys(items, 0.0)).values()) == {0.0}
    none = dict.fromkeys(items, 0.0)
    # nausea is in two columns, eye strain in one
    assert score("ssq", none | {"nausea": 2.0}) == pytest.approx(
        {"nausea": 19.08, "oculomotor": 0.0, "disorientation": 27.84, "total": 14.96}
    )
    assert score("ssq", none | {"eyestrain": 1.0})["total"] == pytest.approx(3.74)


def test_a_missing_answer_leaves_the_score_out_and_says_which() -> None:
    values = {f"q{number}": 3.0 for number in range(1, 10)}
    (found,) = scores_of(survey("sus"), answers("sus", values))
    assert found.value is None
    assert found.missing == ("q10",)


def test_scores_by_participant_and_occasion() -> None:
    given = [
        Answer(code, "tlx", item.key, occasion, "", 50.0)
        for code in ("P02", "P01")
        for occasion in ("after:3d", "after:2d")
        for item in survey("tlx").items
    ]
    found = scores_of(survey("tlx"), [*given, Answer("P01", "sus", "q1", "end", "", 1.0)])
    assert [(each.participant, each.occasion) for each in found] == [
        ("P01", "after:2d"), ("P01", "after:3d"), ("P02", "after:2d"), ("P02", "after:3d"),
    ]  # fmt: skip


@pytest.mark.parametrize("key", BUILT_IN)
def test_built_in_surveys_name_their_source(key: str) -> None:
    made = survey(key)
    assert made.key == key
    assert made.source
    assert made.instruction
    assert len({each.text for each in made.items}) == len(made.items)


@pytest.mark.parametrize(
    ("item", "good", "bad"),
    [("sus", [1, 3, 5], [0, 6, 2.5]), ("tlx", [0, 5, 100], [3, 105, -5]), ("ssq", [0, 3], [4, 0.5])],
)
def test_answers_off_the_scale(item: str, good: list[float], bad: list[float]) -> None:
    first = survey(item).items[0]
    assert [first.fault(float(each), "") for each in good] == [None] * len(good)
    assert all(first.fault(float(each), "") for each in bad)
    assert "expected a number" in str(first.fault(None, "yes"))


OWN = """
schema = "cathxr-survey/1"
key = "own"
name = "Own"
[[items]]
key = "a"
text = "How?"
[[items]]
key = "why"
text = "Why?"
kind = "words"
[[scores]]
key = "twice"
name = "Twice"
weights = { a = 2.0 }
"""


def test_an_own_survey() -> None:
    made = survey_from_text(OWN, name="own.toml")
    assert [each.kind for each in made.items] == ["rating", "words"]
    assert (made.scores[0].minimum, made.scores[0].maximum) == (2.0, 10.0)
    assert made.items[1].fault(None, "because") is None
    assert made.items[1].fault(3.0, "") is not None


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('key = "why"', 'key = "a"', "expected different keys"),
        ("{ a = 2.0 }", "{ why = 2.0 }", "why is no item with a rating"),
        ("{ a = 2.0 }", "{ b = 2.0 }", "b is no item with a rating"),
        ('text = "How?"', 'text = "How?"\nscale = { minimum = 1.0, maximum = 5.0, step = 3.0 }', "whole steps"),
        ('text = "How?"', 'text = "How?"\nscale = { labels = ["x"] }', "expected 5 labels"),
        ('kind = "words"', 'kind = "sound"', "items.1.kind"),
        ('name = "Own"', 'nmae = "Own"', "own.toml: (name|nmae): "),
        ('text = "How?"', 'text = "How?"\nscale = { minimum = nan }', "minimum: input should be a finite number"),
        ('text = "How?"', 'text = "How?"\nscale = { maximum = inf }', "maximum: input should be a finite number"),
        ('text = "How?"', 'text = "How?"\nscale = { minimum = -1e308, maximum = 1e308 }', "1 to 1000 whole steps"),
        ('text = "How?"', 'text = "How?"\nscale = { maximum = 1e9 }', "1 to 1000 whole steps"),
        ('text = "How?"', 'text = "  "', "items.0.text: expected a text, got none"),
        ('text = "How?"', 'text = "How\\u0000"', r"got the control character U\+0000"),
        ("{ a = 2.0 }", "{ a = nan }", "weights.a: input should be a finite number"),
        (
            "{ a = 2.0 }",
            '{ a = 2.0 }\n[[scores]]\nkey = "twice"\nname = "T"\nweights = { a = 1.0 }',
            "scores: expected",
        ),
        ('key = "why"', 'key = "occasion"', "occasion is the name of a column"),
    ],
)
def test_faults_of_own_surveys(old: str, new: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        survey_from_text(OWN.replace(old, new), name="own.toml")


def test_built_in_texts_are_as_own_ones() -> None:
    assert survey_from_text(builtin_survey_text("sus"), name="x") == survey("sus")
