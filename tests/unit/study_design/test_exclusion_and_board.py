"""Which trials count, and what comes next."""

from dataclasses import replace

import pytest

from cathxr.core.trials import Answer, Outcome, Participant, TrialRecord
from cathxr.study.board import Step, StepKind, board, next_step
from cathxr.study.design import PracticePlan, PracticeWhen, StudyDesign
from cathxr.study.exclusion import MARKED, is_valid, judged
from cathxr.study.exclusion_rules import Rule, RuleOf
from cathxr.study.surveys import builtin_surveys

from .designs import design, trial

SURVEYS = {each.key: each for each in builtin_surveys()}


def test_every_trial_is_in_one_place_and_says_why() -> None:
    good = [trial(1), trial(1, "3d")]
    bad = {
        "unseen": trial(2, unseen_share=0.26),
        "ended": trial(3, outcome=Outcome.ABORTED),
        MARKED: trial(4, invalid="slipped"),
    }
    practice = trial(1, practice=True, period=0, unseen_share=0.9)
    found = judged(design(), [practice, *bad.values(), *good])
    assert found.kept == tuple(good)
    assert found.practice == (practice,)
    assert {each.rule: each.trial for each in found.excluded} == bad
    reasons = {each.rule: each.reason for each in found.excluded}
    assert reasons[MARKED] == "slipped"
    assert reasons["unseen"].startswith("A trial is excluded when unseen share is above 0.25: the catheter")


def test_limits_belong_to_what_is_kept() -> None:
    rule = Rule("slow", "too slow", RuleOf.TRIAL, "t", above=30.0, below=10.0)
    made = replace(design(), exclusions=(rule,))
    times = {9.99: False, 10.0: True, 30.0: True, 30.01: False}
    for time, kept in times.items():
        assert is_valid(made, trial(1, measures={"t": time})) is kept
    # a trial that has no such number is not excluded by it
    assert is_valid(made, trial(1, measures={}))


def test_a_participant_without_trials_in_one_condition_is_excluded_whole() -> None:
    trials = [trial(1), trial(2), trial(1, "3d", outcome=Outcome.ABORTED), trial(1, "2d", "P02"), trial(1, "3d", "P02")]
    found = judged(design(), trials)
    assert [each.participant for each in found.kept] == ["P02", "P02"]
    assert [(each.participant, each.rule) for each in found.participants] == [("P01", "too_few")]
    assert sorted(each.rule for each in found.excluded) == ["ended", "too_few", "too_few"]
    assert len(found.kept) + len(found.excluded) == len(trials)


@pytest.mark.parametrize(
    ("outcomes", "out"),
    [([], True), ([Outcome.TIMED_OUT], True), ([Outcome.TIMED_OUT, Outcome.COMPLETED], False),
     ([Outcome.COMPLETED, Outcome.ABORTED], False)],
)  # fmt: skip
def test_a_rule_on_practice_looks_at_the_last(outcomes: list[Outcome], out: bool) -> None:
    rule = Rule("lost", "did not learn it", RuleOf.PARTICIPANT, "practice", among=("missing", "timed_out"))
    made = replace(design(), exclusions=(rule,))
    practice = [trial(each, practice=True, period=0, outcome=outcome) for each, outcome in enumerate(outcomes, 1)]
    assert bool(judged(made, [*reversed(practice), trial(1)]).participants) is out


def answered(code: str, survey: str, occasion: str) -> list[Answer]:
    return [Answer(code, survey, each.key, occasion, "", each.minimum) for each in SURVEYS[survey].items]


def walked(made: StudyDesign, *, upset: int = 0) -> list[Step]:
    """Return the steps of one who does all that is asked; every `upset`-th trial does not count."""
    participant = Participant("P01", "3d>2d")
    trials: list[TrialRecord] = []
    answers: list[Answer] = []
    steps: list[Step] = []
    while len(steps) < 100:
        step = next_step(made, SURVEYS, participant, trials=trials, answers=answers)
        steps.append(step)
        if step.kind is StepKind.DONE:
            return steps
        if step.kind is StepKind.SURVEY:
            answers += answered("P01", step.survey, step.occasion)
        else:
            spoilt = upset and len(trials) % upset == 1
            trials.append(
                trial(
                    step.number, step.condition, practice=step.kind is StepKind.PRACTICE, period=step.period,
                    outcome=Outcome.ABORTED if spoilt else Outcome.COMPLETED,
                )
            )  # fmt: skip
    raise AssertionError("this study never ends")


def test_a_participants_way_through_a_study() -> None:
    kinds = [
        (each.kind.value, each.survey or each.condition, each.occasion or str(each.number)) for each in walked(design())
    ]
    assert kinds == [
        ("survey", "ssq", "before"), ("practice", "3d", "1"),
        ("trial", "3d", "1"), ("trial", "3d", "2"), ("trial", "3d", "3"),
        ("survey", "ssq", "after:3d"), ("survey", "tlx", "after:3d"),
        ("trial", "2d", "1"), ("trial", "2d", "2"), ("trial", "2d", "3"),
        ("survey", "ssq", "after:2d"), ("survey", "tlx", "after:2d"),
        ("survey", "sus", "end"), ("survey", "paper", "end"), ("done", "", "0"),
    ]  # fmt: skip


def test_periods_and_views_follow_the_participants_order() -> None:
    made = replace(design(), practice=PracticePlan("practice", PracticeWhen.EACH))
    trials = [each for each in walked(made) if each.kind in (StepKind.TRIAL, StepKind.PRACTICE)]
    assert [(each.condition, each.view, each.period) for each in trials] == [
        ("3d", "3d", 0), *[("3d", "3d", 1)] * 3, ("2d", "2d", 0), *[("2d", "2d", 2)] * 3,
    ]  # fmt: skip
    assert {each.task for each in trials if each.period == 0} == {"practice"}


def test_what_does_not_count_is_done_again_under_a_new_number() -> None:
    steps = [each for each in walked(design(), upset=3) if each.kind is StepKind.TRIAL]
    numbers = [each.number for each in steps if each.condition == "3d"]
    assert len(numbers) > 3
    assert numbers == list(range(1, len(numbers) + 1))
    assert [each.of for each in steps if each.condition == "3d"][-1] == 3


def test_nobody_begins_before_the_draw() -> None:
    step = next_step(design(), SURVEYS, Participant("P01"), trials=[], answers=[])
    assert step.kind is StepKind.ALLOCATE


def test_the_board() -> None:
    people = [Participant("P01", "2d>3d"), Participant("P02", "3d>2d"), Participant("P03")]
    trials = [trial(1), trial(2, outcome=Outcome.ABORTED), trial(1, "3d", "P02"), trial(1, practice=True, period=0)]
    given = answered("P01", "ssq", "before")
    found = board(design(), SURVEYS, people, trials=trials, answers=given)
    first, second, third = found.rows
    assert [(each.condition, each.valid, each.invalid, each.wanted) for each in first.conditions] == [
        ("2d", 1, 1, 3), ("3d", 0, 0, 3),
    ]  # fmt: skip
    assert (first.practice, second.practice) == ("completed", "")
    assert (first.surveys_done, first.surveys_asked) == (1, 7)
    assert first.next == Step(StepKind.TRIAL, "P01", "2d", "2d", 1, 3, 2, "six_targets")
    assert third.next.kind is StepKind.ALLOCATE
    assert (found.planned, found.done) == (16, 0)
    assert found.by_sequence == (("2d>3d", 1), ("3d>2d", 1))
