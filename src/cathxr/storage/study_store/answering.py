"""How answers and the people who gave them are kept: looked up together, written together, whatever their number."""

from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import Connection, Select, bindparam, insert, select, update

from cathxr.core import DataError
from cathxr.core.trials import Answer, Participant
from cathxr.storage.study_store import rows
from cathxr.storage.study_store.schema import ANSWER, LOG, PARTICIPANT

_PLACE = ("participant", "survey", "occasion", "item")
_AT_ONCE = 500
"""How many values a query lists: databases take no list without end."""


def keep_participants(connection: Connection, study: str, people: Iterable[Participant], *, at: str) -> None:
    """Enrol participants, all of them new.

    Raises:
        DataError: a code is taken.
    """
    chosen = list(people)
    taken = _enrolled(connection, study, [each.code for each in chosen])
    for each in chosen:
        if each.code in taken:
            raise DataError(f"{each.code} is enrolled already; every participant has a code of their own.")
        taken.add(each.code)
    if chosen:
        connection.execute(insert(PARTICIPANT), [{"study": study, **rows.participant_row(each)} for each in chosen])
        noted = [_line(study, at, "participant enrolled", each.code, f"group {each.group!r}") for each in chosen]
        connection.execute(insert(LOG), noted)


def keep_answers(
    connection: Connection, study: str, answers: Iterable[Answer], *, at: str, replace: bool, place: str
) -> int:
    """Return how many answers are new or changed, after they were kept. place: the store's, for sentences.

    Raises:
        DataError: a participant is not enrolled, or an answer differs from one that is there and `replace` is not
        given. What was written before is for the transaction to take back.
    """
    chosen = list(answers)
    codes = sorted({each.participant for each in chosen})
    enrolled = _enrolled(connection, study, codes)
    for code in codes:
        if code not in enrolled:
            raise DataError(f"{place}: no participant {code} in study {study}; allocate that code first.")
    there = _there(connection, study, codes)
    new: dict[tuple[str, ...], dict[str, Any]] = {}
    changed: dict[tuple[str, ...], dict[str, Any]] = {}
    noted, count = [], 0
    for each in chosen:
        row = rows.answer_row(each)
        key = tuple(str(row[part]) for part in _PLACE)
        found = there.get(key)
        if found == (each.value, each.text):
            continue
        what = f"{each.survey} {each.item} {each.occasion}"
        if found is None:
            new[key] = row
        elif replace:
            (new if key in new else changed)[key] = row
            was = found[1] if found[0] is None else f"{found[0]:g}"
            noted.append(_line(study, at, "answer replaced", each.participant, f"{what}: was {was}"))
        else:
            raise DataError(
                f"{each.participant} has another answer to {what} already; nothing was entered: correct it, or say "
                "that answers are to be replaced."
            )
        there[key] = (each.value, each.text)
        count += 1
    if new:
        connection.execute(insert(ANSWER), [{"study": study, **row} for row in new.values()])
    if changed:
        _change(connection, study, list(changed.values()))
    if count:
        connection.execute(insert(LOG), [*noted, _line(study, at, "answers entered", "", f"{count}")])
    return count


def _change(connection: Connection, study: str, changed: Sequence[dict[str, Any]]) -> None:
    """Put other values in place of those that are there."""
    changes = update(ANSWER).where(ANSWER.c.study == study)
    for part in _PLACE:
        changes = changes.where(ANSWER.c[part] == bindparam(f"old_{part}"))
    values = ("value", "words", "answered")
    changes = changes.values({each: bindparam(f"new_{each}") for each in values})
    connection.execute(
        changes,
        [{f"old_{part}": row[part] for part in _PLACE} | {f"new_{each}": row[each] for each in values}
         for row in changed],
    )  # fmt: skip


def _there(connection: Connection, study: str, codes: Sequence[str]) -> dict[tuple[str, ...], tuple[float | None, str]]:
    """Return value and words of every answer of some participants, by its place."""
    columns = select(*(ANSWER.c[part] for part in _PLACE), ANSWER.c.value, ANSWER.c.words)
    found: dict[tuple[str, ...], tuple[float | None, str]] = {}
    for some in _some(codes):
        chosen: Select[Any] = columns.where(ANSWER.c.study == study, ANSWER.c.participant.in_(some))
        found |= {tuple(row[:4]): (row[4], row[5]) for row in connection.execute(chosen)}
    return found


def _enrolled(connection: Connection, study: str, codes: Sequence[str]) -> set[str]:
    """Return those of the codes that are enrolled."""
    found: set[str] = set()
    for some in _some(codes):
        chosen = select(PARTICIPANT.c.code).where(PARTICIPANT.c.study == study, PARTICIPANT.c.code.in_(some))
        found |= set(connection.execute(chosen).scalars())
    return found


def _some(codes: Sequence[str]) -> list[Sequence[str]]:
    return [codes[start : start + _AT_ONCE] for start in range(0, len(codes), _AT_ONCE)]


def _line(study: str, at: str, what: str, participant: str, detail: str) -> dict[str, Any]:
    return {"study": study, "at": at, "what": what, "participant": participant, "detail": detail}
