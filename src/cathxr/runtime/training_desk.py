"""What clients are told of training: one state made of the trial at hand, its result, and the survey that is asked."""

from dataclasses import dataclass, field

from cathxr.runtime.training_after import Finished
from cathxr.runtime.training_choice import VIEW_WORDS
from cathxr.runtime.training_nouns import Known, Outlet, TrainingParts
from cathxr.runtime.training_say import (
    card_messages,
    now_message,
    participant_messages,
    result_message,
    run_message,
    task_message,
)
from cathxr.runtime.training_trial import TrialAtHand
from cathxr.training import score_card
from cathxr.wire.training_messages import (
    CardLineMessage,
    SurveyDescription,
    TrainingOffer,
    TrainingPhase,
    TrainingState,
    UnfinishedTrial,
)
from cathxr.wire.training_pages import run_address

_COMPUTING = "The numbers are being computed."


@dataclass
class Desk:
    """Holds what is to be told besides the trial itself. Used under the session's lock.

    invalid: why the trial at hand must not count. finished: its numbers, when they are there. stored: see
    `TrainingResult`. waiting: whether trials wait to be stored.
    """

    parts: TrainingParts
    outlet: Outlet
    survey: SurveyDescription | None = None
    invalid: str = ""
    finished: Finished | None = None
    stored: str = _COMPUTING
    lines: list[CardLineMessage] = field(default_factory=list)
    locked: bool = False

    def clear(self) -> None:
        """Forget the trial that was at hand."""
        self.invalid, self.finished, self.stored, self.lines = "", None, _COMPUTING, []

    def lock(self, hand: TrialAtHand | None) -> None:
        """Hold the view fast that a trial is done in, from ready to its end; let go of it otherwise."""
        if hand is not None and hand.phase != "ended" and hand.chosen.view != "free":
            view = VIEW_WORDS[hand.chosen.view]
            self.outlet.publish_lock({"mode": hand.chosen.view}, f"This trial is done in the {view}.")
            self.locked = True
        elif self.locked:
            self.outlet.publish_lock({}, "")
            self.locked = False

    def take_numbers(self, finished: Finished, known: Known) -> None:
        """Take the numbers of the trial at hand."""
        self.finished = finished
        self.lines = card_messages(score_card(finished.record, known.trials), finished.measures)

    def publish(self, hand: TrialAtHand | None, now_ns: int, *, waiting: bool, fault: str) -> None:
        """Tell every client how training stands. fault: of the store."""
        self.outlet.publish_training(self.state(hand, now_ns, waiting=waiting, fault=fault))

    def state(self, hand: TrialAtHand | None, now_ns: int, *, waiting: bool, fault: str) -> TrainingState:
        """Return how training stands."""
        phase: TrainingPhase = "idle" if hand is None else hand.phase
        ended = hand is not None and phase == "ended"
        result = None
        if ended and hand is not None:
            chosen = hand.chosen
            note = "" if self.finished is None else self.finished.note
            result = result_message(
                chosen, hand.trial.result(), invalid=self.invalid, recording=hand.session,
                stored=f"{self.stored} {note}".strip(),
                run=None if self.finished is None else run_address(chosen.id), lines=self.lines,
            )  # fmt: skip
        began = hand is not None and phase in ("running", "paused", "ended")
        return TrainingState(
            phase=phase,
            countdown_s=None if hand is None else hand.countdown_s(now_ns),
            run=None if hand is None else run_message(hand.chosen, hand.trial),
            now=now_message(hand.trial, hand.chosen.placed) if began and hand is not None else None,
            result=result,
            survey=self.survey,
            sentence=hand.sentence if hand is not None and hand.sentence else fault,
            can=self._can(phase, waiting=waiting),
        )

    def offer(self, known: Known, unfinished: list[UnfinishedTrial]) -> None:
        """Tell every client what can be trained."""
        study = self.parts.study
        self.outlet.publish_training_offer(
            TrainingOffer(
                study=None if study is None else study.design.title,
                tasks=[task_message(each) for each in self.parts.tasks],
                participants=participant_messages(known, study),
                unfinished=unfinished,
            )
        )

    def _can(self, phase: TrainingPhase, *, waiting: bool) -> list[str]:
        """Return the commands that would be carried out in a phase."""
        free = ["training_prepare", "training_continue"]
        own = {
            "idle": [*free],
            "ready": [*free, "training_begin", "training_close"],
            "countdown": ["training_abort"],
            "running": ["training_pause", "training_abort"],
            "paused": ["training_resume", "training_abort"],
            "ended": [*free, "training_repeat", "training_close"],
        }[phase]
        if phase == "idle" and self.survey is not None:
            own.append("training_close")
        own.append("training_mark")
        own += ["survey_answer"] if self.survey is not None else []
        return own + (["training_store"] if waiting else [])
