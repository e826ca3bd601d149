"""The roll's validity as an operator meets it: over the link, and on the page, with the twin's encoder made to fail."""

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, sync_playwright
from websockets.sync.client import ClientConnection, connect

from cathxr.app.bench_live import live_process

LONG_S = 120.0
"""Only ever waited for in full by a test that fails."""
CHEAP = "?aa=0&mat=lambert&dpr=0.5&pictures=5&heart=0"


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    with live_process("--publish-truth") as (_, port):
        yield port


class Client:
    """One client of the link, with the newest of what it was sent."""

    def __init__(self, link: ClientConnection) -> None:
        self._link = link
        self.newest: dict[str, dict[str, Any]] = {}
        self._answers: dict[str, str] = {}
        self._count = 0

    def until(self, wanted: Callable[[], Any]) -> None:
        deadline_s = time.monotonic() + LONG_S
        while not wanted():
            assert time.monotonic() < deadline_s, f"never: {self.newest.get('roll')}, {self.newest.get('track')}"
            self._take(json.loads(self._link.recv(timeout=30)))

    def ask(self, name: str, **args: object) -> str:
        """Send a command; return "done" or why it was refused."""
        self._count += 1
        key = str(self._count)
        self._link.send(json.dumps({"type": "command", "name": name, "args": args, "id": key}))
        self.until(lambda: key in self._answers)
        return self._answers[key]

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "refusal":
            self._answers[message["id"]] = message["sentence"]
        elif message["type"] == "event":
            payload = message["payload"]
            if message["kind"] == "done":
                self._answers[payload["id"]] = "done"
            self.newest[message["kind"]] = payload
        else:
            self.newest[message["type"]] = message

    @property
    def roll(self) -> float | None:
        """The newest Track's, None also where it is lost."""
        track = self.newest.get("track", {})
        value: float | None = track.get("roll")
        return value

    @property
    def tracked(self) -> bool:
        return self.newest.get("track", {}).get("status") == "tracked"

    def is_valid(self) -> bool:
        return self.newest.get("roll", {}).get("valid", False) and self.roll is not None

    def needs(self, what: str) -> bool:
        state = self.newest.get("roll", {})
        return state.get("needs") == what and not state["valid"] and self.tracked and self.roll is None


@pytest.fixture
def client(port: int) -> Iterator[Client]:
    with connect(f"ws://127.0.0.1:{port}/ws?protocol=1", compression=None) as link:
        yield Client(link)


def test_a_restart_is_confirmed_and_a_loss_of_power_needs_the_jig(client: Client, port: int) -> None:
    client.until(client.is_valid)
    assert client.newest["track"]["roll_predicted"] in (True, False)
    assert client.ask("encoder_fault", kind="reset") == "done"
    client.until(lambda: client.needs("confirm"))
    assert "confirm" in client.newest["roll"]["sentence"]
    with connect(f"ws://127.0.0.1:{port}/ws?protocol=1", compression=None) as link:  # whoever joins is told at once
        late = Client(link)
        late.until(lambda: late.newest.get("roll"))
        assert late.newest["roll"] == client.newest["roll"]
    assert client.ask("roll_confirm") == "done"
    client.until(client.is_valid)

    assert client.ask("steer", insertion_mm=60.0, roll_deg=0.0, anterior_deg=30.0, left_deg=0.0) == "done"
    assert client.ask("encoder_fault", kind="power") == "done"
    client.until(lambda: client.needs("jig"))
    assert "jig" in client.ask("roll_confirm")
    client.until(lambda: abs(client.newest.get("controls", {"roll_deg": 9.0})["roll_deg"]) < 1e-3)
    assert client.ask("roll_zero") == "done"
    client.until(client.is_valid)
    assert client.ask("steer", roll_deg=45.0) == "done"
    client.until(lambda: client.roll is not None and np.degrees(client.roll) > 44.9)
    time.sleep(0.5)
    client.until(lambda: client.newest["controls"]["roll_deg"] > 44.999)
    # A count is 0.075 degrees: half by rounding, half by the zero that was set to a whole one.
    client.until(lambda: client.roll is not None and abs(np.degrees(client.roll) - 45.0) < 0.1)


def test_an_unplugged_encoder_is_named_and_what_is_no_fault_is_refused(client: Client) -> None:
    client.until(client.is_valid)
    assert "there are reset" in client.ask("encoder_fault", kind="fire")
    assert client.ask("encoder_fault", kind="unplug") == "done"
    client.until(lambda: client.newest.get("roll", {}).get("present") is False and client.roll is None)
    assert client.newest["roll"]["needs"] == ""
    assert client.ask("roll_zero") != "done"
    assert client.ask("encoder_fault", kind="none") == "done"
    client.until(lambda: client.needs("jig"))
    assert client.ask("roll_zero") == "done"
    client.until(client.is_valid)


@pytest.fixture(scope="module")
def page(port: int, require_tool: Callable[[str], Path], repo_root: Path) -> Iterator[Page]:
    if not (repo_root / "src" / "cathxr" / "web_client" / "index.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")
    path = require_tool("chromium")
    switches = ["--no-sandbox", "--ignore-gpu-blocklist", "--use-gl=angle", "--use-angle=swiftshader"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=switches)
        one = browser.new_page(viewport={"width": 1280, "height": 720})
        one.goto(f"http://127.0.0.1:{port}/{CHEAP}")
        yield one
        browser.close()


def shown(page: Page, expression: str) -> None:
    """Wait until an expression is true. Not `wait_for_function`: the page's policy forbids eval."""
    deadline_s = time.monotonic() + LONG_S
    while not page.evaluate(f"() => Boolean({expression})"):
        assert time.monotonic() < deadline_s, f"never: {expression}\n{page.inner_text('body')}"
        page.wait_for_timeout(50)


@pytest.mark.parametrize(
    ("kind", "says", "button"),
    [("reset", "confirm", "Confirm roll"), ("power", "set roll zero", "Roll zero set with the jig")],
)
def test_the_page_shows_no_beam_until_its_button_is_pressed(
    client: Client, page: Page, tmp_path: Path, kind: str, says: str, button: str
) -> None:
    client.until(client.is_valid)
    shown(page, "window.__cathxr?.drawn()?.beam")
    assert page.locator("#roll-note").is_hidden()
    client.ask("encoder_fault", kind=kind)
    shown(page, "window.__cathxr.drawn()?.beam === false && !document.querySelector('#roll-note').hidden")
    assert says in page.inner_text("#roll-detail")
    assert "not valid" in page.inner_text("#legend-text")
    assert page.inner_text("#roll-action") == button
    assert page.inner_text("#roll") == "–"
    page.screenshot(path=tmp_path / "invalid.png")
    page.set_viewport_size({"width": 390, "height": 844})
    box = page.locator("#roll-note").bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390
    page.screenshot(path=tmp_path / "phone.png")
    page.set_viewport_size({"width": 1280, "height": 720})
    page.click("#roll-action")
    shown(page, "window.__cathxr.drawn()?.beam && document.querySelector('#roll-note').hidden")
    assert page.evaluate("() => window.__cathxr.consoleErrors") == 0
    client.until(client.is_valid)
