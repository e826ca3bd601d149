"""The options of a command that serves a calibration's page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import click

PATH = click.Path(path_type=Path)
DEFAULT_PORT = 8765
Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class PageChoice:
    """How the page is served."""

    port: int = DEFAULT_PORT
    lan: bool = False
    browser: bool = True


_PAGE_OPTIONS = (
    click.option("--port", type=click.IntRange(0, 65535), default=DEFAULT_PORT, show_default=True,
                 help="Port of the page on this machine; 0: any free one."),
    click.option("--lan", is_flag=True, help="Also serve the network (https, with a pairing code): for a tablet."),
    click.option("--no-browser", is_flag=True, help="Do not open a browser."),
)  # fmt: skip
_SOURCE_OPTIONS = (
    click.option("--source", default="cameras", show_default=True, metavar="cameras|twin|VIDEO",
                 help="Where live pictures come from."),
    click.option("--config", type=PATH, help="The configuration that names the cameras (config.toml)."),
    click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The twin's seed."),
)  # fmt: skip


def page_options(function: Function) -> Function:
    """Return a command with the options port, lan, no_browser."""
    return _with(_PAGE_OPTIONS, function)


def live_page_options(function: Function) -> Function:
    """Return a command with the options source, config, seed, port, lan, no_browser."""
    return _with((*_SOURCE_OPTIONS, *_PAGE_OPTIONS), function)


def _with(options: Sequence[Callable[[Function], Function]], function: Function) -> Function:
    for option in reversed(options):
        function = option(function)
    return function
