"""The live page on the twin, as somebody meets it who has never been there."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from ..test_page import LiveProcess
from .newcomer import WORN, Newcomer, Wearer

_CONFIG = """
[twin]
rate_hz = 12.0
"""
"""Pictures and browser share a machine without a graphics card: fewer pictures leave fewer gaps in the Tracks."""


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory, repo_root: Path) -> Iterator[LiveProcess]:
    if not (repo_root / "src" / "cathxr" / "web_client" / "index.html").is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")
    folder = tmp_path_factory.mktemp("guide")
    config = folder / "config.toml"
    config.write_text(_CONFIG, encoding="utf-8")
    process = LiveProcess(folder, "--config", str(config))
    process.start()
    yield process
    process.kill()


@pytest.fixture
def newcomer(browser: Browser, live: LiveProcess) -> Iterator[Callable[..., Newcomer]]:
    """Opens pages that remember nothing; `query` is added to the address."""
    opened: list[Newcomer] = []

    def make(**options: str) -> Newcomer:
        opened.append(Newcomer(browser, live.url, **options))
        return opened[-1]

    yield make
    for each in opened:
        each.context.close()


@pytest.fixture
def wearer(browser: Browser, live: LiveProcess) -> Iterator[Wearer]:
    opened = Wearer(browser, live.url, query=WORN)
    yield opened
    opened.context.close()
