"""Live training in the link's messages, and in sentences for people."""

from collections.abc import Iterable, Mapping, Sequence

from cathxr.core import FloatArray
from cathxr.core.trials import Answer, Outcome, TrialStart
from cathxr.runtime.training_choice import step_of, step_words
from cathxr.runtime.training_nouns import Chosen, Known, StudyHere, TaskHere
from cathxr.study.board import StepKind
from cathxr.study.surveys import Item, Survey
from cathxr.training import Phase, PlacedTarget, PlacedTask, ScoreCard, Trial, TrialResult, familiarisation
from cathxr.training.metrics import Measure
from cathxr.wire.training_messages import (
    CardLineMessage,
    SurveyDescription,
    SurveyItem,
    TargetState,
    TrainingNow,
    TrainingParticipant,
    TrainingResult,
    TrainingRun,
    TrainingTarget,
    TrainingTask,
)


def task_message(here: TaskHere) -> TrainingTask:
    """Return a task of the offer."""
    task = here.task
    return TrainingTask(
        key=task.key, name=task.name, text=task.text, view=task.view, step=task.step,
        practice=task.practice is not None, problem=here.problem,
    )  # fmt: skip


def participant_messages(known: Known, study: StudyHere | None) -> list[TrainingParticipant]:
    """Return who is enrolled, and what the study has for them next."""
    out = []
    for each in known.participants:
        words, done = "", False
        if study is not None:
            step = step_of(study, known, each.code)
            words, done = step_words(study, step), step.kind is StepKind.DONE
        out.append(TrainingParticipant(code=each.code, next=words, done=done))
    return out


def run_message(chosen: Chosen, trial: Trial | None) -> TrainingRun:
    """Return the trial at hand. trial: None before it begins."""
    return TrainingRun(
        id=chosen.id, participant=chosen.participant, task=chosen.placed.key, name=chosen.placed.name,
        text=chosen.text, view=chosen.view, condition=chosen.words, number=chosen.number, practice=chosen.practice,
        limit_s=chosen.placed.limit_s, targets=target_messages(chosen.placed, chosen.order, _states(chosen, trial)),
    )  # fmt: skip


def target_messages(
    placed: PlacedTask, order: Sequence[str], states: Mapping[str, TargetState]
) -> list[TrainingTarget]:
    """Return targets in their order. states: by key, those that are not "later"."""
    return [_target(placed.target(key), states.get(key, "later")) for key in order]


def now_message(trial: Trial, placed: PlacedTask) -> TrainingNow:
    """Return how a trial stands."""
    state = trial.state
    return TrainingNow(
        target=state.target, number=state.number, of=state.of, reached=state.reached, in_a_row=state.in_a_row,
        wanted_in_a_row=placed.in_a_row, progress=round(state.progress, 3), distance_mm=_rounded(state.distance_mm),
        angle_deg=_rounded(state.angle_deg), up_deg=_rounded(state.up_deg), hindrance=state.hindrance,
        active_s=round(state.active_s, 3), remaining_s=round(state.remaining_s, 3),
        target_remaining_s=_rounded(state.target_remaining_s),
    )  # fmt: skip


def result_message(
    chosen: Chosen,
    result: TrialResult,
    *,
    invalid: str,
    recording: str,
    stored: str,
    run: str | None,
    lines: list[CardLineMessage],
) -> TrainingResult:
    """Return the result of a trial that has ended."""
    return TrainingResult(
        outcome=result.outcome.value, sentence=outcome_words(chosen, result), reached=result.reached,
        of=len(result.offers) if chosen.placed.in_a_row is not None else len(chosen.order),
        active_s=round(result.active_s, 3), unseen_share=round(min(1.0, result.unseen_share), 4), invalid=invalid,
        recording=recording, stored=stored, run=run, lines=lines,
    )  # fmt: skip


