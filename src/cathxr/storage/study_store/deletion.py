"""What belongs to one participant in a store, and how it goes."""

from sqlalchemy import Connection, and_, func, select, update
from sqlalchemy.sql.elements import ColumnElement

from cathxr.storage.study_store.nouns import Deleted
from cathxr.storage.study_store.schema import ANSWER, DRAW, LOG, PARTICIPANT, TRIAL, TRIAL_START


def counted(connection: Connection, study: str, code: str) -> Deleted:
    """Return what belongs to a participant, and which of the session folders belong to others too."""
    sessions: set[str] = set()
    others: set[str] = set()
    trials = 0
    for table in (TRIAL, TRIAL_START):
        found = connection.execute(
            select(table.c.participant, table.c.session).where(table.c.study == study).distinct()
        ).all()
        sessions |= {session for participant, session in found if participant == code and session}
        # other studies of the same store may have recorded into the same folder
        anyone = select(table.c.session).where(~and_(table.c.study == study, table.c.participant == code)).distinct()
        others |= set(connection.execute(anyone).scalars())
        whose = and_(table.c.study == study, table.c.participant == code)
        trials += connection.execute(select(func.count()).select_from(table).where(whose)).scalar_one()
    whose = and_(ANSWER.c.study == study, ANSWER.c.participant == code)
    answers = connection.execute(select(func.count()).select_from(ANSWER).where(whose)).scalar_one()
    return Deleted(trials, answers, tuple(sorted(sessions - others)), tuple(sorted(sessions & others)))


def delete_rows(connection: Connection, study: str, code: str) -> Deleted:
    """Return what was deleted. Draws and the log keep their place; the code and every detail about it go from them."""
    gone = counted(connection, study, code)
    for table in (TRIAL, TRIAL_START, ANSWER):
        connection.execute(table.delete().where(and_(table.c.study == study, table.c.participant == code)))
    connection.execute(PARTICIPANT.delete().where(and_(PARTICIPANT.c.study == study, PARTICIPANT.c.code == code)))
    drawn: ColumnElement[bool] = and_(DRAW.c.study == study, DRAW.c.participant == code)
    connection.execute(update(DRAW).where(drawn).values(participant=""))
    noted = and_(LOG.c.study == study, LOG.c.participant == code)
    connection.execute(update(LOG).where(noted).values(participant="", detail="(deleted with the participant)"))
    return gone
