"""A study's store: participants, draws, trials, answers, and a log of what was done. One call is one transaction."""

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from hashlib import sha256
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from sqlalchemy import Connection, Engine, Select, Table, and_, func, insert, select, update

from cathxr.core import ConfigError, DataError
from cathxr.core.trials import Answer, Draw, Outcome, Participant, TrialRecord, TrialStart
from cathxr.storage.study_store import deletion, rows
from cathxr.storage.study_store.answering import keep_answers, keep_participants
from cathxr.storage.study_store.engine import reading, shown, store_url, writing, writing_alone
from cathxr.storage.study_store.nouns import Deleted, LogEntry, StoredDesign
from cathxr.storage.study_store.opening import check_study, created, opened
from cathxr.storage.study_store.schema import ANSWER, DESIGN, DRAW, LOG, PARTICIPANT, STUDY, TRIAL, TRIAL_START
from cathxr.storage.study_store.uncollected import uncollected

_MAY_DIFFER = {"design": None, "invalid": ""}
"""What a trial that is recorded again may differ in from the one that is there."""


class StudyStore:
    """One study in a store. A context manager; may be used from several threads, and by several programs at once.

    Whatever fails, fails as a whole: a call that raises has changed nothing. `at` is the instant in UTC, ISO 8601.
    """

    def __init__(self, engine: Engine, study: str) -> None:
        self._engine = engine
        self.study = study
        self.place = shown(engine.url)

    @classmethod
    def open(cls, place: str | Path, *, study: str) -> "StudyStore":
        """Return the store of a study at a file's path or a PostgreSQL address.

        Raises:
            DataError: there is no store, it cannot be reached, or it is of another version.
            ConfigError: it holds no such study.
        """
        store = cls(opened(store_url(place)), study)
        try:
            with reading(store._engine) as connection:
                check_study(connection, study, place=store.place)
        except BaseException:
            store.close()
            raise
        return store

    @classmethod
    def create(cls, place: str | Path, *, study: str, seed: int, software: str, at: str) -> "StudyStore":
        """Return the store of a study; what is not there yet is made. seed: of the allocation, kept where there is one.

        Raises:
            DataError: the store cannot be made or reached.
        """
        store = cls(created(store_url(place), software=software, at=at), study)
        try:
            with writing(store._engine) as connection:
                if connection.execute(select(STUDY.c.key).where(STUDY.c.key == study)).first() is None:
                    connection.execute(insert(STUDY).values(key=study, seed=str(seed), created=at))
                    store._note(connection, at, "study made", detail=f"cathxr {software}")
        except BaseException:
            store.close()
            raise
        return store

    def close(self) -> None:
        """Let go of every connection."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # Reading ---------------------------------------------------------------------------------------------------------

    def seed(self) -> int:
        """Return the seed of the allocation."""
        with reading(self._engine) as connection:
            return int(connection.execute(select(STUDY.c.seed).where(STUDY.c.key == self.study)).scalar_one())

    def designs(self) -> tuple[StoredDesign, ...]:
        """Return the designs that were adopted, oldest first."""
        with reading(self._engine) as connection:
            return self._designs(connection)

    def participants(self) -> tuple[Participant, ...]:
        """Return the participants, by code."""
        return tuple(map(rows.participant_of, self._all(PARTICIPANT, "code")))

    def draws(self) -> tuple[Draw, ...]:
        """Return the draws, by group and number."""
        return tuple(map(rows.draw_of, self._all(DRAW, "group", "number")))

    def trials(self, *, participant: str | None = None) -> tuple[TrialRecord, ...]:
        """Return the trials that have ended, of one participant or all, by when they began."""
        chosen = self._columns(TRIAL, rows.TRIAL_COLUMNS).order_by(TRIAL.c.began, TRIAL.c.id)
        if participant is not None:
            chosen = chosen.where(TRIAL.c.participant == participant)
        with reading(self._engine) as connection, uncollected():
            return tuple(rows.trials_of(connection.execute(chosen)))

    def unfinished(self) -> tuple[TrialStart, ...]:
        """Return the trials that began and of which no end is stored: running now, or cut off."""
        return tuple(map(rows.start_of, self._all(TRIAL_START, "began", "id")))

    def answers(self) -> tuple[Answer, ...]:
        """Return the answers, by participant, survey, occasion and item."""
        order = (ANSWER.c[each] for each in ("participant", "survey", "occasion", "item"))
        chosen = self._columns(ANSWER, rows.ANSWER_COLUMNS).order_by(*order)
        with reading(self._engine) as connection, uncollected():
            return tuple(rows.answers_of(connection.execute(chosen)))

    def log(self) -> tuple[LogEntry, ...]:
        """Return what was done, oldest first."""
        found = self._all(LOG, "id")
        return tuple(LogEntry(each["at"], each["what"], each["participant"], each["detail"]) for each in found)

    # Writing ---------------------------------------------------------------------------------------------------------

    def adopt(self, text: str, *, at: str, reason: str = "") -> StoredDesign:
        """Return the design after `text` of study.toml became it; the same text again changes nothing.

        Raises:
            ConfigError: somebody was allocated or measured under another design, and no reason is given.
        """
        digest = sha256(text.encode()).hexdigest()
        with self._writing() as connection:
            before = self._designs(connection)
            if before and before[-1].sha256 == digest:
                return before[-1]
            if before and not reason and self._has_data(connection):
                raise ConfigError(
                    f"{self.place}: the design is fixed, as participants were allocated or measured under it; put "
                    "study.toml back, or give the reason for the change, which the report will state."
                )
            design = StoredDesign(len(before) + 1, text, digest, reason, at)
            row = {"version": design.version, "text": text, "sha256": digest, "reason": reason, "adopted": at}
            connection.execute(insert(DESIGN).values(study=self.study, **row))
            self._note(connection, at, "design adopted", detail=f"version {design.version}, SHA-256 {digest}; {reason}")
            return design

    def enrol(self, participant: Participant, *, at: str) -> None:
        """Add a participant without a draw.

        Raises:
            DataError: that code is taken.
        """
        with self._writing() as connection:
            keep_participants(connection, self.study, [participant], at=at)

    def draw(self, code: str, choose: Callable[[int], str], *, group: str = "", at: str) -> Draw:
        """Return the draw of a participant's sequence, made and kept in one step; of one that has one, that one.

        choose: gives the sequence of the n-th draw of the group. Draws of several programs at once wait for each other.

        Raises:
            DataError: the participant is enrolled in another group.
        """
        with self._writing() as connection:
            mine = and_(DRAW.c.study == self.study, DRAW.c.participant == code)
            found = connection.execute(select(DRAW).where(mine)).mappings().first()
            if found is not None:
                if found["group"] != group:
                    was = found["group"]
                    raise DataError(f"{code} was drawn in group {was!r}, not {group!r}: nothing was changed.")
                return rows.draw_of(found)
            stratum = and_(DRAW.c.study == self.study, DRAW.c.group == group)
            number = 1 + (connection.execute(select(func.max(DRAW.c.number)).where(stratum)).scalar() or 0)
            draw = Draw(group, number, choose(number), code, at)
            here = self._participant(connection, code)
            if here is None:
                keep_participants(connection, self.study, [Participant(code, draw.sequence, group, at)], at=at)
            elif here["sequence"] or here["group"] != group:
                raise DataError(
                    f"{code} is enrolled in group {here['group']!r} as {here['sequence']!r}: not drawn again."
                )
            else:
                connection.execute(update(PARTICIPANT).where(self._is(code)).values(sequence=draw.sequence))
            row = {"group": group, "number": number, "sequence": draw.sequence, "participant": code, "drawn": at}
            connection.execute(insert(DRAW).values(study=self.study, **row))
            self._note(connection, at, "sequence drawn", code, f"group {group!r}, draw {number}: {draw.sequence}")
            return draw

    def show_seed(self, *, at: str) -> int:
        """Return the seed of the allocation, and note in the log that it was shown: draws can be foretold now."""
        with self._writing() as connection:
            self._note(connection, at, "seed shown")
            return int(connection.execute(select(STUDY.c.seed).where(STUDY.c.key == self.study)).scalar_one())

    def begin(self, start: TrialStart, *, at: str) -> None:
        """Keep that a trial has begun, so that it is known even if its end never comes.

        Raises:
            DataError: the participant is not enrolled, or the id is taken.
        """
        with self._writing() as connection:
            self._check_enrolled(connection, start.participant)
            if self._row(connection, TRIAL_START, start.id) or self._row(connection, TRIAL, start.id):
                raise DataError(f"{self.place}: the trial {start.id} is there already; give each its own id.")
            design = self._design_number(connection)
            connection.execute(insert(TRIAL_START).values(study=self.study, design=design, **rows.start_row(start)))
            self._note(connection, at, "trial begun", start.participant, start.id)

    def record(self, trial: TrialRecord, *, at: str) -> None:
        """Keep a trial that has ended. The very same one again changes nothing: a doubtful call may be repeated.

        Raises:
            DataError: the participant is not enrolled, or another trial has that id.
        """
        self.record_all([trial], at=at)

    def record_all(self, trials: Iterable[TrialRecord], *, at: str) -> None:
        """Keep trials that have ended, all or none; see `record`."""
        chosen = list(trials)
        with self._writing() as connection:
            design = self._design_number(connection)
            for code in sorted({each.participant for each in chosen}):
                self._check_enrolled(connection, code)
            there = self._rows(connection, TRIAL, [each.id for each in chosen])
            started = self._rows(connection, TRIAL_START, [each.id for each in chosen])
            new: dict[str, dict[str, Any]] = {}
            for trial in chosen:
                row = {"study": self.study, **rows.trial_row(trial)}
                start = started.get(trial.id)
                row["design"] = design if start is None else start["design"]
                found = there.get(trial.id) or new.get(trial.id)
                if found is not None and {**found, **_MAY_DIFFER} != {**row, **_MAY_DIFFER}:
                    raise DataError(f"{self.place}: another trial {trial.id} is there already; give each its own id.")
                if start is not None and any(start[key] != row[key] for key in ("participant", "condition")):
                    raise DataError(f"{self.place}: the trial {trial.id} began with another participant or condition.")
                if found is None:
                    new[trial.id] = row
            for identifier in started:
                connection.execute(TRIAL_START.delete().where(self._of(TRIAL_START, identifier)))
            if new:
                connection.execute(insert(TRIAL), list(new.values()))
                what = {"study": self.study, "at": at, "what": "trial recorded"}
                connection.execute(
                    insert(LOG),
                    [what | {"participant": row["participant"], "detail": f"{row['id']}: {row['outcome']}"}
                     for row in new.values()],
                )  # fmt: skip

    def mark(self, trial: str, reason: str, *, at: str) -> None:
        """Mark a trial as invalid, and why; "" takes the mark back. Both stay in the log.

        Raises:
            DataError: there is no such trial.
        """
        with self._writing() as connection:
            found = self._row(connection, TRIAL, trial)
            if found is None:
                raise DataError(f"{self.place}: no trial {trial} that has ended; the board lists those that have not.")
            connection.execute(update(TRIAL).where(self._of(TRIAL, trial)).values(invalid=reason))
            self._note(connection, at, "trial marked", found["participant"], f"{trial}: {reason or 'valid again'}")

    def interrupt(self, trial: str, *, active_s: float, at: str) -> TrialRecord:
        """Return the record of a trial that was cut off and will not be gone on with, kept as interrupted.

        Raises:
            DataError: no such trial is unfinished.
        """
        with reading(self._engine) as connection:
            found = self._row(connection, TRIAL_START, trial)
        if found is None:
            raise DataError(f"{self.place}: no unfinished trial {trial}; `cathxr study board` lists those there are.")
        start = rows.start_row(rows.start_of(found))
        # how much of it was seen is only in its recording
        record = TrialRecord(outcome=Outcome.INTERRUPTED, active_s=active_s, **start)
        self.record(record, at=at)
        return record

    def answer(
        self, answers: Iterable[Answer], *, at: str, replace: bool = False, enrol: Iterable[Participant] = ()
    ) -> int:
        """Return how many of the answers are new or changed, after all or none were kept. enrol: before them.

        Raises:
            DataError: a participant is not enrolled, or an answer differs from one that is there and `replace` is not
            given.
        """
        with self._writing() as connection:
            keep_participants(connection, self.study, enrol, at=at)
            return keep_answers(connection, self.study, answers, at=at, replace=replace, place=self.place)

    def delete(self, code: str, *, at: str) -> Deleted:
        """Return what went with a participant: every row of that code; its draws lose it and keep their place.

        Raises:
            DataError: there is no such participant.
        """
        with self._writing() as connection:
            self._check_enrolled(connection, code)
            gone = deletion.delete_rows(connection, self.study, code)
            told = f"{gone.trials} trials and {gone.answers} answers went along"
            self._note(connection, at, "participant deleted", detail=told)
            return gone

    def deletion_of(self, code: str) -> Deleted:
        """Return what `delete` would take away, and change nothing."""
        with reading(self._engine) as connection:
            self._check_enrolled(connection, code)
            return deletion.counted(connection, self.study, code)

    # Parts -----------------------------------------------------------------------------------------------------------

    def _writing(self) -> AbstractContextManager[Connection]:
        return writing_alone(self._engine, self.study)

    def _all(self, table: Table, *order: str) -> list[Any]:
        chosen = select(table).where(table.c.study == self.study).order_by(*(table.c[each] for each in order))
        with reading(self._engine) as connection:
            return list(connection.execute(chosen).mappings())

    def _columns(self, table: Table, names: Iterable[str]) -> Select[Any]:
        """Return the query for some columns of this study's rows, in the order of `names`."""
        return select(*(table.c[each] for each in names)).where(table.c.study == self.study)

    def _designs(self, connection: Connection) -> tuple[StoredDesign, ...]:
        chosen = select(DESIGN).where(DESIGN.c.study == self.study).order_by(DESIGN.c.version)
        keys = ("version", "text", "sha256", "reason", "adopted")
        found = connection.execute(chosen).mappings()
        return tuple(StoredDesign(**{key: row[key] for key in keys}) for row in found)

    def _design_number(self, connection: Connection) -> int:
        newest = select(func.max(DESIGN.c.version)).where(DESIGN.c.study == self.study)
        return connection.execute(newest).scalar() or 0

    def _has_data(self, connection: Connection) -> bool:
        tables = (DRAW, TRIAL, TRIAL_START, ANSWER)
        chosen = (select(each.c.study).where(each.c.study == self.study).limit(1) for each in tables)
        return any(connection.execute(each).first() is not None for each in chosen)

    def _is(self, code: str) -> Any:
        return and_(PARTICIPANT.c.study == self.study, PARTICIPANT.c.code == code)

    def _of(self, table: Table, trial: str) -> Any:
        return and_(table.c.study == self.study, table.c.id == trial)

    def _row(self, connection: Connection, table: Table, trial: str) -> Any:
        return connection.execute(select(table).where(self._of(table, trial))).mappings().first()

    def _rows(self, connection: Connection, table: Table, trials: list[str]) -> dict[str, Any]:
        """Return the rows of trials by id, some hundred at a time: databases take no list without end."""
        found: dict[str, Any] = {}
        for start in range(0, len(trials), 500):
            here = and_(table.c.study == self.study, table.c.id.in_(trials[start : start + 500]))
            found |= {row["id"]: row for row in connection.execute(select(table).where(here)).mappings()}
        return found

    def _participant(self, connection: Connection, code: str) -> Any:
        return connection.execute(select(PARTICIPANT).where(self._is(code))).mappings().first()

    def _check_enrolled(self, connection: Connection, code: str) -> None:
        if self._participant(connection, code) is None:
            raise DataError(f"{self.place}: no participant {code} in study {self.study}; allocate that code first.")

    def _note(self, connection: Connection, at: str, what: str, participant: str = "", detail: str = "") -> None:
        row = {"study": self.study, "at": at, "what": what, "participant": participant, "detail": detail}
        connection.execute(insert(LOG).values(**row))