def outcome_words(chosen: Chosen, result: TrialResult) -> str:
    """Return how a trial went, in a sentence."""
    if chosen.placed.in_a_row is not None:
        return familiarisation(result, chosen.placed.in_a_row).sentence
    of = len(chosen.order)
    how = {
        Outcome.COMPLETED: f"All {of} targets reached in {result.active_s:.1f} s.",
        Outcome.TIMED_OUT: f"{result.reached} of {of} targets reached; the time was over at {result.active_s:.0f} s.",
        Outcome.ABORTED: f"Aborted after {result.active_s:.1f} s with {result.reached} of {of} targets reached.",
        Outcome.INTERRUPTED: f"Broke off after {result.active_s:.1f} s with {result.reached} of {of} targets reached.",
    }[result.outcome]
    share = 100.0 * result.unseen_share
    return how if share < 1.0 else f"{how} The tip was not seen in {share:.0f} % of the time."


def card_messages(card: ScoreCard, measures: Mapping[str, Measure]) -> list[CardLineMessage]:
    """Return the lines of a score card, and why a metric has no value."""
    return [
        CardLineMessage(
            key=each.metric.key, name=each.metric.name, unit=each.metric.unit, better=each.metric.better,
            value=each.value, reason=_reason(measures, each.metric.key, each.value), history=list(each.history),
            best_before=each.best_before, is_best=each.is_best, percentile=each.percentile, others=each.others,
        )
        for each in card.lines
    ]  # fmt: skip


def survey_message(survey: Survey, participant: str, occasion: str, answers: Iterable[Answer]) -> SurveyDescription:
    """Return a survey that is asked now, with what was answered so far."""
    given: dict[str, float | str] = {
        each.item: each.text if each.value is None else each.value
        for each in answers
        if (each.participant, each.survey, each.occasion) == (participant, survey.key, occasion)
    }
    return SurveyDescription(
        participant=participant, survey=survey.key, name=survey.name, instruction=survey.instruction,
        source=survey.source, occasion=occasion, items=[_item(each) for each in survey.items], answers=given,
    )  # fmt: skip


def unfinished_words(start: TrialStart, result: TrialResult | None, why_not: str) -> str:
    """Return what is known of a trial that the program ended under. result: as far as it was recorded."""
    if result is None:
        return f"It began at {start.began} and has no end. {why_not}"
    return (
        f"It began at {start.began} and broke off after {result.active_s:.0f} s with {result.reached} reached: go on "
        "where its recording ends, or mark it invalid."
    )


def _states(chosen: Chosen, trial: Trial | None) -> dict[str, TargetState]:
    if trial is None or trial.state.phase is Phase.WAITING:
        done = () if chosen.carried is None else chosen.carried.offers
        return {each.result.key: "reached" if each.reached else "missed" for each in done}
    offers = trial.result().offers
    practice = chosen.placed.in_a_row is not None
    states: dict[str, TargetState] = {}
    if not practice:
        states = {each.result.key: "reached" if each.reached else "missed" for each in offers}
    now = trial.state.target
    if now is not None:
        states[now] = "now"
    return states


def _target(target: PlacedTarget, state: TargetState) -> TrainingTarget:
    return TrainingTarget(
        key=target.key, name=target.name, kind=target.kind, position_mm=_vector(target.point_box) or (0.0, 0.0, 0.0),
        radius_mm=target.distance_mm, angle_deg=target.angle_deg, direction=_vector(target.direction_box),
        up=_vector(target.up_box), dwell_s=target.dwell_s, state=state,
    )  # fmt: skip


def _item(item: Item) -> SurveyItem:
    return SurveyItem(
        key=item.key, text=item.text, kind=item.kind.value, minimum=item.minimum, maximum=item.maximum,
        step=item.step, low=item.low, high=item.high, labels=list(item.labels), optional=item.optional,
    )  # fmt: skip


def _reason(measures: Mapping[str, Measure], key: str, value: float | None) -> str:
    if value is not None:
        return ""
    return measures[key].reason if key in measures else "not measured"


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)


def _vector(values: FloatArray | None) -> tuple[float, float, float] | None:
    if values is None:
        return None
    x, y, z = (round(float(each), 4) for each in values)
    return x, y, z
