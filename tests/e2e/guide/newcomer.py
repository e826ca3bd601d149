"""Somebody who is led through the guide: at a desktop by keys and mouse, in a headset by ray or pinch."""

import itertools
import time
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from playwright.sync_api import Browser, Page

from ..asked_page import AskedPage
from ..xr.headset import Headset, Side

HANG_S = 180.0
"""Limit on waiting for what must come, on a loaded machine without a graphics card; not a measurement."""
DONE = "window.__cathxr.guide.done"
CONFIRM_ROLL = (
    "(window.__cathxr.guide.progress === 'Roll is not known yet' && document.querySelector('#roll-action').click())"
)
"""Presses the page's button where the roll is to be confirmed; false in either case."""
_STATE = "JSON.stringify({ ...window.__cathxr?.guide, status: window.__cathxr?.status, link: window.__cathxr?.link })"
CHEAP = "?aa=0&mat=lambert&dpr=0.3&pictures=1&iceHz=2"
WORN = "?xr=emulate&aa=0&mat=lambert&dpr=0.4&pictures=0&iceHz=3"


class Newcomer(AskedPage):
    """The page in a browser of its own context, and everything that it complained about."""

    hang_s = HANG_S
    state = _STATE

    def __init__(self, browser: Browser, url: str, *, query: str = "") -> None:
        self.url = url + CHEAP + query
        self.context = browser.new_context(viewport={"width": 1100, "height": 700}, device_scale_factor=1)
        self.page: Page = self.context.new_page()
        self.listen()
        self.open()

    def note(self, kind: str, text: str) -> None:
        if kind in ("error", "warning") and "ReadPixels" not in text:
            self.complaints.append(f"{kind}: {text}")

    def open(self) -> None:
        """Load the page, anew if it is there already."""
        self.page.goto(self.url)
        self.until("window.__cathxr?.drawn() && window.__cathxr.link === 'live'")

    @property
    def step(self) -> str:
        found: str = self.ask("window.__cathxr.guide.step")
        return found

    @property
    def steps(self) -> list[str]:
        found: list[str] = self.ask("window.__cathxr.guide.steps")
        return found

    @property
    def phase(self) -> str:
        found: str = self.ask("window.__cathxr.guide.phase")
        return found

    @property
    def progress(self) -> str:
        found: str = self.ask("window.__cathxr.guide.progress")
        return found

    def until_step(self, step: str) -> None:
        self.until(f"window.__cathxr.guide.step === '{step}'")

    def until_past(self, step: str) -> None:
        """Wait until a step is met, and has given way to the next by itself."""
        self.until(f"window.__cathxr.guide.step !== '{step}' || window.__cathxr.guide.done")
        self.until(f"window.__cathxr.guide.step !== '{step}'")

    def watch(self, seconds: float) -> None:
        """Let the page go on for so long while Tracks come."""
        seq = self.ask("window.__cathxr.lastSeq")
        self.page.wait_for_timeout(1000 * seconds)
        self.until(f"window.__cathxr.lastSeq > {seq}")

    def press_for(self, key: str, ms: int) -> None:
        """Hold a key for so long, and let what it does arrive."""
        self.page.keyboard.down(key)
        self.page.wait_for_timeout(ms)
        self.page.keyboard.up(key)
        self.watch(0.4)

    def work(self, keys: str, ms: int = 400) -> None:
        """Press the keys in turn, each for a while, until the step is met; on a busy machine some of it is not seen.

        There the twin's encoder also falls silent for so long that it counts as restarted: the roll is confirmed then,
        as the page asks.
        """
        deadline = time.monotonic() + HANG_S
        step = self.step
        for key in itertools.cycle(keys.split()):
            if self.step != step or self.ask(f"{CONFIRM_ROLL} || {DONE}"):
                return
            assert time.monotonic() < deadline, self.ask(_STATE)
            self.press_for(key, ms)


class Wearer(Headset):
    """Somebody in an emulated headset, with controllers or bare hands, and the guide's plate before them."""

    device: Literal["controller", "hand"] = "controller"

    def take_up(self, device: Literal["controller", "hand"]) -> None:
        self.device = device
        self.hands(device)

    @property
    def step(self) -> str:
        found: str = self.ask("window.__cathxr.guide.step")
        return found

    def squeeze(self, *, down: bool, side: Side = "right") -> None:
        """Hold the heart with what is there to hold it: the grip, or a pinch in the air."""
        if self.device == "hand":
            self.pinch(side, down=down)
        else:
            self.button(side, "squeeze", down=down)

    def point_at(self, place: list[float]) -> None:
        self.aim(f"{self.device}-right", [0.2, 1.25, -0.15], place)

    def trigger(self, *, down: bool) -> None:
        if self.device == "hand":
            self.pinch("right", down=down)
        else:
            self.button("right", "trigger", down=down)

    def press_at(self, place: list[float]) -> None:
        self.point_at(place)
        self.trigger(down=True)
        self.trigger(down=False)

    def press_button(self, label: str) -> None:
        """Press a button of the guide's plate."""
        self.press_at(self.until(f"window.__cathxr.guide.button('{label}')"))

    def work(self, *labels: str) -> None:
        """Hold buttons of the plate in turn, each for a while, until the step is met; see `Newcomer.work`."""
        step = self.step
        deadline = time.monotonic() + HANG_S
        for label in itertools.cycle(labels):
            if self.step != step or self.ask(f"{CONFIRM_ROLL} || {DONE}"):
                return
            assert time.monotonic() < deadline, self.ask(_STATE)
            self.point_at(self.until(f"window.__cathxr.guide.button('{label}')"))
            self.trigger(down=True)
            self.frames(6)
            self.trigger(down=False)
            self.page.wait_for_timeout(300)

    def until_past(self, step: str) -> None:
        self.until(f"window.__cathxr.guide.step !== '{step}'")


def to_target(ask: Callable[[str], Any], page: Page) -> float | None:
    """Return how far ahead of the tip the practice target lies along the box, mm, once it rests; None: not known."""
    tip = ask("window.__cathxr.drawn()?.tip")
    for _ in range(10):
        page.wait_for_timeout(350)
        before, tip = tip, ask("window.__cathxr.drawn()?.tip")
        if before and tip and np.linalg.norm(np.subtract(tip, before)) < 0.7:
            break
    else:
        return None
    places = ask("window.__cathxr.scene().targets.filter(({ name }) => name === 'Practice target')")
    return float(places[0]["positionMm"][0] - tip[0]) if places else None
