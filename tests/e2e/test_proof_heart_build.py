"""From 512x512x300 DICOM slices to a heart folder: time, memory, fidelity. `make prove` writes the table."""

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cathxr.heart import read_heart
from cathxr.heart.volume import LabelVolume
from tests.heart_support.dicom_series import write_series
from tests.heart_support.phantoms import four_chambers

# The largest that the issue asks for; a heart fills most of such a field of view.
SHAPE, SPACING_MM = (300, 512, 512), (0.45, 0.45, 0.5)
MOST_GB = 6.0
MOST_S = 90.0
CHAMBERS = ("left_ventricle", "right_ventricle", "left_atrium", "right_atrium")

# Runs as a process of its own, as the command does: what it takes is then nobody else's. The stages are those that
# a person sees. With threads, a stage that is told of while another goes on shares its time with that one.
MEASURED = """
import json, resource, sys, time
begun = time.perf_counter()
from pathlib import Path
from cathxr.app.heart_build_run import BuildChoice, built
stages = []
def told(what, share):
    now = (time.perf_counter() - begun, time.process_time())
    if not stages or stages[-1][0] != what:
        stages.append((what, *now))
heart, findings = built(BuildChoice(Path(sys.argv[1]), Path(sys.argv[2])), told)
stages.append(("", time.perf_counter() - begun, time.process_time()))
largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform != "darwin" else 1e9)
print(json.dumps({"stages": stages, "gb": largest, "findings": findings}))
"""
PARTS = (
    ("reading", ("Looking at", "Reading")),
    ("finding valves and mouths", ("Looking for valves",)),
    ("surfaces", ("Smoothing the structures'", "Making the surface", "Simplifying", "Finishing", "The surfaces")),
    ("files, acoustic volume, quality page", ("Writing", "Acoustic", "Checking how", "Drawing", "The heart is")),
)
"""The rest, between reading and finding valves, is the segmentation."""


@dataclass(frozen=True)
class Run:
    """What one build took: seconds of wall clock and of all cores' processor time, the largest memory."""

    wall_s: float
    cpu_s: float
    gb: float
    parts: Mapping[str, tuple[float, float]]
    findings: tuple[str, ...]


def measured(series: Path, out: Path) -> Run:
    """Build a heart in a process of its own and return what that took."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, str(series), str(out)],
        capture_output=True, text=True, timeout=3600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    parts: dict[str, tuple[float, float]] = {}
    first = told["stages"][0]
    parts["starting Python"] = (first[1], first[2])
    for (what, wall, cpu), (_, later, later_cpu) in zip(told["stages"], told["stages"][1:], strict=False):
        name = next((name for name, begins in PARTS if what.startswith(begins)), "segmentation")
        spent = parts.get(name, (0.0, 0.0))
        parts[name] = (spent[0] + later - wall, spent[1] + later_cpu - cpu)
    last = told["stages"][-1]
    return Run(last[1], last[2], told["gb"], parts, tuple(told["findings"]))


def failed_checks(folder: Path) -> list[str]:
    """Return what the quality page says is not met."""
    page = (folder / "quality.html").read_text(encoding="utf-8")
    return [row for row in page.split("<tr>") if "✕ not met" in row]


def test_a_small_series_in_parts(tmp_path: Path) -> None:
    pytest.importorskip("resource", reason="memory is measured with it")
    volume, _ = four_chambers((96, 112, 112), (1.5, 1.5, 1.6))
    write_series(tmp_path / "series", volume)
    run = measured(tmp_path / "series", tmp_path / "heart")
    assert set(run.parts) == {"starting Python", "segmentation", *(name for name, _ in PARTS)}
    assert sum(wall for wall, _ in run.parts.values()) == pytest.approx(run.wall_s)
    # In voxels this coarse the aorta's mouth is 1.57 mm off where 1.5 mm are asked for; the page rightly says so.
    assert not [each for each in failed_checks(tmp_path / "heart") if "Neighbours fit" not in each]
    assert set(CHAMBERS) <= set(read_heart(tmp_path / "heart").structures)


@pytest.mark.proof
def test_512x512x300(repo_root: Path, tmp_path: Path) -> None:
    pytest.importorskip("resource", reason="memory is measured with it")
    volume, truth = four_chambers(SHAPE, SPACING_MM)
    write_series(tmp_path / "series", volume)
    del volume
    # Once for the compiled kernels, which the first run ever on a machine makes and keeps.
    small, _ = four_chambers((96, 112, 112), (1.5, 1.5, 1.6))
    write_series(tmp_path / "small", small)
    measured(tmp_path / "small", tmp_path / "small_heart")
    run = measured(tmp_path / "series", tmp_path / "heart")
    _write(repo_root / "docs" / "proof-heart-build.md", run, truth, tmp_path / "heart")
    assert not failed_checks(tmp_path / "heart")
    # Memory does not depend on what else runs; time does, and is told, not judged.
    assert run.gb < MOST_GB


def _write(path: Path, run: Run, truth: LabelVolume, folder: Path) -> None:
    parts = [f"| {name} | {wall:.1f} | {cpu:.1f} |" for name, (wall, cpu) in run.parts.items()]
    found = read_heart(folder).structures
    chambers = []
    for key in CHAMBERS:
        share = (found[key].volume_ml or 0.0) / truth.volume_ml(key) - 1.0
        chambers.append(f"| {found[key].name} | {truth.volume_ml(key):.1f} | {found[key].volume_ml} | {share:+.1%} |")
    shape, spacing = (" x ".join(f"{each:g}" for each in many) for many in (SHAPE[::-1], SPACING_MM))
    text = "\n".join(
        [
            "# From DICOM to a heart",
            "",
            "Made by `make prove` (tests/e2e/test_proof_heart_build.py): a synthetic DICOM series of a chest with four",
            f"chambers, {shape} voxels of {spacing} mm, in a process of its own from its start to the finished folder,",
            "kernels compiled before. The wall clock is that of the machine that made this page, which may have been",
            "shared; the processor time, of all cores together, depends less on that. The budget is",
            f"{MOST_S:g} s on two cores and {MOST_GB:g} GB.",
            "",
            "| part | wall clock, s | processor time, s |",
            "|---|---|---|",
            *parts,
            f"| **all** | **{run.wall_s:.1f}** | **{run.cpu_s:.1f}** |",
            "",
            f"Largest memory: {run.gb:.2f} GB. Checks not met on the quality page: {len(failed_checks(folder))}.",
            "",
            "| chamber | truth, mL | found, mL | difference |",
            "|---|---|---|---|",
            *chambers,
            "",
        ]
    )
    path.write_text(text, encoding="utf-8", newline="\n")
