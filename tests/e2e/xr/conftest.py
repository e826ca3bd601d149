"""The live page on the twin, or on a recording whose poses are known, and a browser with an emulated headset."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from ..flat.played import Played, record
from ..test_page import LiveProcess
from .headset import Headset


@pytest.fixture
def live(tmp_path: Path, built_client: Path) -> Iterator[LiveProcess]:
    assert built_client.is_file()
    process = LiveProcess(tmp_path)
    process.start()
    yield process
    process.kill()


@pytest.fixture(scope="session")
def built_client(repo_root: Path) -> Path:
    """The page that the server gives out; skips the test where it is not built."""
    page = repo_root / "src" / "cathxr" / "web_client" / "index.html"
    if not page.is_file():
        pytest.skip("the web client is not built: run `python tools/web_client.py build`")
    return page


@pytest.fixture
def open_headset(browser: Browser) -> Iterator[Callable[..., Headset]]:
    """A function that opens the page of an address; afterwards nothing may have left that address."""
    opened: list[Headset] = []

    def make(url: str, **options: Any) -> Headset:
        opened.append(Headset(browser, url, **options))
        return opened[-1]

    yield make
    for each in opened:
        each.context.close()
    for each in opened:
        assert each.strays() == [], "a request to another host"


@pytest.fixture
def headset(open_headset: Callable[..., Headset], resting: Played) -> Headset:
    return open_headset(resting.url)


def _played(folder: Path, kind: str, seconds: float = 360.0) -> Iterator[Played]:
    process = Played(record(folder / "session", kind, seconds), folder)
    yield process
    process.close()


@pytest.fixture(scope="module")
def turning(built_client: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    """A catheter that rolls to and fro in the right atrium, and whose Tracks are all known."""
    assert built_client.is_file()
    yield from _played(tmp_path_factory.mktemp("turning"), "turning")


@pytest.fixture(scope="module")
def resting(built_client: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    """A catheter that rests in the right atrium."""
    assert built_client.is_file()
    yield from _played(tmp_path_factory.mktemp("resting"), "resting")


@pytest.fixture(scope="module")
def moving(built_client: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    """A catheter that rolls for as long as a proof takes."""
    assert built_client.is_file()
    yield from _played(tmp_path_factory.mktemp("moving"), "turning", 2400.0)
