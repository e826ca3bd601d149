"""What is made from something else is as fresh as its source."""

import subprocess
import sys
import tomllib
from importlib.metadata import entry_points, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import cathxr


def _locked(path: Path) -> dict[str, str]:
    pins = (Requirement(line) for line in path.read_text(encoding="utf-8").splitlines())
    return {canonicalize_name(pin.name): str(pin.specifier).removeprefix("==") for pin in pins}


def test_types_and_schemas_of_the_wire_are_fresh(repo_root: Path) -> None:
    command = [sys.executable, "-m", "cathxr.wire.generate", "--check"]
    done = subprocess.run(command, cwd=repo_root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_locks_answer_what_pyproject_asks(repo_root: Path) -> None:
    project = tomllib.loads((repo_root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    runtime, everything = _locked(repo_root / "requirements.lock"), _locked(repo_root / "requirements-dev.lock")
    for asked, locked in (
        (project["dependencies"], runtime),
        (project["dependencies"] + project["optional-dependencies"]["dev"], everything),
    ):
        for requirement in map(Requirement, asked):
            pinned = locked.get(canonicalize_name(requirement.name))
            assert pinned is not None, f"{requirement.name} is not locked: run `make lock`"
            assert requirement.specifier.contains(pinned, prereleases=True), f"{requirement}, but {pinned} is locked"


def test_both_locks_agree(repo_root: Path) -> None:
    runtime, everything = _locked(repo_root / "requirements.lock"), _locked(repo_root / "requirements-dev.lock")
    assert runtime.items() <= everything.items()


def test_installed_version_is_the_sources() -> None:
    assert version("cathxr") == cathxr.__version__, "run `make test` again, which installs the project anew"


@pytest.mark.parametrize("group", ["cathxr.cameras", "cathxr.encoders"])
def test_declared_drivers_load(group: str) -> None:
    drivers = [each for each in entry_points(group=group) if each.dist and each.dist.name == "cathxr"]
    assert drivers
    for each in drivers:
        assert callable(each.load())
