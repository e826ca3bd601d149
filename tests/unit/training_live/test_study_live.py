"""Training inside a study: practice, trials and surveys come by the design, and nothing else is done."""

from pathlib import Path

import pytest

from cathxr.core.trials import Participant
from cathxr.runtime.training_nouns import StudyHere
from cathxr.study.design import Asked, Condition, PracticePlan, StudyDesign, SurveyPlan
from cathxr.study.surveys import Kind, builtin_surveys

from .bench import AT, HERE, THERE, Bench

DESIGN = StudyDesign(
    "views", "Views", "Is 3D faster?", (Condition("2d", "Flat view", "2d"), Condition("3d", "3D view", "3d")),
    (("2d", "3d"), ("3d", "2d")), ("two",), 1, 2, "t", practice=PracticePlan("habit"),
    surveys=(SurveyPlan("tlx", Asked.EACH),),
)  # fmt: skip
STUDY = StudyHere("views", DESIGN, {each.key: each for each in builtin_surveys()})


@pytest.fixture
def bench(tmp_path: Path):
    made = Bench(tmp_path, study=STUDY, key="views")
    with made.opened() as store:
        store.enrol(Participant("P01", "3d>2d", "", AT), at=AT)
        store.enrol(Participant("P02", "", "", AT), at=AT)
    yield made
    made.close()


def done_next(bench: Bench) -> None:
    bench.do("training_prepare", participant="P01")
    bench.start()
    while bench.tell().phase == "running":
        bench.feed([HERE if bench.outlet.state.now.target == "here" else THERE] * 12)
    bench.numbers()


def test_the_design_says_what_comes_next(bench: Bench) -> None:
    assert "not enrolled in this study" in bench.refusal("training_prepare", participant="P03")
    assert "no order of conditions yet" in bench.refusal("training_prepare", participant="P02")
    assert "task 'two' is not that" in bench.refusal("training_prepare", participant="P01", task="two")
    bench.until(lambda: bench.outlet.offer.participants)
    assert [each.next for each in bench.outlet.offer.participants] == ["3D view, practice", "to be allocated"]
    done_next(bench)
    assert bench.outlet.state.result.invalid == ""
    assert "view '2d' is not that" in bench.refusal("training_prepare", participant="P01", view="2d")
    done_next(bench)
    run = bench.outlet.state.run
    assert (run.condition, run.view, run.number, run.practice) == ("3D view", "3d", 1, False)
    assert "mark it invalid first" in bench.refusal("training_repeat")


def test_a_survey_is_asked_after_the_condition_and_answered_item_by_item(bench: Bench) -> None:
    done_next(bench)
    done_next(bench)
    survey = bench.until(lambda: bench.outlet.state.survey)
    assert (survey.survey, survey.occasion, survey.answers) == ("tlx", "after:3d", {})
    ratings = [each for each in STUDY.surveys["tlx"].items if each.kind is Kind.RATING]
    first = ratings[0]
    asked = {"survey": "tlx", "occasion": "after:3d"}
    assert "expected a number from" in bench.refusal("survey_answer", **asked, answers={first.key: first.maximum + 1})
    assert "has no item" in bench.refusal("survey_answer", **asked, answers={"other": 1})
    assert "not asked now" in bench.refusal("survey_answer", survey="sus", occasion="end", answers={})
    bench.do("survey_answer", **asked, answers={first.key: first.minimum})
    assert bench.outlet.state.survey.answers == {first.key: first.minimum}
    assert "not answered yet" in bench.refusal("survey_answer", **asked, answers={}, done=True)
    bench.do("training_close")
    assert bench.do("training_prepare", participant="P01")["survey"] == "tlx"
    bench.do("survey_answer", **asked, answers={each.key: each.minimum for each in ratings}, done=True)
    assert bench.outlet.state.survey is None
    with bench.opened() as store:
        assert len(store.answers()) == len(ratings)
    bench.do("training_prepare", participant="P01")
    assert bench.outlet.state.run.condition == "Flat view"


def test_a_trial_that_must_not_count_is_done_again(bench: Bench) -> None:
    done_next(bench)
    done_next(bench)
    trial = bench.outlet.state.run.id
    bench.do("training_mark", trial=trial, reason="somebody helped")
    bench.do("training_repeat")
    run = bench.outlet.state.run
    assert (run.condition, run.number) == ("3D view", 2)
