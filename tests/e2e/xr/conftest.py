"""The live page on the twin, and a browser with an emulated headset."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

from ..test_page import LiveProcess
from .headset import Headset

_QUIET = (
    "--no-sandbox",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
)
_GRAPHICS = (("--use-gl=angle", "--use-angle=gl-egl"), ("--use-gl=angle", "--use-angle=swiftshader"))


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory, repo_root: Path) -> Iterator[LiveProcess]:
    if not (repo_root / "src" / "cathxr" / "web_client" / "index.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")
    process = LiveProcess(tmp_path_factory.mktemp("xr"))
    process.start()
    yield process
    process.kill()


@pytest.fixture(scope="module")
def browser(require_tool: Callable[[str], Path]) -> Iterator[Browser]:
    path = require_tool("chromium")
    with sync_playwright() as playwright:
        for graphics in _GRAPHICS:
            browser = playwright.chromium.launch(executable_path=path, args=[*_QUIET, *graphics])
            page = browser.new_page()
            has_graphics = page.evaluate("() => document.createElement('canvas').getContext('webgl2') !== null")
            page.close()
            if has_graphics:
                break
            browser.close()
        else:
            pytest.fail("this Chromium draws no WebGL 2, neither with EGL nor with SwiftShader")
        yield browser
        browser.close()


@pytest.fixture
def headset(browser: Browser, live: LiveProcess) -> Iterator[Headset]:
    opened = Headset(browser, live.url)
    yield opened
    opened.context.close()
