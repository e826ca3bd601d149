"""Stores to test against: SQLite in a folder, and a real PostgreSQL server of the test's own, on loopback."""

import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from cathxr.storage.study_store import StudyStore

from ...training_support.postgres import PostgresServer


@pytest.fixture(scope="session")
def postgres(postgres_server: PostgresServer) -> str:
    """The address of a running server's database."""
    return postgres_server.address


@pytest.fixture(params=["sqlite", "postgres"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The place of a store, of either kind."""
    if request.param == "sqlite":
        return str(tmp_path / "study.sqlite")
    address: str = request.getfixturevalue("postgres")
    return address


@pytest.fixture
def key() -> str:
    """The key of a study that no other test uses: they share the PostgreSQL server."""
    return f"study-{uuid.uuid4().hex[:12]}"


@pytest.fixture
def store(place: str, key: str) -> Iterator[StudyStore]:
    """A new store of either kind."""
    with StudyStore.create(place, study=key, seed=11, software="1.2.3", at="2026-01-01T00:00:00Z") as opened:
        yield opened
