"""The page among others, in a real browser: following, locks, the way into a headset, and a device without graphics."""

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from cathxr.app.diag_folder import DiagFolder
from cathxr.devices.clock import MonotonicClock
from cathxr.wire.diag_pages import make_diag_router
from cathxr.wire.hub import Hub
from cathxr.wire.server import LiveServer

from ..asked_page import HANG_S, AskedPage

Start = Callable[..., LiveServer]

CHEAP = "/?aa=0&mat=lambert&dpr=0.5&pictures=0&heart=0"
_BARE = ["--no-sandbox", "--disable-gpu", "--disable-3d-apis"]


@pytest.fixture(scope="module", autouse=True)
def built(repo_root: Path) -> None:
    if not (repo_root / "src" / "cathxr" / "web_client" / "diag.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")


class Seen(AskedPage):
    """A page in a browser profile of its own."""

    def __init__(self, browser: Browser, url: str) -> None:
        self.context = browser.new_context(viewport={"width": 1000, "height": 600})
        self.page: Page = self.context.new_page()
        self.page.set_default_timeout(HANG_S * 1000)
        self.listen()
        self.page.goto(url)

    def stilled(self) -> list[float]:
        """Return where the page's camera is, m, once it no longer travels there: it does so when a scene comes."""
        deadline = time.monotonic() + HANG_S
        while (before := self.ask("window.__cathxr.camera()")) is not None and time.monotonic() < deadline:
            self.page.wait_for_timeout(500)  # longer than it travels
            if before == (now := self.ask("window.__cathxr.camera()")):
                return now
        raise AssertionError("the camera never stands still")

    def note(self, kind: str, text: str) -> None:
        """Take only what was not caught: servers here say 404 to some requests."""


def test_one_page_follows_another_and_gets_its_own_back(browser: Browser, server: LiveServer) -> None:
    first, second = Seen(browser, server.url + CHEAP), Seen(browser, server.url + CHEAP)
    try:
        for each in (first, second):
            each.until("window.__cathxr?.link === 'live' && window.__cathxr.frames > 2")
        second.page.locator("#set-wallContact").uncheck()
        own = second.stilled()
        first.page.locator("[data-preset=top]").click()
        first.page.locator("#set-ice").check()
        second.until("document.querySelector('#people-list button')")
        second.page.locator("#people-list button").click()
        second.until("document.querySelector('#set-ice').checked && document.querySelector('#set-ice').disabled")
        assert second.page.locator("#following-text").inner_text() == "Following Desktop 1"
        assert "followed" in second.page.locator("[data-setting=ice]").get_attribute("title")
        wanted = np.array(first.ask("window.__cathxr.camera()"))
        deadline = time.monotonic() + HANG_S
        while np.linalg.norm(np.array(second.ask("window.__cathxr.camera()")) - wanted) > 0.002:
            assert time.monotonic() < deadline, "the camera does not come to where the other one is"
            second.page.wait_for_timeout(100)
            wanted = np.array(first.ask("window.__cathxr.camera()"))
        second.page.locator("#following-stop").click()
        second.until("!document.querySelector('#set-ice').checked && !document.querySelector('#set-ice').disabled")
        assert not second.page.locator("#set-wallContact").is_checked()
        second.until(f"Math.hypot(...window.__cathxr.camera().map((x, at) => x - {own}[at])) < 0.002")
        assert first.complaints == []
        assert second.complaints == []
    finally:
        first.context.close()
        second.context.close()


def test_a_follower_sees_which_step_of_the_guide_is_shown(browser: Browser, server: LiveServer) -> None:
    first, second = Seen(browser, server.url + CHEAP), Seen(browser, server.url + CHEAP)
    try:
        for each in (first, second):
            each.until("window.__cathxr?.link === 'live' && window.__cathxr.frames > 2")
        second.until("document.querySelector('#people-list button')")
        second.page.locator("#people-list button").click()
        second.until("document.querySelector('#following-text').textContent === 'Following Desktop 1'")
        first.until("window.__cathxr.guide.start(true) ?? window.__cathxr.guide.step")
        second.until("document.querySelector('#following-text').textContent.includes('guide: 1 of')")
        first.page.locator(".guide-skip").click()
        second.until("document.querySelector('#following-text').textContent === 'Following Desktop 1'")
    finally:
        first.context.close()
        second.context.close()


