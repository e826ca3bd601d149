"""A server with a stand-in for training, and pages on it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from fastapi import APIRouter
from playwright.sync_api import Browser

from cathxr.devices.clock import MonotonicClock
from cathxr.storage.rig_file import example_rig
from cathxr.wire.hub import Hub
from cathxr.wire.scene import scene_description
from cathxr.wire.server import LiveServer
from cathxr.wire.training_messages import RunPath

from ..asked_page import AskedPage
from ..xr.headset import Headset
from .trainer import Trainer, run_path

CHEAP = "?aa=0&mat=lambert&dpr=0.5&pictures=0&heart=0&guide=0"
WORN = "?xr=emulate&aa=0&mat=lambert&dpr=0.4&pictures=0&heart=0&iceHz=3&guide=0"
LATEST = "window.__cathxr?.link === 'live' && window.__cathxr.frames > 2 && window.__cathxr.training.offer"


@dataclass(frozen=True)
class Course:
    """A server, and what stands for training in it."""

    server: LiveServer
    trainer: Trainer


class TrainingPage(AskedPage):
    """The page at a desktop or on a phone, its Training panel open."""

    def __init__(self, browser: Browser, url: str, *, size: tuple[int, int] = (1280, 720), query: str = CHEAP) -> None:
        self.context = browser.new_context(viewport={"width": size[0], "height": size[1]}, device_scale_factor=1)
        self.page = self.context.new_page()
        self.page.set_default_timeout(1000 * self.hang_s)
        self.listen()
        self.page.goto(url + "/" + query)
        self.until(LATEST)
        if self.page.locator("#training-toggle[aria-expanded=false]").is_visible() and size[0] > 700:
            self.page.locator("#training-toggle").click()
        elif size[0] <= 700:
            self.page.locator(".tabs [data-show=training]").click()

    @property
    def panel(self) -> str:
        """All that the panel says now."""
        return self.page.locator("#training").inner_text()

    def buttons(self) -> list[str]:
        """The buttons of the panel that can be seen, but for the one that opens it."""
        found: list[str] = self.ask(
            "[...document.querySelectorAll('#training-body button')]"
            ".filter((each) => each.offsetParent !== null).map((each) => each.textContent)"
        )
        return found

    def press(self, name: str) -> None:
        self.page.locator("#training").get_by_role("button", name=name, exact=True).click()

    def until_phase(self, phase: str) -> None:
        self.until(f"window.__cathxr.training.phase === '{phase}'")


@pytest.fixture(scope="module")
def built(repo_root: Path) -> None:
    if not (repo_root / "src" / "cathxr" / "web_client" / "index.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")


@pytest.fixture
def open_course(built: None) -> Iterator[Callable[..., Course]]:
    """A function that starts a server with a stand-in for training; `paired`: pages must pair to command."""
    opened: list[Course] = []

    def make(*, paired: bool = False) -> Course:
        hub = Hub()
        trainer = Trainer(hub)
        router = APIRouter()
        router.add_api_route("/training/runs/run-1.json", run_path, methods=["GET"], response_model=RunPath)
        server = LiveServer(
            hub,
            scene_description(example_rig(), "cameras"),
            commands=trainer.carry_out,
            clock=MonotonicClock(),
            port=0,
            force_pairing=paired,
            routers=(router,),
        )
        server.start()
        opened.append(Course(server, trainer))
        return opened[-1]

    yield make
    for course in opened:
        course.trainer.close()
        course.server.stop()


@pytest.fixture
def course(open_course: Callable[..., Course]) -> Course:
    return open_course()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., TrainingPage]]:
    opened: list[TrainingPage] = []

    def make(course: Course, **options: object) -> TrainingPage:
        opened.append(TrainingPage(browser, course.server.url, **options))  # type: ignore[arg-type]
        return opened[-1]

    yield make
    for page in opened:
        page.context.close()


@pytest.fixture
def put_on(browser: Browser) -> Iterator[Callable[[Course], Headset]]:
    """A function that opens the page of a course in an emulated headset and enters."""
    opened: list[Headset] = []

    def make(course: Course) -> Headset:
        headset = Headset(browser, course.server.url + "/", query=WORN)
        opened.append(headset)
        headset.until("window.__cathxr.training.offer")
        headset.enter("vr")
        return headset

    yield make
    for each in opened:
        each.context.close()
