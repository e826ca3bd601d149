"""Recordings of a catheter whose pose is known, played to the page by the real command."""

import json
import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from cathxr.core import Detection, FloatArray, Observation, Status, Track
from cathxr.core.pose import Pose
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionWriter

from ..asked_page import AskedPage

HANG_S = 180.0
"""Limit on waiting for what must come, on a loaded machine without a graphics card; not a measurement."""
CHEAP = "?aa=0&mat=lambert&dpr=1&pictures=0&iceHz=10"
RATE_HZ = 12.0
_RECORDED_TRACKS = "from cathxr.app import cli, live_parts; live_parts.make_tracker = lambda *_, **__: None; cli.main()"
"""The real command, but a replay that gives the recorded Tracks, whose poses are known, instead of tracking again."""
_SECONDS = 360.0


def roll_of(t_s: float) -> float:
    """Return the roll of the turning catheter, rad: to and fro by 1 rad, at 29 degrees a second at most."""
    return float(np.sin(0.5 * t_s))


def track(seq: int, roll_rad: float | None, noise_mm: FloatArray, noise_rad: float = 0.0) -> Track:
    """Return a straight catheter from the inlet into the right atrium, 55 mm along x. roll_rad None: not known."""
    tip = np.array([55.0, 0.0, 0.0]) + noise_mm
    shape = np.linspace(tip, np.zeros(3), 12)
    z = shape[0] - shape[-1]
    z /= np.linalg.norm(z)
    down = np.array([0.0, -1.0, 0.0])
    x = down - (down @ z) * z
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    angle = (roll_rad or 0.0) + noise_rad
    beam = np.cos(angle) * x + np.sin(angle) * y
    rotation = np.stack([beam, np.cross(z, beam), z], axis=1)
    t_ns = 10**12 + round(seq / RATE_HZ * 1e9)
    pose = Pose.from_matrix(rotation, tip)
    return Track(seq, t_ns, Status.TRACKED, "", shape, pose, None if roll_rad is None else angle, 0.1, 5_000_000)


def record(folder: Path, kind: str, seconds: float = _SECONDS) -> Path:
    """Write a session of a catheter.

    It is `turning`, `resting` with a tracker's noise, `crawling`: to and fro by 5 mm at 0.5 mm/s, turned by 2 degrees a
    second, or `blind`: of unknown roll.

    The noise is 0.02 mm and 0.05 degrees, what is left of a tracked tip at rest.
    """
    rng = np.random.default_rng(6)
    writer = SessionWriter(folder, rig=example_rig(), config={}, clock_pair=(1, "2026-01-31T10:00:00Z"), videos=False)
    for seq in range(int(seconds * RATE_HZ)):
        if kind == "turning":
            made = track(seq, roll_of(seq / RATE_HZ), np.zeros(3))
        elif kind == "resting":
            made = track(seq, 0.4, rng.normal(0.0, 0.02 / np.sqrt(3.0), 3), rng.normal(0.0, 0.00087))
        elif kind == "crawling":
            way = abs((seq / RATE_HZ) % 20.0 - 10.0)
            made = track(seq, np.deg2rad(2.0 * way), np.array([0.5 * way - 5.0, 0.0, 0.0]))
        else:
            made = track(seq, None, np.zeros(3))
        missing = tuple(
            Detection(name, seq, made.t_ns, reason="recorded without pictures") for name in ("top", "front")
        )
        writer.write_observation(Observation(seq, made.t_ns, missing, skew_ns=0))  # a replay keeps its time
        writer.write_track(made)
    writer.close()
    return folder


class Played:
    """`cathxr run` on a recording, as a process of its own, and a witness of every Track that it sends."""

    def __init__(self, session: Path, folder: Path) -> None:
        self._log = folder / "run.log"
        command = [
            sys.executable,
            "-c",
            _RECORDED_TRACKS,
            "run",
            "--source",
            str(session),
            "--port",
            "0",
            "--no-browser",
        ]
        with self._log.open("w", encoding="utf-8") as sink:
            environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
            self._process = subprocess.Popen(command, stdout=sink, stderr=subprocess.STDOUT, env=environment)
        self.port = self._wait_for_port()
        self.tracks: dict[float, FloatArray] = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/{CHEAP}"

    def beam_at(self, t_s: float) -> FloatArray:
        """Return the tip's x axis at an instant, between the Tracks that were sent around it."""
        times = sorted(self.tracks)
        after = int(np.searchsorted(times, t_s))
        assert 0 < after < len(times), (t_s, times[:1], times[-1:])
        before, later = times[after - 1], times[after]
        share = (t_s - before) / (later - before)
        axis = (1.0 - share) * self.tracks[before] + share * self.tracks[later]  # 1 degree apart: linear is as good
        return np.asarray(axis / np.linalg.norm(axis))

    def close(self) -> None:
        self._stop.set()
        self._process.kill()
        self._process.wait()
        self._thread.join(HANG_S)

    def _wait_for_port(self) -> int:
        deadline = time.monotonic() + HANG_S
        while time.monotonic() < deadline:
            if match := re.search(r"http://127\.0\.0\.1:(\d+)", self._log.read_text(encoding="utf-8")):
                return int(match[1])
            assert self._process.poll() is None, self._log.read_text(encoding="utf-8")
            time.sleep(0.1)
        pytest.fail("cathxr run has not printed its address:\n" + self._log.read_text(encoding="utf-8"))

    def _listen(self) -> None:
        with connect(f"ws://127.0.0.1:{self.port}/ws?protocol=1", compression=None) as link:
            while not self._stop.is_set():
                try:
                    message = json.loads(link.recv(timeout=HANG_S))
                except (ConnectionClosed, TimeoutError):
                    return
                if message["type"] == "track" and message["tip"] is not None:
                    w, x, y, z = message["tip"]["orientation_wxyz"]
                    axis = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)]
                    self.tracks[message["t"]] = np.array(axis)


class FlatPage(AskedPage):
    """The page, with everything that it asked for and complained about."""

    hang_s = HANG_S

    def __init__(self, browser: Browser, url: str, *, size: tuple[int, int] = (1280, 720)) -> None:
        self.context = browser.new_context(viewport={"width": size[0], "height": size[1]})
        self.page = self.context.new_page()
        self.requests: list[str] = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.listen()
        self.page.goto(url)
        self.until("window.__cathxrFlat !== undefined && window.__cathxr.heartParts > 0")

    def ask(self, expression: str) -> Any:
        """Return the value of an expression, or what a function in it returns."""
        return self.page.evaluate(expression)

    def set(self, **change: Any) -> None:
        self.page.evaluate("(change) => window.__cathxrFlat.set(change)", change)

    def frames(self, count: int) -> None:
        """Wait until so many animation frames have passed, drawn or not."""
        self.page.evaluate(
            "(count) => new Promise((done) => {"
            " const step = () => (count-- > 0 ? requestAnimationFrame(step) : done()); step(); })",
            count,
        )
