"""The exported phantom, visited by the twin through the command that a lab would use."""

import csv
from pathlib import Path

import pytest
from click.testing import CliRunner

from cathxr.app.cli import main
from cathxr.app.hardware_export import write_texts
from cathxr.hardware.holes import nominal_phantom
from cathxr.hardware.layout import Layout


@pytest.mark.proof
def test_the_twin_visits_the_exported_phantom(default: Layout, tmp_path: Path) -> None:
    write_texts(default, tmp_path)
    command = ["calibrate", "check", "--phantom", str(tmp_path / "phantom.toml"), "--source", "twin"]
    done = CliRunner().invoke(main, [*command, "--report", str(tmp_path / "report")])
    assert done.exit_code == 0, done.output
    with (tmp_path / "report" / "phantom_errors.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    # Every hole twice. The box's own rig is known exactly, so that what is left is the pictures' noise.
    assert len(rows) == 2 * len(nominal_phantom(default).holes)
    assert max(float(each["error_mm"]) for each in rows) < 0.1
