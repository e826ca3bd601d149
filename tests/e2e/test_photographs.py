"""Photographs of real catheters that nobody here made: everything by the commands of docs/photographs.md."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cathxr.core import Status
from cathxr.storage.track_csv import read_track_csv

SETS = {
    # folder, calibration, cameras, size, entry, along, diameter
    "2025-05-12": (
        "poses_2025-05-12_640x480",
        "calib_2025-05-08_640x480",
        ("cam0", "cam1"),
        ["640", "480"],
        ["310.7", "140", "287", "200"],
        ["312", "214.6", "286.8", "260"],
        "2.9",
    ),
    "2025-06-03": (
        "poses_2025-06-03_640x480",
        "calib_2025-05-08_640x480",
        ("cam0", "cam1"),
        ["640", "480"],
        ["315", "119.6", "284.4", "185.6"],
        ["313.4", "203.4", "282.2", "252.2"],
        "2.9",
    ),
    "three cameras": (
        "three_cameras_2025-08_1280x720/poses_2025-08-13_3cam_straight_1280x720",
        "three_cameras_2025-08_1280x720/calib_2025-08-14_world_update",
        ("cam1", "cam2"),
        ["1280", "720"],
        ["607.5", "240.5", "622.4", "327.5"],
        ["607", "474.6", "621.5", "533"],
        "2.6",
    ),
}
SEEN_BY_CAM0 = ["606.3", "399.7"]  # marked by hand in a picture that the reconstruction does not use
THIRD_CAMERA_PX = 3.0  # the tracking issue's target for this pose; measured 1.05 (docs/photographs.md)
NOT_RESOLVED = {"2025-05-12": [3]}  # its sigma is 0.6 mm: said, not called tracked
MIDLINE_PX = 0.8  # measured at most 0.45; the published calibration leaves 1 to 2 px between the views


def run(*command: str) -> str:
    """Return what a command prints."""
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(params=list(SETS))
def tracked(
    request: pytest.FixtureRequest, shared_data: Path, repo_root: Path, tmp_path: Path
) -> tuple[str, Path, Path]:
    """The name of a set, the folder with its rig, pictures and track, and its published calibration."""
    name = str(request.param)
    folder, calibration, cameras, size, entry, along, diameter = SETS[name]
    data = shared_data / "biplane_catheter"
    published = data / calibration / "published_calibration.json"
    rig = tmp_path / "rig.toml"
    run(
        str(repo_root / "examples" / "biplane_rig.py"), str(published), str(rig), "--top", cameras[0], "--front",
        cameras[1], "--size", *size, "--entry", *entry, "--along", *along, "--diameter", diameter,
    )  # fmt: skip
    for view, camera in zip(("top", "front"), cameras, strict=True):
        (tmp_path / view).mkdir()
        for picture in (data / folder).glob(f"{camera}_*.png"):
            other = cameras[1] if camera == cameras[0] else cameras[0]
            if (picture.parent / picture.name.replace(camera, other)).exists():
                shutil.copy(picture, tmp_path / view / picture.name.removeprefix(f"{camera}_"))
    run(
        "-m", "cathxr", "track", f"--rig={rig}", f"--top={tmp_path / 'top'}", f"--front={tmp_path / 'front'}",
        f"--out={tmp_path / 'track.csv'}",
    )  # fmt: skip
    return name, tmp_path, published


def test_every_pose_is_tracked_and_lies_on_its_pictures(tracked: tuple[str, Path, Path], repo_root: Path) -> None:
    name, folder, published = tracked
    rows = read_track_csv(folder / "track.csv")
    assert rows
    assert [row.seq for row in rows if row.status is not Status.TRACKED] == NOT_RESOLVED.get(name, [])
    assert {row.reason for row in rows} <= {
        "",
        "the tip is not resolved in both views",
        "too little of the catheter is seen",
    }
    said = run(
        str(repo_root / "examples" / "reprojection.py"),
        str(folder / "rig.toml"),
        str(folder / "top"),
        str(folder / "front"),
    )
    midlines = [float(each) for each in re.findall(r"midline ([\d.]+) px", said)]
    assert len(midlines) == 2 * (len(rows) - len(NOT_RESOLVED.get(name, [])))
    assert max(midlines) < MIDLINE_PX
    if name == "three cameras":
        said = run(
            str(repo_root / "examples" / "third_camera.py"), str(published), str(folder / "rig.toml"), "--top", "cam1",
            "--third", "cam0", "--track", str(folder / "track.csv"), "--seen", *SEEN_BY_CAM0,
        )  # fmt: skip
        found = re.search(r"([\d.]+) px apart", said)
        assert found is not None
        assert float(found.group(1)) < THIRD_CAMERA_PX
