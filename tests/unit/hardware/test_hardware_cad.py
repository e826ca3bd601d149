"""The solids. The quick ones look at a few parts; the proofs make three whole rigs."""

import json
import os
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cathxr.hardware.layout import Layout

pytest.importorskip("build123d", reason="the extra `cad` is not installed")

from cathxr.hardware.cad import checks, frame
from cathxr.hardware.cad.assembly import Rig3d, rig_3d
from cathxr.hardware.cad.part import Part, Place


@pytest.fixture(scope="module")
def rig(default: Layout) -> Rig3d:
    """The default rig as solids: seconds of work, and so shared."""
    return rig_3d(default)


def test_every_check_passes_for_the_default_rig(rig: Rig3d) -> None:
    """Every solid sound, closed and within the bed; no two in one place; both cameras see balls, ROI and diffuser."""
    assert len(rig.places) > 150
    assert [each for each in checks.all_problems(rig) if not each.is_warning] == []


def test_a_part_that_is_too_large_and_one_that_is_open_are_told(default: Layout) -> None:
    small = Layout(
        replace(default.parameters, printer=replace(default.parameters.printer, bed_mm=(150.0, 150.0, 150.0)))
    )
    beam = Part("beam", "Beam", "printed", frame.beam(default), (0, 0, 0))
    mesh = checks.mesh_of(beam.solid)
    assert "the bed has" in next(iter(checks.part_problems(beam, small, {"beam": mesh}))).sentence
    torn = replace(mesh, faces=mesh.faces[1:])
    assert "not closed" in next(iter(checks.part_problems(beam, default, {"beam": torn}))).sentence


def test_parts_do_not_meet_until_one_is_moved(rig: Rig3d) -> None:
    places = [each for each in rig.places if each.part.key.startswith(("beam", "corner"))]
    assert len(places) == 20
    near = [each for each in places if np.linalg.norm(each.origin - places[0].origin) < 1.8 * rig.layout.inner_mm]
    moved = Place(places[0].part, places[0].origin + np.array([3.0, 0.0, 0.0]), places[0].columns)
    assert checks.interferences([moved, *near[1:]])


@pytest.mark.proof
def test_every_check_passes_for_three_rigs(good: Layout) -> None:
    rig = rig_3d(good)
    assert len(rig.places) > 100
    problems = checks.all_problems(rig)
    assert [each for each in problems if not each.is_warning] == []


@pytest.mark.proof
def test_the_export_is_whole_and_takes_under_a_minute_on_two_cores(tmp_path: Path) -> None:
    out = tmp_path / "rig"
    before = os.times()
    command = [sys.executable, "-m", "cathxr", "hardware", "export", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    after = os.times()
    # Processor time, which other work on the machine does not change; the export uses one core.
    taken_s = after.children_user + after.children_system - before.children_user - before.children_system
    assert taken_s < 60.0
    assert {"rig.toml", "phantom.toml", "params.toml", "bill.csv", "bill.md", "assembly.step", "assembly.glb"} <= {
        each.name for each in out.iterdir()
    }
    printed = {each.stem for each in (out / "print").glob("*.stl")}
    assert printed == {each.stem for each in (out / "print").glob("*.3mf")}
    assert printed <= {each.stem for each in (out / "step").glob("*.step")}
    data = (out / "assembly.glb").read_bytes()
    assert struct.unpack("<4sII", data[:12])[2] == len(data)
    document = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    assert len(document["nodes"]) > 100
    assert [each.name for each in tmp_path.iterdir()] == ["rig"]
