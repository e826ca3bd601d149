"""What the tests of the repository itself share."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

_BINARY = {".glb", ".gz", ".ico", ".jpg", ".mcap", ".mkv", ".mp4", ".npz", ".png", ".stl", ".webp", ".woff2"}


@pytest.fixture(scope="session")
def repo_files(repo_root: Path, require_tool: Callable[[str], Path]) -> tuple[Path, ...]:
    """Every file that git tracks or would track."""
    if not (repo_root / ".git").exists():
        pytest.skip("this copy is no git clone, so what belongs to the repository is not known")
    git = str(require_tool("git"))
    command = [git, "-C", str(repo_root), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, capture_output=True, check=True).stdout.decode().split("\0")
    files = tuple(path for path in (repo_root / each for each in sorted(set(names)) if each) if path.is_file())
    assert len(files) > 20, "git lists hardly any files: these tests would pass without looking at anything"
    return files


@pytest.fixture(scope="session")
def text_files(repo_files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Those of them that hold text."""
    return tuple(path for path in repo_files if path.suffix not in _BINARY)
