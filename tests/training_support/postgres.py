"""A real PostgreSQL server of a test's own, on loopback, that can be stopped in the middle and started again."""

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

UNDER_CI = os.environ.get("CI", "").lower() in ("1", "true", "yes")
_MISSING = "PostgreSQL's server is not installed, and this test needs it (`make test` as root on Debian does it)"


class PostgresServer:
    """A server with a database `postgres` and a user `cathxr`. A context manager; its folder goes with it."""

    def __init__(self) -> None:
        initdb, server = _program("initdb"), _program("postgres")
        if initdb is None or server is None:
            if UNDER_CI:
                pytest.fail(_MISSING, pytrace=False)
            pytest.skip(_MISSING)
        self._server, self._user = server, _user()
        self._folder = Path(tempfile.mkdtemp(prefix="cathxr-postgres-"))
        if self._user is not None:
            shutil.chown(self._folder, self._user)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = probe.getsockname()[1]
        self._running: subprocess.Popen[bytes] | None = None
        subprocess.run(
            [initdb, "-D", self._folder / "data", "-U", "cathxr", "-A", "trust", "-E", "UTF8", "--no-sync"],
            check=True, capture_output=True, user=self._user, cwd=self._folder, env=self._environment(),
        )  # fmt: skip

    @property
    def address(self) -> str:
        """The address of its database."""
        return f"postgresql://cathxr@127.0.0.1:{self._port}/postgres"

    @property
    def user(self) -> str | None:
        """Whom the server runs as; None: whoever runs the tests."""
        return self._user

    def __enter__(self) -> "PostgresServer":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        shutil.rmtree(self._folder, ignore_errors=True)

    def start(self) -> None:
        """Start, and return when it answers."""
        options = ["-h", "127.0.0.1", "-p", str(self._port), "-k", str(self._folder), "-c", "shared_buffers=16MB"]
        with (self._folder / "log").open("ab") as log:
            self._running = subprocess.Popen(
                [self._server, "-D", self._folder / "data", *options],
                stdout=subprocess.DEVNULL, stderr=log, user=self._user, cwd=self._folder, env=self._environment(),
            )  # fmt: skip
        self._wait(self._running)

    def stop(self) -> None:
        """Stop at once, whoever is connected."""
        running, self._running = self._running, None
        if running is not None:
            running.send_signal(signal.SIGINT)  # its "fast" shutdown
            running.wait(timeout=60)

    def _wait(self, running: "subprocess.Popen[bytes]") -> None:
        psycopg = pytest.importorskip("psycopg")
        for _ in range(600):
            if running.poll() is not None:
                raise AssertionError(f"PostgreSQL ended at once: {(self._folder / 'log').read_text('utf-8')}")
            try:
                psycopg.connect(self.address, connect_timeout=2).close()
                return
            except psycopg.OperationalError:
                time.sleep(0.1)
        raise AssertionError(f"PostgreSQL did not begin to answer: {(self._folder / 'log').read_text('utf-8')}")

    @staticmethod
    def _environment() -> dict[str, str]:
        return {"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8"}


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
