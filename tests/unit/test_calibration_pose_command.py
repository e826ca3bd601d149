"""`cathxr calibrate markers`: pictures in, poses into the rig, and a rig untouched where anything is wrong."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from cathxr.app import calibrate_markers_click
from cathxr.app.calibrate_markers import markers
from cathxr.storage.rig_file import example_rig, read_rig, write_rig
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig

SEED = 3


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with top.png and front.png of the twin, both crosses in, and pictures that will not do."""
    folder = tmp_path_factory.mktemp("pictures")
    world = TwinWorld(true_rig(example_rig(), SEED), seed=SEED, settings=scene("pillars"), start_ns=0)
    for name in ("top", "front"):
        cv2.imwrite(str(folder / f"{name}.png"), CameraRenderer(world, name).picture(0))
    top = cv2.imread(str(folder / "top.png"))
    cv2.imwrite(str(folder / "small.png"), top[::2, ::2])
    cv2.imwrite(str(folder / "grey.png"), cv2.cvtColor(top, cv2.COLOR_BGR2GRAY))
    cv2.imwrite(str(folder / "black.png"), np.zeros_like(top))
    top[:, 640:] = 60
    top[:360] = 60
    cv2.imwrite(str(folder / "covered.png"), top)
    (folder / "damaged.png").write_bytes((folder / "top.png").read_bytes()[:2000])
    return folder


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    write_rig(path, example_rig())
    return path


def run(rig: Path, *options: str | Path) -> Result:
    return CliRunner().invoke(markers, ["--rig", str(rig), *(str(each) for each in options)])


def test_two_pictures_give_a_rig_with_poses_a_backup_and_a_report(rig: Path, taken: Path) -> None:
    before = rig.read_bytes()
    result = run(rig, "--top", taken / "top.png", "--front", taken / "front.png")
    assert result.exit_code == 0, result.output
    truth = true_rig(example_rig(), SEED)
    measured = read_rig(rig)
    for name, camera in measured.cameras.items():
        off = camera.camera_from_box @ truth.cameras[name].camera_from_box.inverse()
        # 0.02 px of noise and shading at 330 mm: hundredths of a mm, the line of sight's 0.1 included.
        assert np.linalg.norm(off.translation_mm) < 0.2
        assert camera.pose_provenance.n == 8
        assert camera.pose_provenance.covariance is not None
    assert rig.with_name("rig.toml.bak").read_bytes() == before
    report = rig.parent / "rig_calibration"
    names = {"markers_top.png", "markers_front.png", "markers_residuals.png", "expected_error.png"}
    assert {each.name for each in report.iterdir()} == names
    for words in ("mT1", "mF4", "std, mm", "Expected error", "Good", str(rig)):
        assert words in result.output


def test_a_dry_run_reports_and_leaves_the_rig(rig: Path, taken: Path, tmp_path: Path) -> None:
    before = rig.read_bytes()
    result = run(rig, "--top", taken / "top.png", "--report", tmp_path / "shown", "--dry-run")
    assert result.exit_code == 0, result.output
    assert rig.read_bytes() == before
    assert (tmp_path / "shown" / "markers_top.png").exists()
    assert not list(rig.parent.glob("*.bak"))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--top", "small.png"], "1280x720"),
        (["--top", "damaged.png"], "damaged"),
        (["--top", "absent.png"], "cannot read"),
        (["--top", "grey.png"], "no colour"),
        ([], "--top and --front"),
        (["--top", "top.png", "--source", "twin"], "not both"),
        (["--top", "top.png", "--seed", "1"], "--seed"),
        (["--top", "top.png", "--config", "c.toml"], "--config"),
        (["--source", "cameras"], "calibrate cameras"),
        (["--source", "cameras", "--config", "absent.toml"], "absent.toml"),
    ],
)
def test_what_cannot_be_is_told_in_a_sentence(rig: Path, taken: Path, options: Sequence[str], says: str) -> None:
    before = rig.read_bytes()
    result = run(rig, *(taken / each if each.endswith((".png", ".toml")) else each for each in options))
    assert result.exit_code == 1
    # Before it there may be the line that says what is being compiled.
    assert result.output.splitlines()[-1].startswith("Error: ")
    assert says in result.output
    assert rig.read_bytes() == before


@pytest.mark.parametrize("picture", ["covered.png", "black.png"])
def test_missing_fiducials_are_named_and_what_was_found_is_drawn(rig: Path, taken: Path, picture: str) -> None:
    before = rig.read_bytes()
    result = run(rig, "--top", taken / picture, "--front", taken / "front.png")
    assert result.exit_code == 1
    drawn = rig.parent / "rig_calibration" / "markers_top.png"
    assert str(drawn) in result.output
    assert "top" in result.output
    assert cv2.imread(str(drawn)) is not None
    assert rig.read_bytes() == before


def test_a_rig_without_fiducials_is_told(rig: Path, taken: Path) -> None:
    write_rig(rig, replace(example_rig(), markers={}))
    result = run(rig, "--top", taken / "top.png")
    assert result.exit_code == 1
    assert "[markers.top]" in result.output
    assert str(rig) in result.output


def test_exchanged_pictures_are_not_written_without_being_asked_for(rig: Path, taken: Path) -> None:
    # The example's crosses are alike, so that each camera's own cross fits in the other's picture.
    before = rig.read_bytes()
    options = ("--top", taken / "front.png", "--front", taken / "top.png")
    result = run(rig, *options)
    assert result.exit_code == 1
    assert "exchanged" in result.output
    assert "--yes" in result.output
    assert rig.read_bytes() == before
    assert run(rig, *options, "--yes").exit_code == 0
    assert rig.read_bytes() != before


def test_the_twin_can_be_measured_without_files(rig: Path) -> None:
    result = run(rig, "--source", "twin", "--seed", str(SEED))
    assert result.exit_code == 0, result.output
    truth = true_rig(example_rig(), SEED).cameras["top"].camera_from_box
    off = read_rig(rig).cameras["top"].camera_from_box @ truth.inverse()
    assert np.linalg.norm(off.translation_mm) < 0.2


def test_by_hand_hands_everything_to_the_page(rig: Path, taken: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    monkeypatch.setattr(
        calibrate_markers_click, "calibrate_markers_click", lambda *given, **named: calls.append((given, named))
    )
    result = run(rig, "--top", taken / "top.png", "--front", taken / "front.png", "--click", "--dry-run", "--port", "0")
    assert result.exit_code == 0, result.output
    ((path, pictures), named) = calls[0]
    assert path == rig
    assert {name: len(each) for name, each in pictures.items()} == {"top": 1, "front": 1}
    assert named["dry_run"] is True
    assert named["page"].port == 0
