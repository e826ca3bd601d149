"""What live training is made of: what was chosen, what is known of people and trials, whom it talks to."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from cathxr.core import Event
from cathxr.core.trials import Answer, Participant, TrialRecord, TrialStart
from cathxr.runtime.moment import RecordingState
from cathxr.study.design import StudyDesign
from cathxr.study.surveys import Survey
from cathxr.training import Carried, PlacedTask, Task
from cathxr.training.metrics import Depth
from cathxr.wire.training_messages import TrainingOffer, TrainingState, TrainingView


@dataclass(frozen=True, eq=False)
class TaskHere:
    """A task of this place. placed: None where it cannot be done with this heart and box, and why is in `problem`."""

    task: Task
    placed: PlacedTask | None
    problem: str = ""


@dataclass(frozen=True, eq=False)
class Chosen:
    """A trial that is prepared. task: the key of what was asked for; view: what may be seen; words: the condition.

    carried, start, part: of a trial that goes on: how far it was, how it began, the number of its next recording.
    """

    id: str
    participant: str
    task: str
    placed: PlacedTask
    text: str
    order: tuple[str, ...]
    view: TrainingView
    condition: str
    words: str
    number: int
    period: int
    practice: bool
    carried: Carried | None = None
    start: TrialStart | None = None
    part: int = 1


@dataclass(frozen=True)
class StudyHere:
    """A study with the surveys that it asks. key: of the study in its store."""

    key: str
    design: StudyDesign
    surveys: Mapping[str, Survey]


@dataclass(frozen=True)
class Known:
    """What is known of people and trials; what waits to be stored is among it."""

    participants: tuple[Participant, ...] = ()
    trials: tuple[TrialRecord, ...] = ()
    answers: tuple[Answer, ...] = ()
    unfinished: tuple[TrialStart, ...] = ()

    def participant(self, code: str) -> Participant | None:
        """Return who is enrolled under a code."""
        return next((each for each in self.participants if each.code == code), None)


class Store(Protocol):
    """What training needs of a study's store; see `StudyStore`."""

    place: str

    def participants(self) -> tuple[Participant, ...]: ...
    def trials(self, *, participant: str | None = None) -> tuple[TrialRecord, ...]: ...
    def answers(self) -> tuple[Answer, ...]: ...
    def unfinished(self) -> tuple[TrialStart, ...]: ...
    def enrol(self, participant: Participant, *, at: str) -> None: ...
    def begin(self, start: TrialStart, *, at: str) -> None: ...
    def record(self, trial: TrialRecord, *, at: str) -> None: ...
    def mark(self, trial: str, reason: str, *, at: str) -> None: ...
    def answer(self, answers: Iterable[Answer], *, at: str, replace: bool = False) -> int: ...
    def close(self) -> None: ...


class Station(Protocol):
    """The live system, as far as training uses it; see `LiveSystem`."""

    def announce(self, event: Event) -> None: ...
    def start_recording(self, name: str) -> None: ...
    def stop_recording(self) -> Mapping[str, Any]: ...
    def wait_written(self, timeout_s: float) -> bool: ...
    def recording_state(self) -> RecordingState: ...


class Outlet(Protocol):
    """Where clients are told; see the wire's Hub."""

    def publish_training(self, state: TrainingState) -> None: ...
    def publish_training_offer(self, offer: TrainingOffer) -> None: ...
    def publish_lock(self, values: Mapping[str, Any], sentence: str) -> None: ...


@dataclass(frozen=True, eq=False)
class TrainingParts:
    """What training is given by whoever puts the system together.

    open_store: opens the study's store, or makes and opens one's own; raises CathxrError. has_store: whether there is
    one to be read at the start already. study: None outside a study. recordings: the path of the folder of all
    recordings, "" where nothing is recorded, and why in no_recording. depth: makes the heart's walls, when first used;
    None without labels. box: this station's name. utc: the instant in UTC, ISO 8601. new_id: an id for a trial.
    """

    tasks: tuple[TaskHere, ...]
    open_store: Callable[[], Store]
    utc: Callable[[], str]
    new_id: Callable[[], str]
    recordings: str
    software: str
    box: str
    key: str = "training"
    study: StudyHere | None = None
    has_store: bool = True
    no_recording: str = ""
    depth: Callable[[], Depth | None] = field(default=lambda: None)

    def task(self, key: str) -> TaskHere | None:
        """Return the task of a key, None where there is none."""
        return next((each for each in self.tasks if each.task.key == key), None)
