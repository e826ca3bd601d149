"""The calibration page in a real browser, and a live server that publishes what a test says."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from cathxr.core import Image, PixelArray
from cathxr.devices.clock import MonotonicClock
from cathxr.storage.rig_file import example_rig
from cathxr.wire.hub import Hub
from cathxr.wire.messages import Command
from cathxr.wire.scene import scene_description
from cathxr.wire.server import LiveServer

HANG_S = 120.0
"""Limit on waiting for what must come, on a loaded machine without a graphics card; not a measurement."""
_QUIET = (
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
)


class Bench:
    """A live server that publishes what a test says and remembers what the page commands."""

    def __init__(self, *, force_pairing: bool = False) -> None:
        self.hub = Hub()
        self.answers: dict[str, Mapping[str, Any]] = {}
        self._commands: list[tuple[str, dict[str, Any]]] = []
        self._lock = threading.Lock()
        self.server = LiveServer(
            self.hub,
            scene_description(example_rig(), "twin"),
            commands=self._take,
            clock=MonotonicClock(),
            port=0,
            force_pairing=force_pairing,
        )

    def _take(self, command: Command) -> Mapping[str, Any]:
        with self._lock:
            self._commands.append((command.name, dict(command.args)))
        return self.answers.get(command.name, {})

    @property
    def commands(self) -> list[tuple[str, dict[str, Any]]]:
        """Return what was commanded so far."""
        with self._lock:
            return list(self._commands)

    def show(self, camera: str, pixels: PixelArray, *, seq: int) -> None:
        """Publish a camera's picture."""
        self.hub.publish_picture(Image(camera, seq, seq, pixels), seq=seq)


class Watched:
    """The calibration page with everything that it asked for and complained about."""

    def __init__(self, browser: Browser, bench: Bench | str, *, size: tuple[int, int] = (1280, 720)) -> None:
        """Open the page of a bench, or of the server at an address."""
        width, height = size
        mobile = width < 1000
        url = bench if isinstance(bench, str) else f"{bench.server.url}/calibrate.html"
        self._bench = None if isinstance(bench, str) else bench
        self.context = browser.new_context(
            viewport={"width": width, "height": height}, is_mobile=mobile, has_touch=mobile, device_scale_factor=1
        )
        self.page: Page = self.context.new_page()
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.context.on("request", lambda request: self.requests.append(request.url))
        self.page.on("console", lambda message: self._note(message.type, message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(f"uncaught: {error}"))
        self.page.goto(url)

    def _note(self, kind: str, text: str) -> None:
        if kind in ("error", "warning"):
            self.complaints.append(f"{kind}: {text}")

    def until(self, expression: str, *, within_s: float = HANG_S) -> Any:
        """Return the expression's value once it is true. Not `wait_for_function`: the page's policy forbids eval."""
        return self._wait(lambda: self.page.evaluate(f"() => {expression}"), expression, within_s)

    def commanded(self, count: int) -> tuple[str, dict[str, Any]]:
        """Return the newest command once the bench has so many."""
        bench = self._bench
        assert bench is not None
        self._wait(lambda: len(bench.commands) >= count, f"{count} commands")
        assert len(bench.commands) == count, bench.commands
        return bench.commands[-1]

    def _wait(self, ask: Callable[[], Any], what: str, within_s: float = HANG_S) -> Any:
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            if value := ask():
                return value
            self.page.wait_for_timeout(50)
        pytest.fail(f"never came true: {what}\n{self.page.inner_text('body')}\n{self.complaints}")

    def picture(self, selector: str) -> Any:
        """Return what is drawn on a canvas, (H, W, 3) BGR."""
        shot = self.page.locator(selector).screenshot()
        return np.asarray(cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR), dtype=int)

    def settled(self) -> None:
        """Let the page draw what it was told last."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


@pytest.fixture(scope="module")
def browser(require_tool: Callable[[str], Path], repo_root: Path) -> Iterator[Browser]:
    """A browser without a window."""
    if not (repo_root / "src" / "cathxr" / "web_client" / "calibrate.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=require_tool("chromium"), args=_QUIET)
        yield browser
        browser.close()


@pytest.fixture
def make_bench() -> Iterator[Callable[..., Bench]]:
    """A function that gives a running bench; all stop with the test."""
    made: list[Bench] = []

    def make(**options: Any) -> Bench:
        made.append(Bench(**options))
        made[-1].server.start()
        return made[-1]

    yield make
    for each in made:
        each.server.stop()


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    """A running bench."""
    return make_bench()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Watched]]:
    """A function that opens the page of a bench, or of the server at an address; all are closed with the test."""
    opened: list[Watched] = []

    def open_it(bench: Bench | str, **options: Any) -> Watched:
        opened.append(Watched(browser, bench, **options))
        return opened[-1]

    yield open_it
    for each in opened:
        each.context.close()


@pytest.fixture
def watched(open_page: Callable[..., Watched], bench: Bench) -> Watched:
    """The bench's page."""
    return open_page(bench)
