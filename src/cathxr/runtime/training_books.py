"""The store's side of live training: what is known, what is written, and what waits because the store fails."""

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from cathxr.core import Clock, DataError
from cathxr.core.trials import Answer, Participant, TrialRecord, TrialStart
from cathxr.runtime.fanout import sentence
from cathxr.runtime.training_nouns import Known, Store, TrainingParts
from cathxr.runtime.training_worker import Worker

_RETRY_NS = 10_000_000_000
_WAIT_S = 8.0
Told = Callable[[str, str, bool], None]


class Books:
    """Reads and writes a study's store in a thread of its own. Any thread may call.

    A trial that the store does not take is kept and tried again, every ten seconds and whenever it is asked for.
    told(trial, sentence, stored): where a trial is stored, or why not yet. changed: what is known has changed. Both are
    called in the thread of the store.
    """

    def __init__(self, parts: TrainingParts, *, clock: Clock, told: Told, changed: Callable[[], None]) -> None:
        self._parts, self._clock, self._told, self._changed = parts, clock, told, changed
        self._lock = threading.Lock()
        self._read = Known()
        self._starts: dict[str, TrialStart] = {}
        self._records: dict[str, TrialRecord] = {}
        self._only_here: set[str] = set()
        self._fault = self._write_fault = ""  # what can be read cannot always be written: a full disk
        self._due_ns = 0
        self._store: Store | None = None  # the store's thread only, as everything below is done there
        self._worker = Worker("training-store", idle=self._again)

    def start(self) -> None:
        """Begin; a store that is there is read."""
        self._worker.start()
        if self._parts.has_store:
            self._worker.do(self._refresh)

    def close(self, timeout_s: float) -> bool:
        """Write what waits, once, and end; return whether that was done in time."""
        self._worker.do(self._write)
        self._worker.do(self._let_go)
        return self._worker.close(timeout_s)

    @property
    def known(self) -> Known:
        """What is known: as it was read last, and what waits to be stored."""
        with self._lock:
            waiting = {**{each.id: each for each in self._read.trials}, **self._records}
            starts = {**{each.id: each for each in self._read.unfinished}, **self._starts}
            trials = tuple(sorted(waiting.values(), key=lambda each: (each.began, each.id)))
            unfinished = tuple(each for each in starts.values() if each.id not in waiting)
            codes = {each.code for each in self._read.participants}
            new = {each.participant for each in trials} | {each.participant for each in unfinished}
            people = (*self._read.participants, *(Participant(each) for each in sorted(new - codes)))
            return Known(people, trials, self._read.answers, unfinished)

    @property
    def fault(self) -> str:
        """Why the store could not be read or written last; "" where it could."""
        with self._lock:
            return self._write_fault or self._fault

    @property
    def waiting(self) -> int:
        """How many trials wait to be stored."""
        with self._lock:
            return len(self._records)

    def fresh(self) -> Known:
        """Return what is known now, the store read again; where it cannot be, `fault` says why."""
        if not self._worker.asked(self._refresh, _WAIT_S):
            with self._lock:
                self._fault = f"The store does not answer within {_WAIT_S:g} s."
        return self.known

    def begin(self, start: TrialStart) -> None:
        """Have it kept that a trial begins."""
        with self._lock:
            self._starts[start.id] = start
        self._worker.do(self._write)

    def record(self, record: TrialRecord, *, is_recorded: bool = True) -> None:
        """Have a trial that has ended stored. is_recorded: whether its recording holds all of it."""
        with self._lock:
            self._records[record.id] = record
            if not is_recorded:
                self._only_here.add(record.id)
        self._worker.do(self._write)

    def store_again(self) -> str:
        """Try again what waits, and return how that went, as a sentence."""
        answered = self._worker.asked(self._write, _WAIT_S)
        if not answered or self.waiting:
            why = self.fault if answered else f"the store does not answer within {_WAIT_S:g} s"
            with self._lock:
                lacking = any(each in self._records for each in self._only_here)
            end = "do not end this program before it is" if lacking else "the recordings hold everything"
            raise DataError(f"Still not stored: {why.rstrip('.')}; {end}.")
        return "Everything is stored."

    def mark(self, trial: str, reason: str) -> None:
        """Mark a trial that has ended as invalid, and why; "" takes that back.

        Raises:
            CathxrError: there is no such trial, or the store does not take it.
        """
        with self._lock:
            waiting = self._records.get(trial)
            if waiting is not None:
                self._records[trial] = replace(waiting, invalid=reason)
                return
        self._do(lambda store: store.mark(trial, reason, at=self._parts.utc()))

    def answer(self, answers: tuple[Answer, ...]) -> None:
        """Have answers stored, those before them replaced.

        Raises:
            CathxrError: the store does not take them; nothing is kept then.
        """
        self._do(lambda store: store.answer(answers, at=self._parts.utc(), replace=True))

    # In the store's thread -------------------------------------------------------------------------------------------

    def _do(self, act: Callable[[Store], object]) -> None:
        """Have something done in the store's thread and wait for it."""
        failed: list[Exception] = []
        done: list[bool] = []

        def job() -> None:
            try:
                act(self._opened())
                done.append(True)
            except Exception as error:  # told to whoever asked
                failed.append(error)
            self._refresh()

        answered = self._worker.asked(job, _WAIT_S)
        if failed:
            raise DataError(f"Not stored: {sentence(failed[0])}") from failed[0]
        if not answered and not done:
            raise DataError(f"Not stored yet: the store does not answer within {_WAIT_S:g} s; try again.")

    def _opened(self) -> Store:
        if self._store is None:
            self._store = self._parts.open_store()
        return self._store

    def _refresh(self) -> None:
        try:
            store = self._opened()
            read = Known(store.participants(), store.trials(), store.answers(), store.unfinished())
        except Exception as error:  # a store may fail in any way; training goes on
            self._failed(error)
        else:
            with self._lock:
                self._read, self._fault = read, ""
        self._changed()

    def _write(self) -> None:
        """Write what waits, each by itself; what fails stays."""
        with self._lock:
            starts = [each for each in self._starts.values() if each.id not in self._records]
            records = list(self._records.values())
        for start in starts:
            if self._written(partial(self._begin, start=start)):
                with self._lock:
                    self._starts.pop(start.id, None)
                    self._read = replace(self._read, unfinished=(*self._read.unfinished, start))
        for record in records:
            stored = self._written(partial(self._record, record=record))
            if stored:
                with self._lock:  # from one to the other at once: what is known never lacks it
                    self._starts.pop(record.id, None)
                    self._read = replace(self._read, trials=(*self._read.trials, record))
                    if self._records.get(record.id) is record:  # else it was marked meanwhile: once more
                        del self._records[record.id]
            self._told(record.id, self._where(record.id, stored=stored), stored)
        with self._lock:
            self._due_ns = self._clock.now_ns() + _RETRY_NS
        if starts or records:
            self._refresh()

    def _written(self, act: Callable[[Store], object]) -> bool:
        """Return whether the store took something that waits."""
        try:
            act(self._opened())
        except Exception as error:  # as in _refresh
            self._failed(error)
            with self._lock:
                self._write_fault = sentence(error)
            return False
        with self._lock:
            self._fault = self._write_fault = ""
        return True

    def _begin(self, store: Store, start: TrialStart) -> None:
        self._enrol(store, start.participant)
        if all(each.id != start.id for each in store.unfinished()):
            store.begin(start, at=self._parts.utc())

    def _record(self, store: Store, record: TrialRecord) -> None:
        self._enrol(store, record.participant)
        store.record(record, at=self._parts.utc())
        if record.invalid:  # it may have been marked since it was recorded
            there = next(each for each in store.trials(participant=record.participant) if each.id == record.id)
            if there.invalid != record.invalid:
                store.mark(record.id, record.invalid, at=self._parts.utc())

    def _enrol(self, store: Store, code: str) -> None:
        """Enrol somebody outside a study by their first trial; a study enrols by its own command."""
        if self._parts.study is None and all(each.code != code for each in store.participants()):
            store.enrol(Participant(code, joined=self._parts.utc()), at=self._parts.utc())

    def _where(self, trial: str, *, stored: bool) -> str:
        if stored:
            return f"Stored in {'the study' if self._parts.study else 'the training store'}."
        why, every_s = self.fault.rstrip("."), _RETRY_NS // 1_000_000_000
        if trial in self._only_here:
            return (
                f"Not stored yet: {why}. The recording does not hold all of it either. Do not end this program before "
                f"it is stored: it is tried again every {every_s} s."
            )
        return (
            f"Not stored yet: {why}. The recording holds everything; it is tried again every {every_s} s and at the "
            "next start."
        )

    def _again(self) -> None:
        """Try again what waits, when it is due."""
        with self._lock:
            due = bool(self._records or self._starts) and self._clock.now_ns() >= self._due_ns
        if due:
            self._write()

    def _failed(self, error: Exception) -> None:
        with self._lock:
            self._fault = sentence(error)
        self._let_go()

    def _let_go(self) -> None:
        """Close the store; the next job opens it anew."""
        store, self._store = self._store, None
        if store is not None:
            store.close()
