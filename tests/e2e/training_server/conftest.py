"""A live system that trains: its own folder for recordings, and a data folder that is nobody's."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from .kit import Operator


class Place:
    """A folder in which live systems are started, one after another."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.recordings = folder, folder / "recordings"
        self.store = folder / "data" / "cathxr" / "training.sqlite"

    @contextmanager
    def running(self, *arguments: str, rendered: bool = False) -> Iterator[tuple[subprocess.Popen[str], int]]:
        """Give a live system and its port. rendered: with the real tracker on the twin's pictures."""
        script = [str(Path(__file__).with_name("truth_run.py"))] if not rendered else ["-m", "cathxr", "run"]
        command = [sys.executable, *script, "--port", "0", "--no-browser", "--recordings", str(self.recordings)]
        process = subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert process.stdout is not None
        try:
            said = ""
            while not (found := re.search(r"http://127\.0\.0\.1:(\d+)", said)):
                line = process.stdout.readline()
                assert line, said
                said += line
            yield process, int(found.group(1))
        finally:
            process.kill()
            process.wait()
            process.stdout.close()


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Place:
    """An empty place."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return Place(tmp_path)


@pytest.fixture
def operator() -> Iterator[Callable[[int], Operator]]:
    """Makes operators, and closes their links in the end."""
    with ExitStack() as stack:

        def made(port: int) -> Operator:
            found = Operator(port)
            stack.callback(found.close)
            return found

        yield made
