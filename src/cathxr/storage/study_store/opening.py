"""Opens a study store: makes its tables where there are none, and refuses what it does not know."""

from pathlib import Path

from sqlalchemy import URL, Connection, Engine, insert, inspect, select

from cathxr.core import ConfigError, DataError
from cathxr.storage.study_store.engine import new_engine, reading, shown, told, writing
from cathxr.storage.study_store.schema import METADATA, STORE, STUDY, VERSION


def opened(url: URL) -> Engine:
    """Return the engine of a store that is there, of this version.

    Raises:
        DataError: there is no store, it cannot be reached, or it is of a newer version.
    """
    if url.get_backend_name() == "sqlite" and not Path(str(url.database)).is_file():
        raise DataError(f"{shown(url)}: no such study store; make one with `cathxr study init`, or check the path.")
    return _checked(new_engine(url), url)


def created(url: URL, *, software: str, at: str) -> Engine:
    """Return the engine of a store whose tables are made where there are none.

    Raises:
        DataError: as `opened`, or a file that is something else is in the way.
    """
    if url.get_backend_name() == "sqlite":
        file = Path(str(url.database))
        if not file.absolute().parent.is_dir():
            raise DataError(f"{file}: the folder of the study store does not exist; make it first.")
    engine = new_engine(url)
    with writing(engine) as connection:
        # inside one transaction: two that make the same store at once make it once
        if not inspect(connection).has_table(STORE.name):
            if url.get_backend_name() == "sqlite" and inspect(connection).get_table_names():
                raise DataError(f"{shown(url)}: this file is some other database; choose another name for the store.")
            METADATA.create_all(connection)
            connection.execute(insert(STORE).values(id=1, version=VERSION, software=software, created=at))
    return _checked(engine, url)


def check_study(connection: Connection, key: str, *, place: str) -> None:
    """Return when the store holds a study of that key.

    Raises:
        ConfigError: it does not; the sentence names those that it holds.
    """
    known = list(connection.execute(select(STUDY.c.key).order_by(STUDY.c.key)).scalars())
    if key not in known:
        held = f"it holds {', '.join(known)}" if known else "it holds none yet"
        raise ConfigError(f"{place}: no study {key} in this store ({held}); run `cathxr study init` first.")


def _checked(engine: Engine, url: URL) -> Engine:
    try:
        with reading(engine) as connection:
            if not inspect(connection).has_table(STORE.name):
                raise DataError(f"{shown(url)}: this is no study store; make one with `cathxr study init`.")
            version, software = connection.execute(select(STORE.c.version, STORE.c.software)).one()
        if version != VERSION:
            newer = version > VERSION
            told_so = f"made by cathxr {software}, of a newer version" if newer else "of an older version"
            do = "install that cathxr or a newer one" if newer else "upgrade it with the cathxr that made it"
            raise DataError(
                f"{shown(url)}: the store's tables are version {version} ({told_so}), and this cathxr knows version "
                f"{VERSION}; {do}. Nothing was changed."
            )
    except BaseException:
        with told(url, done=False):
            engine.dispose()
        raise
    return engine
