"""The options that `run` and `record` share, and how they override config.toml."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from cathxr.app.config import Config, read_config

PATH = click.Path(path_type=Path)
Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS = (
    click.option("--source", default="twin", show_default=True, metavar="twin|cameras|SESSION",
                 help="Where the pictures come from."),
    click.option("--rig", type=PATH, help="The rig (rig.toml). The twin has one of its own."),
    click.option("--config", type=PATH, help="What a person chooses (config.toml); options here win."),
    click.option("--method", type=click.Choice(["model", "paper"]), help="How to track.  [default: model]"),
    click.option("--points", type=click.IntRange(2, 200), help="Points of the centreline.  [default: 50]"),
    click.option("--scene", help="The twin's scene, such as smooth, fast, debris.  [default: smooth]"),
    click.option("--seed", type=click.IntRange(min=0), help="The twin's seed.  [default: 0]"),
)  # fmt: skip


def live_options(function: Function) -> Function:
    """Return a command with the options of every live source."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


def chosen_config(
    config: Path | None,
    *,
    rig: Path | None,
    method: str | None,
    points: int | None,
    scene: str | None,
    seed: int | None,
) -> Config:
    """Return the configuration with what was given on the command line in its place.

    Raises:
        ConfigError: the configuration file is wrong.
    """
    read = Config() if config is None else read_config(config)
    return read.model_copy(
        update={
            **_given(rig=None if rig is None else str(rig)),
            "tracking": read.tracking.model_copy(update=_given(method=method, points=points)),
            "twin": read.twin.model_copy(update=_given(scene=scene, seed=seed)),
        }
    )


def _given(**values: Any) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
