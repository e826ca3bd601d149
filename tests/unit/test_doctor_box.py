import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from cathxr.app.cli import main
from cathxr.calibration.picture_checks import MOST_BLUR_PX, blur_px, light_and_focus
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig


def _edge(sigma_px: float) -> np.ndarray:
    fine = np.zeros((320, 480))
    cv2.fillPoly(fine, [np.array([[130, 60], [380, 100], [340, 260], [100, 240]])], 200.0)
    return np.asarray(cv2.GaussianBlur(fine, (0, 0), sigma_px)) if sigma_px > 0 else fine


@pytest.mark.parametrize("sigma_px", [0.8, 1.2, 2.0, 3.0])
def test_blur_is_found_from_edges(sigma_px: float) -> None:
    # The method's own error on slanted edges, as its paper has it: some per cent, and pixels of finite size.
    assert blur_px(20.0 + _edge(sigma_px)) == pytest.approx(sigma_px, rel=0.12, abs=0.12)


def test_a_picture_without_edges_tells_no_focus() -> None:
    assert blur_px(np.full((100, 100), 128.0)) is None


def _lit(level: float, *, fall: float = 0.0) -> np.ndarray:
    ramp = np.linspace(1.0, 1.0 - fall, 1280)
    return np.clip(np.tile(255.0 * level * ramp, (720, 1)), 0, 255).astype(np.uint8)


def test_light_is_measured_in_the_roi() -> None:
    rig = example_rig()
    camera = rig.cameras["top"]
    even = light_and_focus(_lit(0.8), camera, rig.roi)
    assert even.level == pytest.approx(0.8, abs=0.005)
    assert even.evenness == pytest.approx(1.0, abs=0.01)
    assert even.saturated == 0.0
    fallen = light_and_focus(_lit(0.8, fall=0.9), camera, rig.roi)
    columns = CameraModel.of(camera).project(rig.roi.corners_mm)[:, 0]
    left, right = (1.0 - 0.9 * each / 1279.0 for each in (columns.min(), columns.max()))
    # The 5th and the 95th percentile of a ramp lie a twentieth of it inside its ends.
    expected = (right + 0.05 * (left - right)) / (left - 0.05 * (left - right))
    assert fallen.evenness == pytest.approx(expected, abs=0.02)
    assert light_and_focus(_lit(1.2), camera, rig.roi).saturated > 0.99


def test_the_twins_box_passes_and_a_dark_picture_does_not(tmp_path) -> None:
    shown = CliRunner().invoke(main, ["doctor", "box", "--source", "twin"])
    assert shown.exit_code == 0, shown.output
    assert shown.output.count("good") == 6
    cv2.imwrite(str(tmp_path / "dark.png"), np.full((720, 1280, 3), 40, dtype=np.uint8))
    dark = CliRunner().invoke(main, ["doctor", "box", "--source", "twin", "--top", str(tmp_path / "dark.png")])
    assert dark.exit_code == 1
    assert "back light on" in " ".join(dark.output.split())


def test_the_twins_fiducials_are_all_seen() -> None:
    shown = CliRunner().invoke(main, ["doctor", "box", "--source", "twin", "--crosses"])
    assert shown.exit_code == 0, shown.output
    assert shown.output.count("8 of 8") == 2


def test_a_rig_is_asked_for() -> None:
    shown = CliRunner().invoke(main, ["doctor", "box"])
    assert shown.exit_code == 1
    assert "Give the rig" in shown.output
    assert MOST_BLUR_PX > 0.7
