"""`cathxr calibrate markers --click` as a real process: fiducials that were not found are placed over the link."""

import signal
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from cathxr.core import FloatArray, Rig
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig, read_rig, write_rig
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig

Start = Callable[..., Any]
SEED = 2
HIDDEN = "mT2"


@pytest.fixture
def arguments(tmp_path: Path) -> list[str]:
    """A rig whose poses are the drawing's, and a picture of each camera with its own cross; the top's lacks HIDDEN."""
    rig = example_rig()
    true = true_rig(rig, SEED)
    write_rig(tmp_path / "rig.toml", rig)
    for camera in ("top", "front"):
        world = TwinWorld(true, seed=SEED, settings=scene(f"pillar_{camera}"))
        pixels = CameraRenderer(world, camera).picture(1_000_000_000)
        if camera == "top":
            x, y = np.rint(hidden_px(true)).astype(int)
            pixels[y - 45 : y + 46, x - 45 : x + 46] = np.median(pixels, axis=(0, 1))
        cv2.imwrite(str(tmp_path / f"{camera}.png"), pixels)
    names = [f"--{camera}={tmp_path / camera}.png" for camera in ("top", "front")]
    return ["markers", "--rig", str(tmp_path / "rig.toml"), *names, "--click"]


def hidden_px(rig: Rig) -> FloatArray:
    marker = next(each for each in rig.markers["top"] if each.name == HIDDEN)
    return CameraModel.of(rig.cameras["top"]).project(marker.position_mm)


def test_a_hidden_fiducial_is_placed_and_the_poses_are_written(
    start_calibration: Start, arguments: list[str], tmp_path: Path
) -> None:
    page = start_calibration(*arguments)
    state = page.until(lambda each: each["stage"] == "collecting")
    assert not state["can_save"]
    assert "top picture" in state["advice"]
    origins = {(each["camera"], each["name"]): each["origin"] for each in state["markers"]}
    assert origins["top", HIDDEN] == "missing"
    assert [origins["front", f"mF{i}"] for i in (1, 2, 3, 4)] == ["found"] * 4
    data = urllib.request.urlopen(f"{page.url}/cameras/top.jpg", timeout=20).read()
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape == (720, 1280, 3)
    assert page.ask("calibration_accept")["type"] == "refusal"

    true = true_rig(example_rig(), SEED)
    model = CameraModel.of(true.cameras["top"])
    for marker in true.markers["top"]:
        pixel = model.project(marker.position_mm)
        if marker.name == HIDDEN:
            page.ask("calibration_place", camera="top", marker=HIDDEN, pixel=pixel.tolist(), exact=True)
        elif origins["top", marker.name] == "missing":
            # A click somewhere on a fiducial means its middle.
            answer = page.ask(
                "calibration_place", camera="top", marker=marker.name, pixel=(pixel + np.array([4.0, -3.0])).tolist()
            )
            assert np.linalg.norm(np.array(answer["result"]["pixel"]) - pixel) < 1.0
    state = page.until(lambda each: each["can_save"] and each["pictures"])
    drawn = urllib.request.urlopen(page.url + state["pictures"][0]["path"] + "?v=1", timeout=20)
    assert drawn.read().startswith(b"\x89PNG")
    result = page.ask("calibration_accept")["result"]
    assert result["saved"]
    said = page.finish()
    assert page.process.returncode == 0, said
    written = read_rig(tmp_path / "rig.toml")
    for name, camera in written.cameras.items():
        centre = camera.camera_from_box.inverse().translation_mm
        expected = true.cameras[name].camera_from_box.inverse().translation_mm
        # 0.1 px on each of four fiducials 120 mm apart, at 330 mm: 0.1 mm along the axis, and five times that to spare
        assert np.linalg.norm(centre - expected) < 0.5
        assert camera.pose_provenance.covariance is not None
    assert read_rig(tmp_path / "rig.toml.bak").cameras["top"].pose_provenance.covariance is None
    report = {each.name for each in (tmp_path / "rig_calibration").iterdir()}
    assert report == {"markers_top.png", "markers_front.png", "markers_residuals.png", "expected_error.png"}
    assert {str(each) for each in result["paths"]} == {
        str(tmp_path / "rig.toml"),
        *(str(tmp_path / "rig_calibration" / name) for name in report),
    }


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for another process")
def test_ctrl_c_leaves_the_rig_untouched(start_calibration: Start, arguments: list[str], tmp_path: Path) -> None:
    before = (tmp_path / "rig.toml").read_bytes()
    page = start_calibration(*arguments)
    page.until(lambda each: each["stage"] == "collecting")
    page.process.send_signal(signal.SIGINT)
    said = page.finish()
    assert page.process.returncode == 130
    assert "nothing half-written is left" in said
    assert "Traceback" not in said
    assert (tmp_path / "rig.toml").read_bytes() == before
    assert {each.name for each in tmp_path.iterdir()} == {"rig.toml", "top.png", "front.png"}
