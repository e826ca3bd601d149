"""The firmware's headers compiled for the host, against the vectors that the host's own tests read."""

import subprocess
from collections.abc import Callable
from pathlib import Path


def test_headers(repo_root: Path, require_tool: Callable[[str], Path], tmp_path: Path) -> None:
    make, _ = require_tool("make"), require_tool("g++")
    folder = repo_root / "firmware"
    command = [str(make), "-C", str(folder / "simulation"), f"OUT={tmp_path}", "headers"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    done = subprocess.run(
        [tmp_path / "test_headers", folder / "vectors.csv"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[0]) > 1000
