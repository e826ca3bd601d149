"""The live path on the twin, in real time: pictures to Tracks to a session, and the session to the same Tracks."""

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest

from cathxr.app.plugins import make_camera, make_encoder
from cathxr.core import Status, Track
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.live import LiveOptions, LiveSystem
from cathxr.runtime.moment import Moment
from cathxr.runtime.optical import OpticalSource
from cathxr.runtime.recording import session_opener
from cathxr.runtime.replay import ReplayOptions, ReplaySource, replay_tracks
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionReader
from cathxr.tracking import make_tracker
from cathxr.twin.world import TwinWorld
from cathxr.vision import make_detector

LONG_S = 90.0
"""Kernels are compiled on the first run; otherwise only a failing test waits so long."""


def wait_for(condition: object, what: str) -> None:
    end = time.monotonic() + LONG_S
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end, f"never: {what}"
        time.sleep(0.02)


@pytest.mark.parametrize("videos", [False, True])
def test_live_on_the_twin_recorded_and_replayed(tmp_path: Path, videos: bool) -> None:
    clock, rig = MonotonicClock(), example_rig()
    world = TwinWorld(rig, seed=3, start_ns=clock.now_ns())
    driver_options = {"world": world, "rate_hz": 10.0}
    source = OpticalSource(
        rig,
        {name: make_camera("twin", rig, name, clock=clock, options=driver_options) for name in ("top", "front")},
        detectors={name: make_detector("model", rig, name) for name in ("top", "front")},
        tracker=make_tracker("model", rig),
        clock=clock,
        encoder=make_encoder("twin", rig, clock=clock, options={"world": world}),
    )
    live = LiveSystem(
        source,
        clock=clock,
        options=LiveOptions(
            world=world,
            truth=lambda t_ns, seq: world.truth(t_ns, seq=seq),
            open_session=session_opener(tmp_path, rig=rig, config={"seed": 3}, clock=clock, videos=videos),
            record_videos=videos,
        ),
    )
    moments: list[Moment] = []
    truths: dict[int, Track] = {}
    live.moments.add("test", lambda each: moments.append(dataclasses.replace(each, images={})))
    live.truths.add("test", lambda each: truths.update({each.seq: each}))
    source.readings.add("live", live.take_reading)
    with live:
        wait_for(lambda: sum(each.track.status is Status.TRACKED for each in moments) >= 5, "tracked")
        live.handle("record_start", {"name": "twin"})
        count = len(moments)
        wait_for(lambda: len(moments) >= count + 10, "ten more pairs")
        live.handle("steer", {"insertion_mm": 60.0})
        wait_for(lambda: len(moments) >= count + 20, "ten more")
        summary = live.handle("record_stop", {})
        assert live.wait_written(LONG_S)
        started = time.monotonic()
    assert time.monotonic() - started < 10.0  # a hang would be far more; the stop itself is bounded by 2 s
    good = [each.track for each in moments if each.track.status is Status.TRACKED and each.track.seq in truths]
    errors = [np.linalg.norm(each.tip_box - truths[each.seq].tip_box) for each in good]
    assert np.mean(errors) < 0.5  # the target of the model method on smooth scenes with the true rig, mm
    rolls = [each.roll_rad - truths[each.seq].roll_rad for each in good if each.roll_rad is not None]
    # A count is 0.075 deg; half of one by rounding, and the twin's gears may have their play of the settings.
    play_deg = world.settings.encoder_backlash_deg
    assert np.abs(rolls).max() < np.deg2rad(0.075 + play_deg)

    session = SessionReader(tmp_path / "twin")
    recorded = list(session.tracks())
    assert len(recorded) == summary["pairs"] >= 15
    again = list(replay_tracks(session, make_tracker("model", rig)))
    for one, other in zip(again, recorded, strict=True):
        assert (one.seq, one.t_ns, one.status, one.reason) == (other.seq, other.t_ns, other.status, other.reason)
        assert (one.roll_rad, one.sigma_mm) == (other.roll_rad, other.sigma_mm)
        if other.shape_box is not None:
            assert np.array_equal(one.shape_box, other.shape_box)
            assert np.array_equal(one.box_from_tip.matrix, other.box_from_tip.matrix)
    options = ReplayOptions(speed=0.1)  # slow, so that even a busy machine keeps the pace
    with ReplaySource(session, clock=clock, tracker=make_tracker("model", rig), options=options) as replay:
        moment = replay.read_moment(LONG_S)
    assert moment is not None
    assert moment.track.seq == recorded[0].seq
    assert set(moment.images) == ({"top", "front"} if videos else set())
