"""Recordings of a catheter whose pose is known, played to the page by the real command."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from .played import FlatPage, Played, record


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
def crawling(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    yield from _played(repo_root, tmp_path_factory.mktemp("crawling"), "crawling")


@pytest.fixture(scope="module")
def blind(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    yield from _played(repo_root, tmp_path_factory.mktemp("blind"), "blind")


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., FlatPage]]:
    opened: list[FlatPage] = []

    def make(played: Played, **options: Any) -> FlatPage:
        opened.append(FlatPage(browser, played.url, **options))
        return opened[-1]

    yield make
    for page in opened:
        page.context.close()
