"""A file that one program holds, with real programs that end well or are killed."""

import subprocess
import sys
from pathlib import Path

import pytest

from cathxr.core import DataError
from cathxr.storage.held_file import HeldFile, Holder, holder_of

HOLDS = """
import sys, time
from pathlib import Path
from cathxr.storage.held_file import HeldFile, Holder
held = HeldFile.held(Path(sys.argv[1]), Holder("here", 42, "now"))
print(held is not None, flush=True)
sys.stdin.read()
held.let_go()
"""


def program(path: Path) -> "subprocess.Popen[str]":
    started = subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert started.stdout is not None
    assert started.stdout.readline() == "True\n"
    return started


def test_held_by_another_program_until_it_ends(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "trial"
    with program(path) as other:  # its end closes the program's input, and the program ends
        assert holder_of(path, host="here") == Holder("here", 42, "now")
        assert holder_of(path, host="there") == Holder("here", 42, "now")
        assert HeldFile.held(path, Holder("here", 1, "later")) is None
    assert other.returncode == 0
    assert not path.exists()
    assert holder_of(path, host="here") is None


def test_let_go_of_by_the_system_when_its_program_is_killed(tmp_path: Path) -> None:
    path = tmp_path / "trial"
    with program(path) as other:
        other.kill()
    assert path.exists()
    assert holder_of(path, host="here") is None
    # from another host nobody can say
    assert holder_of(path, host="there") == Holder("here", 42, "now", certain=False)
    mine = HeldFile.held(path, Holder("here", 1, "later"))
    assert mine is not None
    assert holder_of(path, host="here") == Holder("here", 1, "later")
    mine.let_go()
    mine.let_go()
    assert not path.exists()


def test_a_file_with_other_text_is_nobodys(tmp_path: Path) -> None:
    path = tmp_path / "trial"
    path.write_text("something")
    assert holder_of(path, host="here") is None
    path.write_text("[]")
    assert holder_of(path, host="here") is None


def test_a_place_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be held"):
        HeldFile.held(tmp_path / "file" / "trial", Holder("here", 1, "now"))
