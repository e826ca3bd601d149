"""Trials that the program ended under: found at the start, gone on with, or recorded as they are."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from cathxr.core import CathxrError, ConfigError, DataError
from cathxr.core.trials import Outcome, TrialRecord, TrialStart
from cathxr.runtime.training_after import After
from cathxr.runtime.training_books import Books
from cathxr.runtime.training_choice import VIEW_WORDS, view_of
from cathxr.runtime.training_nouns import Chosen, Known, TrainingParts
from cathxr.runtime.training_numbers import measures_of, record_of
from cathxr.runtime.training_recordings import RecordedTrial, labelled, next_part, recorded_trial
from cathxr.runtime.training_running import RunningTrials
from cathxr.runtime.training_say import unfinished_words
from cathxr.training import Phase, TrialResult
from cathxr.wire.training_messages import UnfinishedTrial

_ELSEWHERE = "Its recording is not here: it runs at another station, or was recorded there."
_JUST_FREED = "It has just ended elsewhere: look again in a moment."
_NO_BEGIN = "Its recording breaks off before it began: mark it invalid."


@dataclass(frozen=True, eq=False)
class _Cut:
    """A trial without an end. result: as far as its recording goes, None where there is none, and why in why_not.

    running: another program runs it, or may do so.
    """

    start: TrialStart
    result: TrialResult | None
    why_not: str = ""
    running: bool = False


class Cuts:
    """Knows the trials without an end. Any thread may call; recordings are read in the thread of the numbers.

    changed: called in that thread when there are others.
    """

    def __init__(
        self, parts: TrainingParts, books: Books, after: After, running: RunningTrials, *, changed: Callable[[], None]
    ) -> None:
        self._parts, self._books, self._after, self._changed = parts, books, after, changed
        self._running = running
        self._lock = threading.Lock()
        self._cuts: dict[str, _Cut] = {}
        self._looked_for_labels = False

    def look(self, at_hand: Callable[[], str | None]) -> None:
        """Have the trials without an end looked at. at_hand: gives the id of the one that runs, which is none."""
        self._after.worker.do(lambda: self._look(at_hand()))

    def look_for_ends(self, at_hand: Callable[[], str | None]) -> None:
        """Have those looked at that another program runs; to be called now and then."""
        with self._lock:
            any_running = any(each.running for each in self._cuts.values())
        if any_running:
            self.look(at_hand)

    def messages(self) -> list[UnfinishedTrial]:
        """Return the trials without an end, for people."""
        with self._lock:
            cuts = list(self._cuts.values())
        return [self._message(each) for each in cuts]

    def has(self, trial: str) -> bool:
        """Return whether a trial is one without an end."""
        with self._lock:
            return trial in self._cuts

    def going_on(self, trial: str) -> Chosen:
        """Return a trial without an end, prepared to go on where its recording ends.

        Raises:
            CathxrError: there is none, or it cannot go on.
        """
        cut = self._cut(trial)
        start = cut.start
        why_not = self._running.words(trial) or (_JUST_FREED if cut.running else cut.why_not)
        if cut.result is None or why_not:
            raise ConfigError(f"This trial cannot go on. {why_not}")
        done = recorded_trial(self._after.folder(start.session), trial).replayed.trial
        if done.state.phase is Phase.ENDED:
            raise ConfigError("This trial has ended in its recording: it is recorded as it is, and cannot go on.")
        task, study = self._parts.task(start.task), self._parts.study
        words, view = VIEW_WORDS.get(start.condition, start.condition), start.condition
        if study is not None:
            condition = study.design.condition(start.condition)
            words, view = condition.name, condition.view
        return Chosen(
            trial, start.participant, start.task, done.placed, done.placed.name if task is None else task.task.text,
            done.order, view_of(view), start.condition, words, start.number, start.period, start.practice,
            done.carry(), start, next_part(self._after.folder(start.session)),
        )  # fmt: skip

    def give_up(self, trial: str, reason: str) -> None:
        """Record a trial without an end as interrupted and invalid.

        Raises:
            CathxrError: there is none, or it runs elsewhere or may do so.
        """
        cut = self._cut(trial)
        start = cut.start
        holder = self._running.elsewhere(trial)
        if holder is not None and holder.certain:
            raise ConfigError(f"{self._running.words(trial)} Mark it there, or when it has ended.")
        if cut.result is None and not cut.running and start.box != self._parts.box:
            raise ConfigError(
                f"This trial was begun at the station {start.box}, and may run there: mark it there, or give `cathxr "
                f"study mark {trial} --interrupted`."
            )
        try:
            recorded = recorded_trial(self._after.folder(start.session), trial)
            record = self._record(start, recorded, invalid=reason, outcome=Outcome.INTERRUPTED)
        except CathxrError:  # nothing of it was recorded
            nothing = TrialResult(trial, Outcome.INTERRUPTED, 0, 0, 0.0, (), 0.0, ())
            record = record_of(start, nothing, {}, invalid=reason)
        self._books.record(record)
        self.forget(trial)
        self._changed()

    def forget(self, trial: str) -> None:
        """Offer a trial no more: it goes on, or has its end."""
        with self._lock:
            self._cuts.pop(trial, None)

    def _message(self, cut: _Cut) -> UnfinishedTrial:
        start, task = cut.start, self._parts.task(cut.start.task)
        return UnfinishedTrial(
            id=start.id, participant=start.participant, task=start.task if task is None else task.task.name,
            began=start.began, sentence=unfinished_words(start, cut.result, cut.why_not),
            can_continue=cut.result is not None,
        )  # fmt: skip

    def _look(self, at_hand: str | None) -> None:
        freed = self._freed()
        # now: a trial that has just got its numbers is no longer without an end
        known = self._books.fresh() if freed else self._books.known
        if not self._looked_for_labels and not self._books.fault and self._parts.recordings:
            self._looked_for_labels = True
            self._look_for_labels(known)
        wanted = {each.id: each for each in known.unfinished if each.id != at_hand}
        with self._lock:
            new = [each for key, each in wanted.items() if key not in self._cuts or key in freed]
            gone = [key for key in self._cuts if key not in wanted]
            for key in gone:
                del self._cuts[key]
        for each in new:
            self._look_at(each)
        if new or gone:
            self._changed()

    def _look_for_labels(self, known: Known) -> None:
        """Tell the store of trials that were recorded here and that it never heard of; of those enrolled only."""
        there = {each.id for each in known.trials} | {each.id for each in known.unfinished}
        for start in labelled(self._after.folder(""), study=self._parts.key):
            if start.id in there or self._running.elsewhere(start.id) is not None:
                continue
            if known.participant(start.participant) is not None:
                try:
                    recorded_trial(self._after.folder(start.session), start.id)
                except CathxrError:
                    continue  # it never began
                self._books.begin(start)

    def _freed(self) -> set[str]:
        """Return the trials that another program ran when they were looked at, and does not run any more."""
        with self._lock:
            were = [key for key, cut in self._cuts.items() if cut.running]
        return {key for key in were if self._running.elsewhere(key) is None}

    def _look_at(self, start: TrialStart) -> None:
        """Record a trial that has its end in its recording; offer any other that runs nowhere."""
        where = self._running.words(start.id)
        if where:
            with self._lock:
                self._cuts[start.id] = _Cut(start, None, where, running=True)
            return
        try:
            recorded = recorded_trial(self._after.folder(start.session), start.id)
        except CathxrError:
            here = bool(start.session) and self._after.folder(start.session).is_dir()
            cut = _Cut(start, None, _NO_BEGIN if here else _ELSEWHERE)
        else:
            if recorded.replayed.trial.state.phase is Phase.ENDED:
                self._books.record(self._record(start, recorded))
                return
            cut = _Cut(start, recorded.result)
        with self._lock:
            self._cuts[start.id] = cut

    def _record(
        self, start: TrialStart, recorded: RecordedTrial, *, invalid: str = "", outcome: Outcome | None = None
    ) -> TrialRecord:
        placed = recorded.replayed.trial.placed
        measures = measures_of(recorded.result, placed, recorded.tracks, self._after.walls())
        return record_of(start, recorded.result, measures, invalid=invalid, outcome=outcome)

    def _cut(self, trial: str) -> _Cut:
        with self._lock:
            cut = self._cuts.get(trial)
        if cut is None:
            raise DataError(f"There is no trial {trial[:40]!r} without an end here.")
        return cut
