"""Connections to a study store: where it is, how safely it writes, and every failure as one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url, select
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, SQLAlchemyError

from cathxr.core import CathxrError, ConfigError, DataError
from cathxr.storage.study_store.schema import STUDY

WAIT_S = 30.0
"""How long a writer waits for another one."""
_WRITES = {"cathxr_writes": True}
_KEPT = "what was stored before is intact"


def store_url(place: str | Path) -> URL:
    """Return the address of a store: a file's path (SQLite), or postgresql://user@host/database.

    Raises:
        ConfigError: it is the address of another kind of database, or none at all.
    """
    text = str(place)
    if "://" not in text:
        return URL.create("sqlite", database=text)
    try:
        url = make_url(text)
    except (ArgumentError, ValueError) as error:
        raise ConfigError("The store's address cannot be read; write postgresql://user@host/database.") from error
    if url.get_backend_name() == "postgresql":
        return url.set(drivername="postgresql+psycopg")
    if url.get_backend_name() == "sqlite" and url.database and url.database != ":memory:":
        return URL.create("sqlite", database=url.database)
    raise ConfigError(
        f"The store's address begins with {url.drivername}://; give a file's path, or postgresql://user@host/database."
    )


def shown(url: URL) -> str:
    """Return a store's address for a sentence: a path, or a URL without its password."""
    if url.get_backend_name() == "sqlite":
        return str(url.database)
    return url.set(drivername="postgresql").render_as_string(hide_password=True)


def new_engine(url: URL) -> Engine:
    """Return an engine for a store. Nothing is connected yet; see `store_url` for what may be given."""
    if url.get_backend_name() == "sqlite":
        engine = create_engine(url, connect_args={"timeout": WAIT_S, "check_same_thread": False})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    return create_engine(url, pool_pre_ping=True, connect_args={"connect_timeout": 10, "application_name": "cathxr"})


@contextmanager
def reading(engine: Engine) -> Iterator[Connection]:
    """Yield a connection in which everything is read as of one moment.

    Raises:
        DataError: the store fails, in a sentence.
    """
    isolation = {} if engine.dialect.name == "sqlite" else {"isolation_level": "REPEATABLE READ"}
    with told(engine.url, done=False), engine.connect() as plain:
        connection = plain.execution_options(**isolation)
        with connection.begin():
            yield connection


@contextmanager
def writing(engine: Engine) -> Iterator[Connection]:
    """Yield a connection whose changes are all kept when the block ends well, and none of them when it does not.

    Raises:
        DataError: the store fails, in a sentence.
    """
    with told(engine.url, done=True), engine.connect() as plain:
        connection = plain.execution_options(**_WRITES)
        with connection.begin():
            yield connection


@contextmanager
def writing_alone(engine: Engine, study: str) -> Iterator[Connection]:
    """Yield a connection as `writing` does, after every other writer of that study has ended: what is read stays true.

    Raises:
        DataError: the store fails, in a sentence.
    """
    with writing(engine) as connection:
        # SQLite has taken its lock by BEGIN IMMEDIATE, and knows no FOR UPDATE, which is left out there
        connection.execute(select(STUDY.c.key).where(STUDY.c.key == study).with_for_update()).first()
        yield connection


@contextmanager
def told(url: URL, *, done: bool) -> Iterator[None]:
    """Turn what a database says into a sentence. done: something was to be written.

    Raises:
        DataError: instead of SQLAlchemy's errors.
    """
    try:
        yield
    except CathxrError:
        raise
    except NoSuchModuleError as error:
        raise ConfigError(f"{shown(url)}: no driver for this store ({error}); install cathxr[study].") from error
    except DBAPIError as error:
        nothing = f" Nothing of this was written, and {_KEPT}." if done else ""
        raise DataError(f"{shown(url)}: {_reason(error.orig)}.{nothing}") from error
    except (SQLAlchemyError, ModuleNotFoundError) as error:
        raise DataError(f"{shown(url)}: the study store cannot be used ({_first_line(error)}).") from error


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    """Make SQLite wait for others, keep what was committed through a power cut, and overwrite what is deleted."""
    # the driver must not begin transactions by itself: _begin_sqlite does
    connection.isolation_level = None
    for pragma in ("foreign_keys = ON", "journal_mode = DELETE", "synchronous = EXTRA", "secure_delete = ON"):
        connection.execute(f"PRAGMA {pragma}").fetchall()


def _begin_sqlite(connection: Connection) -> None:
    # a writer takes its lock at once: one that began by reading could not wait for another without a deadlock
    writes = connection.get_execution_options().get("cathxr_writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


_SQLITE = {
    "SQLITE_FULL": "the disk is full; make room and do it again",
    "SQLITE_IOERR": "the disk refuses (full, or a limit on the size of files, or damaged); make room, then do it again",
    "SQLITE_BUSY": f"somebody else has been writing for over {WAIT_S:.0f} s; do it again, or look which program it is",
    "SQLITE_LOCKED": "somebody else is writing; do it again",
    "SQLITE_READONLY": "the file or its folder may only be read; choose another place or change the permissions",
    "SQLITE_PERM": "access is refused; change the permissions of the file",
    "SQLITE_CANTOPEN": "the file cannot be opened; check that its folder exists and may be written to",
    "SQLITE_NOTADB": "this is no study store, but some other file; check the path",
    "SQLITE_CORRUPT": "the file is damaged; take it from a backup, and keep this one for a look at it",
}
_POSTGRES = {
    "53100": "the disk of the database's server is full; make room there and do it again",
    "53300": "the database has too many connections; try again later",
    "28": "the database refuses the user or the password; check them (the password is best kept in ~/.pgpass)",
    "3D000": "there is no such database; create it first (createdb NAME)",
    "42501": "the database's user may not do this; ask whoever runs the database",
    "08": "the connection to the database was lost; check the network, then do it again",
    "57P": "the database was shut down; start it and do it again",
    "25006": "the database may only be read (a standby?); give the address of the one that may be written to",
}


def _reason(error: BaseException | None) -> str:
    name = getattr(error, "sqlite_errorname", None)
    if name is not None:
        return next((told for key, told in _SQLITE.items() if str(name).startswith(key)), _first_line(error))
    state = getattr(error, "sqlstate", None)
    if state is not None:
        return next((told for key, told in _POSTGRES.items() if str(state).startswith(key)), _first_line(error))
    if type(error).__module__.startswith("psycopg"):
        return f"the database does not answer ({_first_line(error)}); check the address and that it runs"
    return _first_line(error)


def _first_line(error: BaseException | None) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0].rstrip(".")
