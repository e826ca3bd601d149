"""What a store says when it is not there, is something else, is of another version, or does not answer."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from cathxr.core import ConfigError, DataError
from cathxr.storage.study_store import StudyStore
from cathxr.storage.study_store.engine import shown, store_url

from .records import AT


def made(path: Path) -> Path:
    StudyStore.create(path, study="s", seed=1, software="1", at=AT).close()
    return path


def test_a_store_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"no such study store; make one with `cathxr study init`"):
        StudyStore.open(tmp_path / "x.sqlite", study="s")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(DataError, match="folder of the study store does not exist"):
        StudyStore.create(tmp_path / "no" / "x.sqlite", study="s", seed=1, software="1", at=AT)


@pytest.mark.parametrize("content", [b"no database at all, but long enough to be looked at" * 40, b""])
def test_a_file_that_is_something_else(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "x.sqlite"
    file.write_bytes(content)
    with pytest.raises(DataError, match="this is no study store"):
        StudyStore.open(file, study="s")
    assert file.read_bytes() == content


def test_another_programs_database_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "x.sqlite"
    with closing(sqlite3.connect(file)) as other:
        other.execute("CREATE TABLE photographs (id INTEGER)")
    before = file.read_bytes()
    with pytest.raises(DataError, match="some other database"):
        StudyStore.create(file, study="s", seed=1, software="1", at=AT)
    assert file.read_bytes() == before


@pytest.mark.parametrize(("version", "told"), [(2, "of a newer version"), (0, "of an older version")])
def test_another_version_is_refused_and_left_alone(tmp_path: Path, version: int, told: str) -> None:
    file = made(tmp_path / "x.sqlite")
    with closing(sqlite3.connect(file)) as other:
        other.execute("UPDATE cathxr_store SET version = ?, software = '9.9'", (version,))
        other.commit()
    before = file.read_bytes()
    for opening in (
        lambda: StudyStore.open(file, study="s"),
        lambda: StudyStore.create(file, study="t", seed=1, software="1", at=AT),
    ):
        with pytest.raises(DataError, match=rf"version {version} \(.*{told}.*Nothing was changed"):
            opening()
    assert file.read_bytes() == before


def test_a_damaged_store_says_so(tmp_path: Path) -> None:
    file = made(tmp_path / "x.sqlite")
    content = bytearray(file.read_bytes())
    content[100:-1] = b"\x5a" * (len(content) - 101)
    file.write_bytes(content)
    with pytest.raises(DataError, match=r"damaged|no study store"):
        StudyStore.open(file, study="s")


def test_a_database_that_does_not_answer(unused_port: int) -> None:
    with pytest.raises(DataError, match=r"does not answer .*check the address") as told:
        StudyStore.open(f"postgresql://me:secret@127.0.0.1:{unused_port}/x", study="s")
    assert "secret" not in str(told.value)


def test_a_database_that_is_not_there(postgres: str) -> None:
    with pytest.raises(DataError, match=r"no such database|does not exist"):
        StudyStore.open(postgres.replace("/postgres", "/nowhere"), study="s")
    with pytest.raises((DataError, ConfigError), match=r"no study|no study store"):
        StudyStore.open(postgres, study="none-such")


def test_addresses() -> None:
    assert shown(store_url("a/b.sqlite")) == "a/b.sqlite"
    assert shown(store_url("sqlite:///a/b.sqlite")) == "a/b.sqlite"
    assert shown(store_url("postgresql://me:secret@host/db")) == "postgresql://me:***@host/db"
    assert shown(store_url("postgresql+psycopg2://me@host/db")) == "postgresql://me@host/db"
    for wrong in ("mysql://host/db", "sqlite://", "postgresql://host:port/db"):
        with pytest.raises(ConfigError):
            store_url(wrong)


def test_what_was_deleted_is_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "x.sqlite"
    with StudyStore.create(file, study="s", seed=1, software="1", at=AT) as store:
        store.draw("QX77", lambda number: "2d>3d", at=AT)
        assert b"QX77" in file.read_bytes()
        store.delete("QX77", at=AT)
    assert b"QX77" not in file.read_bytes()
    assert [each.name for each in tmp_path.iterdir()] == ["x.sqlite"]


@pytest.fixture
def unused_port() -> int:
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port
