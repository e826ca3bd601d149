"""The seeds' page in a real browser: on a real command, or on a session whose segmentation does what a test says."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from playwright.sync_api import Browser

from cathxr.devices.clock import MonotonicClock
from cathxr.heart.seeds import Seed
from cathxr.heart.volume import Grid, LabelVolume, Progress, Technical, Volume
from cathxr.runtime.heart_seeds import SeedSession
from cathxr.runtime.heart_seeds_run import HeartSeedsRun
from cathxr.storage.rig_file import example_rig
from cathxr.wire.heart_pages import make_slices_router
from cathxr.wire.hub import Hub
from cathxr.wire.scene import scene_description
from cathxr.wire.server import LiveServer

from ..calibration_page.conftest import Watched, browser

__all__ = ["browser"]

HANDLE = "window.__cathxrSeeds"
SHAPE = (30, 48, 64)
SPACING_MM = (1.0, 1.0, 2.0)


class SeedsWatched(Watched):
    """The page, and what a person does with it."""

    def __init__(self, browser: Browser, url: str, *, size: tuple[int, int] = (1280, 800)) -> None:
        super().__init__(browser, f"{url}/heart.html", size=size)

    def ready(self) -> None:
        """Wait until every plane shows the slice that the cursor is in, whole, and the page may command."""
        self.until(f"{HANDLE}?.role === 'operator' && Object.values({HANDLE}.shown()).every((each) => each >= 0)")
        for plane in ("axial", "coronal", "sagittal"):
            self.page.get_by_role("button", name=f"Whole slice: {plane}").click()
        self.page.mouse.move(2, 2)
        self.current()

    def current(self) -> None:
        """Wait until what is shown is what the cursor is in."""
        self.until(f"[{HANDLE}.cursor, {HANDLE}.shown()].every((each, n, [at, shown]) => "
                   "Math.floor(at[2] + 0.5) === shown.axial && Math.floor(at[1] + 0.5) === shown.coronal && "
                   "Math.floor(at[0] + 0.5) === shown.sagittal)")  # fmt: skip
        self.settled()

    def where(self, plane: str, seen: Sequence[float]) -> tuple[float, float]:
        """Return where seen coordinates are on the page, CSS pixels."""
        x, y = self.page.evaluate(f"() => {HANDLE}.where('{plane}', {json.dumps([float(each) for each in seen])})")
        return float(x), float(y)

    def click(self, plane: str, seen: Sequence[float], **more: Any) -> None:
        """Click at seen coordinates, as near as whole pixels go."""
        x, y = self.where(plane, seen)
        self.page.mouse.click(round(x), round(y), **more)

    def colour_at(self, plane: str, seen: Sequence[float]) -> npt.NDArray[Any]:
        """Return the colour (3,), BGR, that the page shows at seen coordinates: the middle of 3 x 3 pixels."""
        x, y = self.where(plane, seen)
        box = self.page.locator(f"canvas[data-plane={plane}]").bounding_box()
        assert box is not None
        picture = self.picture(f"canvas[data-plane={plane}]")
        row, column = round(y - box["y"]), round(x - box["x"])
        return np.asarray(np.median(picture[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3), axis=0))


@dataclass
class Segmented:
    """What the session's segmentation gives."""

    labels: LabelVolume
    findings: tuple[str, ...]


class Desk:
    """A session on a small volume, served: halves of 100 and 500 HU; a seed of the aorta makes a slab of it aorta."""

    def __init__(self, *, force_pairing: bool = False) -> None:
        self.saved: list[tuple[Seed, ...]] = []
        matrix = np.diag([*SPACING_MM, 1.0])
        hu = np.full(SHAPE, 100, np.int16)
        hu[:, :, SHAPE[2] // 2 :] = 500  # the patient's left
        volume = Volume(hu, Grid(SHAPE, matrix), Technical("CT"))
        self.session = SeedSession(
            volume, segmenter=self._segment, save=lambda seeds: self.saved.append(tuple(seeds)), key="key-of-the-test",
            labels=self._labels(aorta=False),
        )  # fmt: skip
        hub = Hub()
        clock = MonotonicClock()
        self.run = HeartSeedsRun(self.session, outlet=hub, clock=clock)
        self.server = LiveServer(
            hub, scene_description(example_rig(), "ct"), commands=lambda each: self.run.handle(each.name, each.args),
            clock=clock, port=0, force_pairing=force_pairing,
            routers=(make_slices_router(self.session.slices, key="key-of-the-test"),),
        )  # fmt: skip
        self.server.start()
        self.run.__enter__()

    def close(self) -> None:
        self.run.stop()
        self.server.stop()

    def _labels(self, *, aorta: bool) -> LabelVolume:
        labels = np.zeros(SHAPE, np.uint8)
        labels[8:22, 12:36, SHAPE[2] // 2 : 52] = 1
        names = {1: "left_ventricle"}
        if aorta:
            labels[8:22, 12:36, 12 : SHAPE[2] // 2] = 5
            names[5] = "aorta"
        return LabelVolume(labels, Grid(SHAPE, np.diag([*SPACING_MM, 1.0])), names)

    def _segment(self, seeds: Sequence[Seed], progress: Progress) -> Segmented:
        progress("Separating", 0.5)
        return Segmented(
            self._labels(aorta=any(each.structure == "aorta" for each in seeds)), ("No veins were found.",)
        )


@pytest.fixture
def make_desk() -> Iterator[Callable[..., Desk]]:
    """A function that gives a served session; all are closed with the test."""
    made: list[Desk] = []

    def make(**options: Any) -> Desk:
        made.append(Desk(**options))
        return made[-1]

    yield make
    for each in made:
        each.close()


@pytest.fixture
def open_seeds(browser: Browser) -> Iterator[Callable[..., SeedsWatched]]:
    """A function that opens the page of the server at an address; all are closed with the test."""
    opened: list[SeedsWatched] = []

    def open_it(url: str, **options: Any) -> SeedsWatched:
        opened.append(SeedsWatched(browser, url, **options))
        return opened[-1]

    yield open_it
    for each in opened:
        each.context.close()


class SeedsCommand:
    """A running `cathxr heart seeds …`."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "cathxr", "-v", "heart", "seeds", *arguments, "--no-browser", "--port", "0"]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1, encoding="utf-8"
        )
        self.said = ""
        assert self.process.stdout is not None
        while line := self.process.stdout.readline():
            self.said += line
            if found := re.search(r"Open (http://127\.0\.0\.1:\d+)/heart\.html", line):
                self.url = found[1]
                return
        raise AssertionError(f"the page did not start: {self.said}")

    def finish(self) -> str:
        """Wait for the process's end; return all it said."""
        said, _ = self.process.communicate(timeout=300.0)
        self.said += said
        return self.said

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(10.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()


@pytest.fixture
def start_seeds() -> Iterator[Callable[..., SeedsCommand]]:
    """A function that starts the command; all are ended with the test."""
    started: list[SeedsCommand] = []

    def start(*arguments: str) -> SeedsCommand:
        started.append(SeedsCommand(*arguments))
        return started[-1]

    yield start
    for each in started:
        each.close()
