"""What comes after a trial: its numbers, out of its recording, its record, and its path for the scene."""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cathxr.core import CathxrError
from cathxr.core.trials import TrialRecord, TrialStart
from cathxr.runtime.training_books import Books
from cathxr.runtime.training_nouns import TrainingParts
from cathxr.runtime.training_numbers import measures_of, record_of, run_path
from cathxr.runtime.training_recordings import recorded_trial
from cathxr.runtime.training_trial import TrialAtHand
from cathxr.runtime.training_worker import Worker
from cathxr.training.metrics import Depth, Measure

_WRITTEN_S = 120.0
_RUNS_KEPT = 16
_NOT_WRITTEN = "The recording was not written in time."
_NOT_SAME = "The recording lacks a part of this trial: the numbers are from what was seen live."
_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Finished:
    """A trial with its numbers. note: what is to be known of its recording, "" where all is well."""

    record: TrialRecord
    measures: dict[str, Measure]
    note: str


class After:
    """Computes in a thread of its own. Any thread may call.

    told: given each trial whose numbers are there, in that thread.
    """

    def __init__(self, parts: TrainingParts, books: Books, *, told: Callable[[Finished], None]) -> None:
        self._parts, self._books, self._told = parts, books, told
        self._lock = threading.Lock()
        self._runs: dict[str, bytes] = {}
        self._depth_lock = threading.Lock()
        self._depths: list[Depth | None] = []
        self.worker = Worker("training-numbers")

    def folder(self, session: str) -> Path:
        """Return the path of a recording."""
        return Path(self._parts.recordings) / session

    def warm_up(self) -> None:
        """Have the heart's walls made before they are needed."""
        self.worker.do(self.walls)

    def walls(self) -> Depth | None:
        """Return how deep points are in the heart's walls, made at the first call; None where that cannot be had."""
        with self._depth_lock:
            if not self._depths:
                try:
                    self._depths.append(self._parts.depth())
                except Exception:  # what needs the walls is then absent, and everything else is there
                    _log.exception("the heart's walls cannot be made")
                    self._depths.append(None)
            return self._depths[0]

    def finish(self, hand: TrialAtHand, start: TrialStart, *, invalid: str, written: Callable[[float], bool]) -> None:
        """Have the numbers of a trial that has ended computed, recorded and told.

        invalid: why it must not count. written: waits for its recording.
        """
        self.worker.do(lambda: self._finish(hand, start, invalid, written))

    def run(self, trial: str) -> bytes | None:
        """Return a trial's run as JSON, None where it was not recorded here. Reads the recording where it must."""
        with self._lock:
            if trial in self._runs:
                return self._runs[trial]
        record = next((each for each in self._books.known.trials if each.id == trial), None)
        if record is None or not record.session or not self._parts.recordings:
            return None
        try:
            recorded = recorded_trial(self.folder(record.session), trial)
        except CathxrError as error:
            _log.warning("the run of %s cannot be shown: %s", trial, error)
            return None
        done = recorded.replayed.trial
        path = run_path(record, done.placed, done.order, recorded.result, recorded.tracks)
        return self._kept(trial, path.model_dump_json().encode())

    def _finish(self, hand: TrialAtHand, start: TrialStart, invalid: str, written: Callable[[float], bool]) -> None:
        note = "" if written(_WRITTEN_S) else _NOT_WRITTEN
        placed, order = hand.chosen.placed, hand.chosen.order
        result, tracks, is_recorded = hand.trial.result(), tuple(hand.tracks), False
        try:
            recorded = recorded_trial(self.folder(start.session), start.id)
            if recorded.replayed.events == tuple(hand.events):
                result, tracks, is_recorded = recorded.result, recorded.tracks, True
            else:
                note = _NOT_SAME
        except CathxrError as error:
            note = f"The recording cannot be read ({str(error).rstrip('.')}): the numbers are from what was seen live."
        try:
            measures = measures_of(result, placed, tracks, self.walls())
        except Exception:  # a metric's fault must not lose the trial
            _log.exception("the measures of %s failed", start.id)
            measures, note = {}, "The measures failed, and the log says why; give `cathxr score` for its recording."
        record = record_of(start, result, measures, invalid=invalid)
        self._kept(start.id, run_path(record, placed, order, result, tracks).model_dump_json().encode())
        self._books.record(record, is_recorded=is_recorded)
        self._told(Finished(record, measures, note))

    def _kept(self, trial: str, data: bytes) -> bytes:
        with self._lock:
            self._runs[trial] = data
            while len(self._runs) > _RUNS_KEPT:
                del self._runs[next(iter(self._runs))]
        return data
