"""`cathxr track` on recordings of a path tracer, whose optics, light and materials are not the twin's.

`make prove` renders them all and writes docs/proof-rendered.md.
"""

import platform
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from cathxr.app.track_command import track

from ..rendered_support.report import folder_of, write_report
from ..rendered_support.score import Score, scored
from ..rendered_support.worlds import WORLDS, Light, Optics, World

PAIRS = 30
_SMALL = World(
    "small",
    "black; 640x480, dark walls, sharpened, JPEG",
    material="black",
    optics=Optics(size_px=(640, 480), focal=0.85, off=0.015, sharpen=0.4, jpeg=85),
    light=Light(fall=0.6, wall=0.15),
)
_NO_WHEELS = sys.platform == "linux" and platform.machine() != "x86_64"
pytestmark = pytest.mark.skipif(_NO_WHEELS, reason="Mitsuba 3 has no wheels for this processor")


def tracked(world: World, folder: Path, *, pairs: int) -> Score:
    """Render a recording, track it by the command, and compare."""
    from ..rendered_support.recording import render  # takes a second, and its packages may be absent

    for seq in render(world, folder, pairs=pairs):
        print(f"{world.name}: pair {seq + 1} of {pairs}", flush=True)
    table = folder / "track.csv"
    arguments = ["--rig", "rig.toml", "--top", "top", "--front", "front", "--times", "times.csv", "--out", table.name]
    if world.empty:
        arguments += ["--background-top", "empty_top.png", "--background-front", "empty_front.png"]
    told = CliRunner().invoke(
        track, [each if each.startswith("--") else str(folder / each) for each in arguments], catch_exceptions=False
    )
    assert told.exit_code == 0, told.output
    return scored(folder, table)


def test_a_catheter_of_another_renderer_is_found(tmp_path: Path) -> None:
    score = tracked(_SMALL, tmp_path, pairs=8)
    assert score.tracked == 1.0, score.reasons
    assert score.tip_mm.mean() < 0.25
    assert score.shape_mm.mean() < 0.15
    # The truth is not of the twin: a picture that does not move would be a mistake of the renderer.
    first, last = (cv2.imread(str(tmp_path / "top" / f"{seq:05d}.png")).astype(int) for seq in (0, 7))
    assert np.abs(first - last).max() > 100


def test_no_recording_is_another_one_again() -> None:
    assert len({each.name for each in WORLDS}) == len(WORLDS)
    assert len({replace(each, name="", what="") for each in WORLDS}) == len(WORLDS)


@pytest.mark.proof
def test_all_recordings_of_another_renderer(tmp_path: Path, repo_root: Path) -> None:
    scores = [(world, tracked(world, folder_of(tmp_path, world), pairs=PAIRS)) for world in WORLDS]
    write_report(repo_root / "docs", tmp_path, scores, pairs=PAIRS)
    for world, score in scores:
        assert score.wrong == 0, world.name
        assert score.tracked >= world.tracked, (world.name, score.reasons)
        assert score.tip_mm.mean() <= world.tip_mm, world.name
