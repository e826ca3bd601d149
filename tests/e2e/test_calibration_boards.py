"""Lenses of real cameras, from photographs that nobody here made, by the command, against published results."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from cathxr.storage.rig_file import example_rig, read_rig, write_rig


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """A rig of two cameras with 640x480 pictures, not calibrated."""
    nominal = example_rig()
    cameras = {name: replace(each, size_px=(640, 480)) for name, each in nominal.cameras.items()}
    path = tmp_path / "rig.toml"
    write_rig(path, replace(nominal, cameras=cameras))
    return path


def calibrate(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run `cathxr calibrate intrinsics`."""
    command = [sys.executable, "-m", "cathxr", "calibrate", "intrinsics", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def test_the_chessboards_give_the_reference_lens(shared_data: Path, rig: Path) -> None:
    pictures = sorted((shared_data / "chessboards").glob("left*.jpg"))
    done = calibrate("--rig", rig, "--camera", "top", "--board", "chessboard:9x6:25.0", *pictures)
    assert done.returncode == 0, done.stdout + done.stderr
    stored = cv2.FileStorage(str(shared_data / "chessboards" / "left_intrinsics.yml"), cv2.FILE_STORAGE_READ)
    reference, rms_px = stored.getNode("camera_matrix").mat(), stored.getNode("avg_reprojection_error").real()
    stored.release()
    lens = read_rig(rig).cameras["top"].intrinsics
    # The reference holds fx = fy, this does not; both take the corners of cornerSubPix and let all views count alike.
    assert abs(lens.focal_px - reference[0, 0]).max() < 1.0
    assert abs(lens.centre_px - reference[:2, 2]).max() < 1.0
    assert lens.provenance.rms_px is not None
    assert abs(lens.provenance.rms_px - rms_px) < 0.05
    assert (rig.parent / "rig_calibration" / "intrinsics_top_coverage.png").is_file()
    assert (rig.parent / "rig.toml.bak").is_file()
    # The reference's own list shows one view at 1.18 px: its window met other corners. Where edges cross, it is as
    # good as the others, and the command says so.
    assert "--corners edges" in done.stdout
    done = calibrate("--rig", rig, "--camera", "top", "--board", "chessboard:9x6:25.0", "--corners", "edges", *pictures)
    assert done.returncode == 0, done.stdout + done.stderr
    better = read_rig(rig).cameras["top"].intrinsics
    assert better.provenance.rms_px is not None
    assert better.provenance.rms_px < 0.5 * rms_px
    # 2.5 px apart: within two standard deviations of the cruder result, which are 1.7 px.
    assert abs(better.focal_px - lens.focal_px).max() < 2.0 * lens.provenance.std["focal_px"].max()


@pytest.mark.parametrize("camera", ["cam0", "cam1"])
def test_the_charuco_photographs_give_the_published_lens(shared_data: Path, rig: Path, camera: str) -> None:
    folder = shared_data / "biplane_catheter" / "calib_2025-05-08_640x480"
    board = "charuco:10x10:6.0:4.0:DICT_4X4_50"
    done = calibrate("--rig", rig, "--camera", "front", "--board", board, folder / f"charuco_{camera}")
    assert done.returncode == 0, done.stdout + done.stderr
    text = (folder / "published_calibration.json").read_text(encoding="utf-8")
    published = json.loads(text)[camera]["intrinsics"]["K"]
    lens = read_rig(rig).cameras["front"].intrinsics
    assert abs(lens.focal_px[0] / published[0][0] - 1.0) < 0.02
    assert lens.provenance.rms_px is not None
    assert lens.provenance.rms_px <= 0.3


@pytest.mark.parametrize(
    ("board", "name", "sentence"),
    [
        ("charuco:10x10:6.0:4.0:DICT_4X4_50", "no_such_folder", "no such file or folder"),
        ("chessboard:9x6:25.0", "words.png", "words.png"),
        ("circles:9x6:25.0", "grey.png", "write it as"),
        ("chessboard:9x6:25.0", "small.png", "320x240"),
        ("chessboard:9x6:25.0", "grey.png", "Too few views"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_the_rig(rig: Path, board: str, name: str, sentence: str) -> None:
    (rig.parent / "words.png").write_text("no picture", encoding="utf-8")
    cv2.imwrite(str(rig.parent / "grey.png"), np.full((480, 640), 90, np.uint8))
    cv2.imwrite(str(rig.parent / "small.png"), np.full((240, 320), 90, np.uint8))
    before = rig.read_bytes()
    done = calibrate("--rig", rig, "--camera", "top", "--board", board, rig.parent / name)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert done.stderr.startswith("Error: ")
    assert "Traceback" not in done.stderr
    assert rig.read_bytes() == before
    assert not list(rig.parent.glob("rig.toml.bak*"))
