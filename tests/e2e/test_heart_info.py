"""`cathxr heart info` as a person runs it."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ..heart_support.dicom_series import volume_of, write_series


def info(path: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "cathxr", "heart", "info", str(path)],
        capture_output=True, text=True, encoding="utf-8", timeout=300.0, check=False,
        env=os.environ | {"PYTHONIOENCODING": "utf-8"},
    )  # fmt: skip


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study as scanners send it: a scout, a native scan, a contrast scan of two phases with a slice missing."""
    hu = np.full((24, 40, 40), 30)
    write_series(tmp_path / "1", volume_of(hu[:1]), series="a", image_type=("ORIGINAL", "PRIMARY", "LOCALIZER"))
    write_series(tmp_path / "2", volume_of(hu, spacing=(2.0, 2.0, 3.0)), series="b")
    hu[:, 8:32, 8:32] = 420
    for percent in (35, 75):
        tags = {"NominalPercentageOfCardiacPhase": float(percent)}
        volume = volume_of(hu, spacing=(2.0, 2.0, 2.5))
        write_series(tmp_path / str(percent), volume, series="c", tags=tags, missing=[5], description=str(percent))
    return tmp_path


def test_a_mixed_study_in_a_table(study: Path) -> None:
    done = info(study)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for words in (
        "2.00 × 2.00 × 2.50", "80 × 80 × 60", "2 phases", "yes, 420 HU", "Bv38d", "1: cannot be read. A localiser.",
        "3: Between −110.0 and −105.0 mm a slice is missing: interpolated.",
        "3: phases 35 %, 75 %; 75 % is taken as end-diastole.", "2: no bright blood pool",
        "Fit for a heart: series 3. Build it with: cathxr heart build PATH --series 3 --out HEART/",
    ):  # fmt: skip
        assert words in done.stdout, done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 110


def test_what_cannot_be_read_is_one_sentence(tmp_path: Path) -> None:
    done = info(tmp_path)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr == f"Error: {tmp_path} is empty; give a folder that holds DICOM files.\n"


def test_the_real_scan(shared_data: Path) -> None:
    done = info(shared_data / "cta_thorax" / "dicom_ct_20slices")
    assert "0.98 × 0.98 × 2.00" in done.stdout
    assert done.returncode == 0
