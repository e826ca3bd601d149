"""What several folders of unit tests share."""

from collections.abc import Iterator

import pytest

from ..training_support.postgres import PostgresServer


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[PostgresServer]:
    """A running PostgreSQL server, made for this run and gone after it."""
    with PostgresServer() as server:
        yield server