def test_what_is_locked_cannot_be_changed_and_comes_free_again(browser: Browser, hub: Hub, server: LiveServer) -> None:
    seen = Seen(browser, server.url + CHEAP)
    try:
        seen.until("window.__cathxr?.link === 'live'")
        hub.publish_lock({"mode": "2d", "depthMm": 60}, "This trial shows 2D only.")
        seen.until("document.querySelector('[name=set-mode][value=\"2d\"]').checked")
        assert seen.page.locator("#held").inner_text() == "This trial shows 2D only."
        assert seen.page.locator("[name=set-mode]").first.is_disabled()
        assert seen.page.locator("[data-setting=mode]").get_attribute("title") == "This trial shows 2D only."
        assert seen.page.locator("#set-hud").is_enabled()
        seen.page.reload()
        seen.until("document.querySelector('[name=set-mode][value=\"2d\"]')?.checked")
        hub.publish_lock({}, "")
        seen.until("document.querySelector('[name=set-mode][value=\"3d\"]').checked")
        assert seen.page.locator("#held").is_hidden()
    finally:
        seen.context.close()


def test_the_way_into_a_headset_is_told(browser: Browser, start: Start) -> None:
    server = start(lan=True)
    seen = Seen(browser, server.url + CHEAP)
    try:
        seen.until("document.querySelector('#enter-vr').getAttribute('aria-disabled') === 'true'")
        seen.until("window.__cathxr?.link === 'live'")
        seen.page.locator("#enter-vr").click(force=True)
        seen.until("document.querySelector('#headset-qr').naturalWidth > 0")
        words = seen.page.locator("#headset").inner_text()
        assert server.lan_urls[0] in words
        assert server.fingerprint is not None
        assert server.fingerprint[:23] in words
        assert f"adb reverse tcp:{server.port}" in words
        assert not seen.page.locator("#headset-reason").is_hidden()
    finally:
        seen.context.close()


def test_without_graphics_the_page_says_so_and_shows_the_next_step(
    browser: Browser, require_tool: Callable[[str], Path], start: Start, tmp_path: Path
) -> None:
    router = make_diag_router(DiagFolder(tmp_path).save, clock=MonotonicClock())
    server = start(routers=(router,))
    bare = browser.browser_type.launch(executable_path=require_tool("chromium"), args=_BARE)
    try:
        seen = Seen(bare, server.url + CHEAP)
        seen.until("!document.querySelector('#banner').hidden")
        assert "no WebGL 2" in seen.page.locator("#banner").inner_text()
        seen.page.locator("#banner-link").click()
        seen.until("location.pathname === '/diag' && document.querySelector('#save')?.disabled === false")
        assert "no WebGL 2" in seen.page.locator("#verdict").inner_text()
        seen.page.locator("#save").click()
        saved = seen.until("document.querySelector('#saved').textContent")
        (file,) = (tmp_path / "diag").iterdir()
        assert file.name in saved
    finally:
        bare.close()


def test_a_device_is_measured_and_what_it_can_do_is_kept(browser: Browser, start: Start, tmp_path: Path) -> None:
    router = make_diag_router(DiagFolder(tmp_path).save, clock=MonotonicClock())
    server = start(routers=(router,))
    seen = Seen(browser, server.url + "/diag")
    try:
        seen.until("document.querySelector('#save')?.disabled === false")
        cards = seen.ask("[...document.querySelectorAll('.card h2')].map((each) => each.textContent)")
        assert cards == ["This page's frames", "Link", "Graphics", "Device"]
        seen.page.locator("#save").click()
        saved = seen.until("document.querySelector('#saved').textContent")
        (file,) = (tmp_path / "diag").iterdir()
        assert file.name in saved
        report = json.loads(file.read_text(encoding="utf-8"))
        frames = report["frames_ms"]
        assert frames["count"] > 20
        assert 0.0 < frames["median"] <= frames["p95"] <= frames["p99"] <= frames["longest"]
        assert report["seconds"] >= 10.0
        trips = report["link"]["round_trip_ms"]
        assert report["link"]["connected"] is True
        assert trips["count"] > 10
        assert 0.0 < trips["median"] <= trips["p99"]
        graphics = report["graphics"]
        assert graphics["webgl2"] is True
        assert "EXT_color_buffer_float" in graphics["extensions"]
        assert graphics["max_texture_3d"] >= 256
        assert report["draw_ms"]["median"] > 0.0
        assert {key: report["device"][key] for key in ("secure", "vr", "ar")} == {
            "secure": True,
            "vr": False,
            "ar": False,
        }
        assert seen.complaints == []
    finally:
        seen.context.close()
