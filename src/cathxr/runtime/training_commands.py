"""What operators may ask of training: each command's arguments checked, each refusal a sentence."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from cathxr.core import ConfigError, DataError
from cathxr.runtime.commands import Command, only
from cathxr.runtime.training_choice import (
    check_nothing_unfinished,
    chosen_by_design,
    chosen_by_hand,
    participant_code,
    step_of,
)
from cathxr.runtime.training_live import TrainingSession
from cathxr.runtime.training_nouns import Chosen, Known, StudyHere
from cathxr.runtime.training_surveys import checked_answers, survey_due, with_answers
from cathxr.runtime.training_trial import TrialAtHand
from cathxr.study.board import StepKind
from cathxr.study.exclusion import is_valid

_LONGEST_REASON = 300
HELD = ("record_start", "record_stop", "lock_view", "unlock_view")
"""Commands of others that are refused while a trial is on: they would break what it records or shows."""


class TrainingCommands:
    """The commands of one session, from one thread or several."""

    def __init__(self, session: TrainingSession) -> None:
        self._session = session

    def named(self) -> dict[str, Command]:
        """Return the commands by name."""
        return {
            "training_prepare": self._prepare,
            "training_begin": self._at_hand("training_begin", lambda hand: self._session.count_down()),
            "training_pause": self._at_hand("training_pause", lambda hand: self._session.say(hand.pause(self._now()))),
            "training_resume": self._at_hand(
                "training_resume", lambda hand: self._session.say(hand.resume(self._now()))
            ),
            "training_abort": self._at_hand("training_abort", self._abort),
            "training_repeat": self._repeat,
            "training_close": self._close,
            "training_mark": self._mark,
            "training_continue": self._continue,
            "training_store": self._store,
            "survey_answer": self._answer,
        }

    def guarded(self, name: str, command: Command) -> Command:
        """Return a command of others that is refused while a trial is on."""

        def run(args: Mapping[str, Any]) -> Mapping[str, Any]:
            hand = self._session.hand
            if hand is not None and hand.is_on:
                raise ConfigError(
                    f"A trial of {hand.chosen.participant} is on and holds its recording and view: {name} can be asked "
                    "for when it has ended."
                )
            return command(args)

        return run

    def _at_hand(self, name: str, act: Callable[[TrialAtHand], object]) -> Command:
        def run(args: Mapping[str, Any]) -> Mapping[str, Any]:
            only(name, args, ("run",))
            with self._session.lock:
                hand = self._checked(name, args)
                if hand is None:
                    raise ConfigError("No trial is prepared: prepare one first.")
                act(hand)
                self._session.news()
            return {}

        return run

    def _checked(self, name: str, args: Mapping[str, Any]) -> TrialAtHand | None:
        """Return the trial at hand, where it is the one that is meant."""
        hand, run = self._session.hand, args.get("run")
        if run is not None and (hand is None or hand.chosen.id != run):
            raise ConfigError(f"{name}: another trial is at hand now, so that nothing was done.")
        return hand

    def _prepare(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("training_prepare", args, ("participant", "task", "view", "practice"))
        session, study = self._session, self._session.parts.study
        code = participant_code(args.get("participant"))
        session.check_free()
        known = session.books.fresh()
        check_nothing_unfinished(known, code)
        survey = chosen = None
        if study is None:
            chosen = chosen_by_hand(session.parts, known, code, args)
        else:
            survey, chosen = self._by_design(study, known, code, args)
        with session.lock:
            session.take_up(chosen)
            session.desk.survey = survey
        if chosen is None:
            return {"phase": "idle", "survey": None if survey is None else survey.survey}
        session.after.warm_up()
        return {"phase": "ready", "run": chosen.id}

    def _by_design(self, study: StudyHere, known: Known, code: str, args: Mapping[str, Any]) -> tuple[Any, Any]:
        """Return the survey or the trial that comes next, the other None."""
        session = self._session
        if session.books.fault and known.participant(code) is None:
            raise DataError(f"The study's store cannot be read: {session.books.fault}")
        step = step_of(study, known, code)
        if step.kind is StepKind.SURVEY:
            return survey_due(study, known, code), None
        return None, chosen_by_design(session.parts, study, known, code, step, args)

    def _abort(self, hand: TrialAtHand) -> None:
        session = self._session
        if hand.phase != "countdown":
            session.say(hand.abort(self._now()))
            return
        hand.stop_counting()
        session.stop_recording()
        session.running.let_go(hand.chosen.id)
        # what was recorded stays as it is, and the next attempt has a recording of its own
        chosen = hand.chosen
        again = replace(chosen, part=chosen.part + 1) if chosen.start else replace(chosen, id=session.parts.new_id())
        session.take_up(again)

    def _repeat(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("training_repeat", args, ("run",))
        session = self._session
        with session.lock:
            hand = self._checked("training_repeat", args)
            if hand is None or hand.phase != "ended":
                raise ConfigError("Only a trial that has ended can be repeated.")
            chosen = hand.chosen
        if session.parts.study is None:
            again = {"task": chosen.task, "view": chosen.view, "practice": chosen.practice}
            return self._prepare({"participant": chosen.participant, **again})
        self._check_repeatable(session.parts.study, chosen)
        return self._prepare({"participant": chosen.participant})

    def _check_repeatable(self, study: StudyHere, chosen: Chosen) -> None:
        record = next((each for each in self._session.books.known.trials if each.id == chosen.id), None)
        if record is None:
            raise ConfigError("The numbers of this trial are being computed: ask again in a moment.")
        if is_valid(study.design, record):
            raise ConfigError(
                "This trial counts, so that the study does not do it again: mark it invalid first, with the reason."
            )

    def _close(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("training_close", args, ("run",))
        session = self._session
        with session.lock:
            if self._checked("training_close", args) is None:
                session.desk.survey = None
            session.take_up(None)
        session.publish_offer()
        return {}

    def _mark(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("training_mark", args, ("trial", "reason"))
        session, (trial, reason) = self._session, _trial_and_reason(args)
        with session.lock:
            hand = session.hand
            mine = hand is not None and hand.chosen.id == trial
            if mine and hand is not None and hand.phase in ("ready", "countdown"):
                raise ConfigError("This trial has not begun: abort or close it instead.")
            if mine:
                session.desk.invalid = reason
                session.news()
            if mine and session.desk.finished is None:
                return {}  # kept until its record is made
        if session.cuts.has(trial):
            if not reason:
                raise ConfigError("training_mark: say why this trial must not count.")
            session.cuts.give_up(trial, reason)
        else:
            session.books.mark(trial, reason)
        return {}

    def _continue(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("training_continue", args, ("trial",))
        session = self._session
        session.check_free()
        chosen = session.cuts.going_on(str(args.get("trial", "")))
        with session.lock:
            session.take_up(chosen)
            session.desk.survey = None
        session.publish_offer()
        session.after.warm_up()
        return {"phase": "ready", "run": chosen.id}

    def _store(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("training_store", args, ())
        return {"sentence": self._session.books.store_again()}

    def _answer(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("survey_answer", args, ("survey", "occasion", "answers", "done"))
        session = self._session
        asked, study = session.desk.survey, session.parts.study
        meant = (args.get("survey"), args.get("occasion"))
        if asked is None or study is None or meant != (asked.survey, asked.occasion):
            raise ConfigError("survey_answer: this survey is not asked now.")
        done = args.get("done", False) is True
        answers = checked_answers(study, asked, args.get("answers", {}), done=done, at=session.parts.utc())
        if answers:
            session.books.answer(answers)
        known = session.books.known
        with session.lock:
            now = session.desk.survey
            if now is not None and (now.participant, now.survey) == (asked.participant, asked.survey):
                more = survey_due(study, known, asked.participant) if done else with_answers(study, known, asked)
                session.desk.survey = more
                session.news()
        session.publish_offer()
        return {"kept": len(answers)}

    def _now(self) -> int:
        return self._session.clock.now_ns()


def _trial_and_reason(args: Mapping[str, Any]) -> tuple[str, str]:
    trial, reason = args.get("trial"), args.get("reason")
    if not isinstance(trial, str) or not trial:
        raise ConfigError("training_mark: trial must be a trial's id.")
    if not isinstance(reason, str) or len(reason.strip()) > _LONGEST_REASON:
        raise ConfigError(f"training_mark: reason must say why, in at most {_LONGEST_REASON} characters.")
    return trial, reason.strip()
