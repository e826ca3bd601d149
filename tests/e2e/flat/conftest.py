"""Recordings of a catheter whose pose is known, played to the page by the real command; a browser to look at them."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, sync_playwright

from .played import FlatPage, Played, record

_ARGUMENTS = (
    "--no-sandbox",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
    "--use-gl=angle",
)


@pytest.fixture(scope="session")
def flat_browser(require_tool: Callable[[str], Path]) -> Iterator[Browser]:
    path = require_tool("chromium")
    with sync_playwright() as playwright:
        for graphics in ("gl-egl", "swiftshader"):
            browser = playwright.chromium.launch(executable_path=path, args=[*_ARGUMENTS, f"--use-angle={graphics}"])
            page = browser.new_page()
            drawable = "document.createElement('canvas').getContext('webgl2')?.getExtension('EXT_color_buffer_float')"
            works = page.evaluate(f"() => !!({drawable})")
            page.close()
            if works:
                break
            browser.close()
        else:
            pytest.fail("this Chromium has no WebGL 2 with half-float targets")
        yield browser
        browser.close()


def _played(repo_root: Path, folder: Path, kind: str) -> Iterator[Played]:
    if not (repo_root / "src" / "cathxr" / "web_client" / "index.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")
    process = Played(record(folder / "session", kind), folder)
    yield process
    process.close()


@pytest.fixture(scope="module")
def turning(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    yield from _played(repo_root, tmp_path_factory.mktemp("turning"), "turning")


@pytest.fixture(scope="module")
def resting(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    yield from _played(repo_root, tmp_path_factory.mktemp("resting"), "resting")


@pytest.fixture(scope="module")
def blind(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    yield from _played(repo_root, tmp_path_factory.mktemp("blind"), "blind")


@pytest.fixture
def open_page(flat_browser: Browser) -> Iterator[Callable[..., FlatPage]]:
    opened: list[FlatPage] = []

    def make(played: Played, **options: Any) -> FlatPage:
        opened.append(FlatPage(flat_browser, played.url, **options))
        return opened[-1]

    yield make
    for page in opened:
        page.context.close()
