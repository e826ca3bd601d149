"""The page /setup in a real browser, on the real command with both crosses in the simulated box."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from .asked_page import AskedPage
from .test_page import LiveProcess


class _SetupPage(AskedPage):
    """The page at /setup."""

    state = "JSON.stringify([window.__cathxrSetup?.link, window.__cathxrSetup?.verdicts(), document.body.innerText])"

    def __init__(self, browser: Browser, url: str) -> None:
        self.page = browser.new_context(viewport={"width": 1440, "height": 900}).new_page()
        self.listen()
        self.page.goto(f"{url}setup")


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveProcess]:
    process = LiveProcess(tmp_path_factory.mktemp("setup"), "--scene", "pillars", "--seed", "0")
    process.start()
    yield process
    process.kill()


def test_the_walk_measures_the_simulated_boxs_pictures(browser: Browser, live: LiveProcess, tmp_path: Path) -> None:
    page = _SetupPage(browser, live.url)
    page.until("window.__cathxrSetup?.verdicts()['fiducials, top'] === 'good'")
    page.until("!window.__cathxrSetup.busy")
    found = page.ask("window.__cathxrSetup.verdicts()")
    assert found["fiducials, front"] == "good"
    assert found["which camera is which"] == "good"
    # The crosses hide the light: nothing is said of it until they are out.
    assert found["exposure, top"] == "unknown"
    assert found["rig"] == "warn"
    page.until("Object.values(window.__cathxrSetup.shown()).every((seq) => seq > 0)")
    assert page.page.locator("#ask").is_hidden()
    assert "8 of 8" in page.page.locator("#steps").inner_text()
    page.page.locator("#again").click()
    page.until("window.__cathxrSetup.busy")
    page.until("!window.__cathxrSetup.busy")
    page.page.screenshot(path=tmp_path / "setup.png")
    assert page.complaints == []
