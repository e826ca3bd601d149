"""Stores to test against: SQLite in a folder, and a real PostgreSQL server of the test's own, on loopback."""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from cathxr.storage.study_store import StudyStore

UNDER_CI = os.environ.get("CI", "").lower() in ("1", "true", "yes")


def _program(name: str) -> Path | None:
    """Return a program of PostgreSQL's: Debian keeps the server's out of PATH."""
    found = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"))
    on_path = shutil.which(name)
    return found[-1] if found else Path(on_path) if on_path else None


def _user() -> str | None:
    """Return whom the server runs as: it refuses root."""
    if os.geteuid() != 0:
        return None
    names = {each.pw_name for each in pwd.getpwall()}
    return next(each for each in ("postgres", "nobody") if each in names)


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """The address of a running server's database, made for this run and gone after it."""
    initdb, server = _program("initdb"), _program("postgres")
    if initdb is None or server is None:
        sentence = (
            "PostgreSQL's server is not installed, and this test needs it (`make test` as root on Debian does it)"
        )
        if UNDER_CI:
            pytest.fail(sentence, pytrace=False)
        pytest.skip(sentence)
    user = _user()
    folder = Path(tempfile.mkdtemp(prefix="cathxr-postgres-"))
    if user is not None:
        shutil.chown(folder, user)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8"}
    data = folder / "data"
    subprocess.run(
        [initdb, "-D", data, "-U", "cathxr", "-A", "trust", "-E", "UTF8", "--no-sync"],
        check=True, capture_output=True, user=user, cwd=folder, env=environment,
    )  # fmt: skip
    with (folder / "log").open("wb") as log:
        running = subprocess.Popen(
            [server, "-D", data, "-h", "127.0.0.1", "-p", str(port), "-k", folder, "-c", "shared_buffers=16MB"],
            stdout=subprocess.DEVNULL, stderr=log, user=user, cwd=folder, env=environment,
        )  # fmt: skip
    try:
        _wait(port, running, folder / "log")
        yield f"postgresql://cathxr@127.0.0.1:{port}/postgres"
    finally:
        running.terminate()
        running.wait(timeout=60)
        shutil.rmtree(folder, ignore_errors=True)


def _wait(port: int, running: "subprocess.Popen[bytes]", log: Path) -> None:
    psycopg = pytest.importorskip("psycopg")
    for _ in range(600):
        if running.poll() is not None:
            raise AssertionError(f"PostgreSQL ended at once: {log.read_text('utf-8')}")
        try:
            psycopg.connect(f"host=127.0.0.1 port={port} user=cathxr dbname=postgres connect_timeout=2").close()
            return
        except psycopg.OperationalError:
            time.sleep(0.1)
    raise AssertionError(f"PostgreSQL did not begin to answer: {log.read_text('utf-8')}")


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
