"""Small sources that fail on command, and a detector and a tracker that do nearly nothing."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import pytest

from cathxr.core import Detection, EndOfStream, Image, Observation, Pose, Reading, Rig, Status, Track
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.optical import OpticalSource
from cathxr.runtime.supervisor import RetryPolicy
from cathxr.storage.rig_file import example_rig

PERIOD_NS = 10_000_000
LONG_S = 20.0
"""Only ever waited for in full by a test that fails."""


@dataclass
class FakeCamera:
    """Gives a picture every 10 ms. error: raised by the next read; stalled: gives nothing; missing: cannot open."""

    name: str
    error: Exception | None = None
    missing: Exception | None = None
    stalled: bool = False
    ends_after: int | None = None
    openings: int = 0
    opened: bool = False
    seq: int = 0

    def __enter__(self) -> Self:
        self.openings += 1
        if self.missing is not None:
            raise self.missing
        self.opened = True
        return self

    def __exit__(self, *_: object) -> None:
        self.opened = False

    def read(self, timeout_s: float) -> Image | None:
        if self.error is not None:
            error, self.error = self.error, None
            raise error
        if self.ends_after is not None and self.seq >= self.ends_after:
            raise EndOfStream
        now_ns = time.monotonic_ns()
        due_ns = (now_ns // PERIOD_NS + 1) * PERIOD_NS
        if self.stalled:
            time.sleep(min(timeout_s, 0.02))
            return None
        time.sleep((due_ns - now_ns) / 1e9)
        self.seq += 1
        return Image(self.name, self.seq, due_ns - PERIOD_NS // 2, np.zeros((4, 4), np.uint8))


@dataclass
class FakeEncoder:
    """Gives a reading every 2 ms, counting up."""

    error: Exception | None = None
    seq: int = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def read(self, timeout_s: float) -> Reading | None:
        if self.error is not None:
            error, self.error = self.error, None
            raise error
        time.sleep(0.002)
        self.seq += 1
        return Reading(self.seq, time.monotonic_ns(), self.seq)


@dataclass
class FakeDetector:
    """Finds the same line in every picture. `error`: raised once. Counts its resets."""

    error: Exception | None = None
    resets: int = 0
    threads: set[int] = field(default_factory=set)

    def detect(self, image: Image, predicted_box: Track | None = None) -> Detection:
        self.threads.add(threading.get_ident())
        if self.error is not None:
            error, self.error = self.error, None
            raise error
        curve = np.array([[10.0, 1.0], [0.0, 1.0]])
        normal = np.array([[0.0, 1.0], [0.0, 1.0]])
        ones = np.ones(2)
        return Detection(image.camera, image.seq, image.t_ns, curve, normal, ones, ones, curve[0], 1.0)

    def reset(self) -> None:
        self.resets += 1


@dataclass
class FakeTracker:
    """Tracks when both views have something. Its sigma depends on all it has seen since the last reset."""

    memory: float = 0.0
    resets: int = 0

    def update(self, observation: Observation) -> Track:
        reasons = [each.reason for each in observation.detections if each.reason is not None]
        if reasons:
            return Track(observation.seq, observation.t_ns, Status.LOST, reason=reasons[0])
        self.memory = 0.9 * self.memory + (observation.t_ns % 1000) / 1000.0
        shape = np.array([[10.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        return Track(
            observation.seq,
            observation.t_ns,
            Status.TRACKED,
            shape_box=shape,
            box_from_tip=Pose.identity(),
            roll_rad=observation.roll_rad,
            sigma_mm=self.memory,
            roll_predicted=observation.roll_predicted,
        )

    def reset(self) -> None:
        self.resets += 1
        self.memory = 0.0


@dataclass
class Bench:
    """An optical source with everything that goes into it."""

    rig: Rig
    top: FakeCamera
    front: FakeCamera
    encoder: FakeEncoder
    detectors: dict[str, FakeDetector]
    tracker: FakeTracker
    source: OpticalSource

    def until(self, wanted: Callable[[Track], bool]) -> Track:
        """Read until a Track is as wanted."""
        end = time.monotonic() + LONG_S
        while time.monotonic() < end:
            track = self.source.read(1.0)
            if track is not None and wanted(track):
                return track
        raise AssertionError("no such Track came")

    def health(self, name: str) -> str | None:
        """Return the last error of a part."""
        return next(each for each in self.source.health(time.monotonic_ns()) if each.source == name).last_error


@pytest.fixture
def bench() -> Bench:
    rig, clock = example_rig(), MonotonicClock()
    top, front, encoder = FakeCamera("top"), FakeCamera("front"), FakeEncoder()
    detectors, tracker = {"top": FakeDetector(), "front": FakeDetector()}, FakeTracker()
    policy = RetryPolicy(first_s=0.02, last_s=0.05)
    cameras = {"top": top, "front": front}
    source = OpticalSource(
        rig, cameras, detectors=detectors, tracker=tracker, clock=clock, encoder=encoder, policy=policy
    )
    return Bench(rig, top, front, encoder, detectors, tracker, source)


@pytest.fixture
def eventually() -> Callable[[Callable[[], bool]], None]:
    """A function that waits until something is so, and fails the test when it never is."""

    def wait(condition: Callable[[], bool]) -> None:
        end = time.monotonic() + LONG_S
        while not condition():
            assert time.monotonic() < end, "it never came true"
            time.sleep(0.005)

    return wait
