"""`cathxr calibrate intrinsics --live` as a real process on the twin: somebody moves a board, a client accepts."""

import signal
import sys
import time
import urllib.request
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from cathxr.app.calibrate_intrinsics_live import twin_lens
from cathxr.storage.rig_file import example_rig, read_rig, rig_to_text, write_rig

Start = Callable[..., Any]
BOARD = "charuco:10x10:6.0:4.0:DICT_4X4_50"
SEED = 1
VIEWS = 9


@pytest.fixture
def rig_path(tmp_path: Path) -> Path:
    write_rig(tmp_path / "rig.toml", example_rig())
    return tmp_path / "rig.toml"


def live(rig_path: Path, *more: str) -> list[str]:
    options = ["--rig", str(rig_path), "--camera", "top", "--board", BOARD, "--live", "--source", "twin"]
    return ["intrinsics", *options, "--seed", str(SEED), *more]


def test_a_lens_is_measured_live_and_written(start_calibration: Start, rig_path: Path) -> None:
    before = read_rig(rig_path)
    page = start_calibration(*live(rig_path))
    state = page.until(lambda each: len(each["corners_px"]) > 40)
    assert (state["type"], state["camera"], state["size_px"]) == ("calibrate_intrinsics", "top", [1280, 720])
    page.until(lambda each: each["kept"] == 3)
    assert page.ask("calibration_discard", view="top_02")["result"] == {}
    assert [each["name"] for each in page.until(lambda each: each["kept"] == 2)["views"]] == ["top_01", "top_03"]
    page.until(lambda each: each["kept"] >= VIEWS or each["stage"] != "collecting")
    if page.states[-1]["stage"] == "collecting":
        page.ask("calibration_finish")
    state = page.until(lambda each: each["stage"] in ("done", "failed"))
    assert state["stage"] == "done", state["advice"]
    assert rig_to_text(read_rig(rig_path)) == rig_to_text(before)  # nothing is written before it is accepted
    for each in state["pictures"]:
        drawn = urllib.request.urlopen(page.url + each["path"], timeout=20).read()
        assert cv2.imdecode(np.frombuffer(drawn, np.uint8), cv2.IMREAD_COLOR).shape[1] > 300
    assert page.ask("calibration_accept")["result"]["saved"]
    assert page.ended()["saved"]
    said = page.finish()
    assert page.process.returncode == 0, said

    after = read_rig(rig_path)
    found, true = after.cameras["top"].intrinsics, twin_lens(before, "top", SEED)
    std = found.provenance.std
    # Seven values with honest standard deviations: one in a million exceeds five of them. 0.1 px: a floor for what the
    # board's trembling adds that a view's own noise does not tell.
    assert (np.abs(found.focal_px - true.focal_px) < 5.0 * std["focal_px"] + 0.1).all()
    assert (np.abs(found.centre_px - true.centre_px) < 5.0 * std["centre_px"] + 0.1).all()
    assert (np.abs(true.focal_px - before.cameras["top"].intrinsics.focal_px) > 5.0).all()  # else nothing is proved
    kept = replace(after.cameras["top"], intrinsics=before.cameras["top"].intrinsics)
    assert rig_to_text(replace(after, cameras={**after.cameras, "top": kept})) == rig_to_text(before)
    assert read_rig(rig_path.with_name("rig.toml.bak")).cameras["top"].intrinsics.provenance.n is None
    report = rig_path.with_name("rig_calibration")
    assert {each.name for each in report.iterdir()} == {
        "intrinsics_top_coverage.png",
        "intrinsics_top_residuals.png",
        "intrinsics_top_pictures",
    }
    pictures = sorted((report / "intrinsics_top_pictures").iterdir())
    assert len(pictures) == found.provenance.n
    assert cv2.imread(str(pictures[0])).shape == (720, 1280, 3)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for another process")
def test_ctrl_c_leaves_the_rig_untouched(start_calibration: Start, rig_path: Path) -> None:
    before = rig_path.read_bytes()
    page = start_calibration(*live(rig_path))
    page.until(lambda each: each["kept"] >= 1)
    page.process.send_signal(signal.SIGINT)
    begun_s = time.monotonic()
    said = page.finish()
    # the promise is three seconds; a machine shared with other work gets four times that
    assert time.monotonic() - begun_s < 12.0
    assert page.process.returncode == 130
    assert "nothing half-written is left" in said
    assert "Traceback" not in said
    assert rig_path.read_bytes() == before
    assert [each.name for each in rig_path.parent.iterdir()] == ["rig.toml"]


@pytest.mark.parametrize(
    ("source", "sentence"),
    [("cameras", "does not say which device the top camera is"), ("nowhere.mp4", "There is no source 'nowhere.mp4'")],
)
def test_a_source_that_is_not_there_is_said(rig_path: Path, source: str, sentence: str) -> None:
    from cathxr.app.calibrate_intrinsics_live import LiveIntrinsics, calibrate_intrinsics_live
    from cathxr.calibration.board import parse_board
    from cathxr.core import ConfigError

    with pytest.raises(ConfigError, match=sentence):
        calibrate_intrinsics_live(
            rig_path,
            "top",
            parse_board(BOARD),
            choice=LiveIntrinsics(source),
            report=rig_path.parent / "report",
            dry_run=False,
        )
