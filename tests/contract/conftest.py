"""What every driver in the contract tests gets: a small rig, a clock moved by hand, a video, a session."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from cathxr.core import Detection, Intrinsics, Observation, Rig, Status, Track
from cathxr.devices.clock import ManualClock
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionReader, SessionWriter

SCALE = 0.25
VIDEO_PICTURES = 12


@pytest.fixture(scope="session")
def small_rig() -> Rig:
    """The example rig with pictures of a quarter of the size, for speed."""
    rig = example_rig()
    cameras = {}
    for name, camera in rig.cameras.items():
        lens = camera.intrinsics
        small = Intrinsics(lens.focal_px * SCALE, lens.centre_px * SCALE, lens.distortion)
        size = (round(camera.size_px[0] * SCALE), round(camera.size_px[1] * SCALE))
        cameras[name] = replace(camera, size_px=size, intrinsics=small)
    return replace(rig, cameras=cameras)


@pytest.fixture
def clock() -> ManualClock:
    """A clock that stands where nothing has happened yet, but not at zero."""
    return ManualClock(5_000_000_000)


@pytest.fixture(scope="session")
def video(small_rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video of a few pictures of the rig's size, 25 a second."""
    path = tmp_path_factory.mktemp("video") / "top.avi"
    width, height = small_rig.cameras["top"].size_px
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (width, height))
    for number in range(VIDEO_PICTURES):
        writer.write(np.full((height, width, 3), 20 * number, np.uint8))
    writer.release()
    return path


@pytest.fixture(scope="session")
def session(small_rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> SessionReader:
    """A session of a few pairs."""
    folder = tmp_path_factory.mktemp("sessions") / "one"
    writer = SessionWriter(folder, rig=small_rig, config={}, clock_pair=(1, "2025-05-08T10:00:00Z"), videos=False)
    for seq in range(VIDEO_PICTURES):
        t_ns = 10**12 + seq * 40_000_000
        missing = tuple(Detection(name, seq, t_ns, reason="no catheter") for name in ("top", "front"))
        writer.write_observation(Observation(seq, t_ns, missing))
        writer.write_track(Track(seq, t_ns, Status.LOST, reason="no catheter"))
    writer.close()
    return SessionReader(folder)
