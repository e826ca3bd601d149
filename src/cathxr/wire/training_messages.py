"""The messages of training: what can be trained, how the trial stands, its result, the survey that is asked."""

from typing import Literal

from pydantic import Field

from cathxr.wire.message import Message, Vector3

TrainingPhase = Literal["idle", "ready", "countdown", "running", "paused", "ended"]
TargetState = Literal["later", "now", "reached", "missed"]
TrainingView = Literal["2d", "3d", "free"]


# --- server to client -------------------------------------------------------------------------------------------------


class TrainingTask(Message):
    """A task that can be trained here."""

    key: str
    name: str
    text: str = Field(description="What to do, in a sentence or two.")
    view: TrainingView
    step: int | None = Field(description="Its place in the progression, from 1.")
    practice: bool = Field(description="Whether it is familiarisation: offered until its criterion is met.")
    problem: str = Field(description="Why it cannot be done with this heart and box; empty when it can.")


class TrainingParticipant(Message):
    """Somebody who is enrolled, by code, and what the study has for them next."""

    code: str
    next: str = Field(description="In words, for example 2D view, trial 2 of 3; empty outside a study.")
    done: bool = Field(description="Whether the study has nothing more for them.")


class UnfinishedTrial(Message):
    """A trial that the program ended under."""

    id: str
    participant: str
    task: str = Field(description="The task's name.")
    began: str = Field(description="UTC, ISO 8601.")
    sentence: str = Field(description="What is known of it, and what can be done.")
    can_continue: bool = Field(description="Whether it can be gone on with where its recording ends.")


class TrainingOffer(Message):
    """What can be trained: the newest replaces those before."""

    type: Literal["training_offer"] = "training_offer"
    study: str | None = Field(description="The study's title; null: training outside a study.")
    tasks: list[TrainingTask]
    participants: list[TrainingParticipant]
    unfinished: list[UnfinishedTrial]


class TrainingTarget(Message):
    """A target of the trial, in the box."""

    key: str
    name: str
    kind: Literal["tip", "beam", "plane"] = Field(description="What must reach it: tip, beam, or the image's plane.")
    position_mm: Vector3 = Field(description="mm, box")
    radius_mm: float = Field(description="How near; of a plane: how near it must pass.")
    angle_deg: float | None = Field(description="How well aligned, where that counts.")
    direction: Vector3 | None = Field(description="box, unit: where tip or beam must point; of a plane: its normal.")
    up: Vector3 | None = Field(description="box, unit; of a plane: where the beam must point.")
    dwell_s: float
    state: TargetState


class TrainingRun(Message):
    """The trial at hand."""

    id: str
    participant: str
    task: str = Field(description="The task's key.")
    name: str
    text: str
    view: TrainingView = Field(description="What the participant may see.")
    condition: str = Field(description="The study's condition in words, or the view outside a study.")
    number: int = Field(description="1, 2, … within participant and condition.")
    practice: bool
    limit_s: float
    targets: list[TrainingTarget] = Field(description="In the order in which they are offered.")


class TrainingNow(Message):
    """How a trial stands at the last Track."""

    target: str | None = Field(description="The key of the one that is offered.")
    number: int
    of: int | None = Field(description="How many there are; null in practice.")
    reached: int
    in_a_row: int
    wanted_in_a_row: int | None = Field(description="Practice ends at so many in a row.")
    progress: float = Field(description="Of the dwell, 0 to 1.")
    distance_mm: float | None
    angle_deg: float | None
    up_deg: float | None
    hindrance: str = Field(description="Why nothing counts now, a sentence; empty otherwise.")
    active_s: float = Field(description="Time on task, without pauses.")
    remaining_s: float
    target_remaining_s: float | None


class CardLineMessage(Message):
    """One metric of a score card."""

    key: str
    name: str
    unit: str
    better: Literal["lower", "higher", "neither"]
    value: float | None
    reason: str = Field(description="Why there is no value; empty otherwise.")
    history: list[tuple[int, float]] = Field(description="(number, value) of own trials so far, this one last.")
    best_before: float | None
    is_best: bool
    percentile: float | None = Field(description="Of the other participants' medians; null when there are too few.")
    others: int


class TrainingResult(Message):
    """The result of the trial at hand."""

    outcome: Literal["completed", "timed_out", "aborted", "interrupted"]
    sentence: str = Field(description="How it went, in words.")
    reached: int
    of: int
    active_s: float
    unseen_share: float
    invalid: str = Field(description="Why it must not count; empty when it does.")
    recording: str = Field(description="The recording's folder below that of all recordings.")
    stored: str = Field(description="Where the numbers were stored, or why they were not, a sentence.")
    run: str | None = Field(description="Path on the server of the run, to be shown in the scene: `RunPath`.")
    lines: list[CardLineMessage]


class SurveyItem(Message):
    """One item of a survey."""

    key: str
    text: str
    kind: Literal["rating", "words"]
    minimum: float
    maximum: float
    step: float
    low: str
    high: str
    labels: list[str]
    optional: bool


class SurveyDescription(Message):
    """A survey that is to be answered now."""

    participant: str
    survey: str
    name: str
    instruction: str
    source: str
    occasion: str
    items: list[SurveyItem]
    answers: dict[str, float | str] = Field(description="By the item's key: what was answered so far.")


class TrainingState(Message):
    """How training stands: at every change, and at most ten times a second while a trial runs. Newest wins."""

    type: Literal["training"] = "training"
    phase: TrainingPhase
    countdown_s: float | None
    run: TrainingRun | None
    now: TrainingNow | None
    result: TrainingResult | None
    survey: SurveyDescription | None
    sentence: str = Field(description="What the operator should know; empty otherwise.")
    can: list[str] = Field(description="The commands of training that would be carried out now.")


class RunPath(Message):
    """A run, to be shown in the scene again: what `TrainingResult.run` leads to, as JSON, 20 samples a second."""

    id: str
    participant: str
    task: str
    t: list[float] = Field(description="s since the trial began; pauses are left out.")
    tip: list[Vector3 | None] = Field(description="mm, box; null where it was not tracked.")
    beam: list[Vector3 | None] = Field(description="box, unit; null where the roll was not known.")
    shape: list[list[Vector3] | None] = Field(description="Some 12 points of the catheter, tip first, mm, box.")
    targets: list[TrainingTarget]
    reached: list[tuple[str, float]] = Field(description="(target, s since the trial began)")
