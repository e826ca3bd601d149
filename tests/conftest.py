"""Fixtures and settings that every test may use."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

ROOT = Path(__file__).resolve().parent.parent
UNDER_CI = os.environ.get("CI", "").lower() in ("1", "true", "yes")

# Examples may be slow on a loaded machine without anything being wrong: no deadline, no judgement by time.
settings.register_profile("local", deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("local"), derandomize=True, database=None, print_blob=True)
settings.load_profile("ci" if UNDER_CI else "local")

# Programs that go by several names.
_NAMES = {"chromium": ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")}


# Tests of these folders run real processes and threads against the clock: one at a time, with nothing beside them.
_LIVE = ("e2e", "firmware", "contract", "runtime")
# But not these: files in, files out.
_OFFLINE = (
    "test_builtin_heart.py",
    "test_calibration_boards.py",
    "test_calibration_chain.py",
    "test_heart_build.py",
    "test_heart_deidentified.py",
    "test_heart_info.py",
    "test_photographs.py",
    "test_proof_heart_build.py",
    "test_proof_intrinsics.py",
    "test_proof_markers.py",
    "test_proof_poses.py",
    "test_proof_roll.py",
    "test_proof_segmentation.py",
    "test_proof_statistics.py",
    "test_recorded_encoder.py",
    "test_register.py",
    "test_study.py",
    "test_proof_study.py",
    "test_study_report.py",
    "test_study_twin.py",
    "test_rendered.py",
    "test_score.py",
)
# Tests of these folders share what takes long to make, and so run in one process.
_TOGETHER = ("calibration_check",)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark live tests, and let the others of a file run in one process where several run at once (see the Makefile)."""
    for item in items:
        folders = item.path.parent.relative_to(ROOT).parts
        if any(each in folders for each in _LIVE) and item.path.name not in _OFFLINE:
            item.add_marker("live")
        shared = [each for each in folders if each in _TOGETHER]
        item.add_marker(pytest.mark.xdist_group(shared[0] if shared else item.path.relative_to(ROOT).as_posix()))


@pytest.fixture(scope="session")
def repo_root() -> Path:
    """The root of this repository."""
    return ROOT


@pytest.fixture(scope="session")
def require_tool() -> Callable[[str], Path]:
    """A function that gives the path of a program, or skips the test (fails it under CI=true) where it is absent."""

    def find(name: str) -> Path:
        for each in _NAMES.get(name, (name,)):
            if path := shutil.which(each):
                return Path(path)
        sentence = f"{name} is not on PATH, and this test needs it (`make test` as root on Debian installs it)"
        if UNDER_CI:
            pytest.fail(sentence, pytrace=False)
        pytest.skip(sentence)

    return find


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real data, `$CATHXR_DATA` or ../shared/data; skips the test where there is none."""
    folder = Path(os.environ.get("CATHXR_DATA") or ROOT.parent / "shared" / "data")
    if not folder.is_dir():
        pytest.skip(f"the real data is not at {folder}; set CATHXR_DATA to where it is")
    return folder
