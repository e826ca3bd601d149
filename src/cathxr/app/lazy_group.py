"""A group of commands that imports a sub-command's module only when it is asked for, so that --help answers at once."""

import importlib
from collections.abc import Mapping
from typing import Any

import click

Commands = Mapping[str, tuple[str, str, str]]
"""By name: the module under cathxr.app, the command's name in it, and the line that --help shows."""


class LazyGroup(click.Group):
    """Use as `@click.group(cls=LazyGroup, commands_of={...})`."""

    def __init__(self, *args: Any, commands_of: Commands, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._commands_of = commands_of

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self._commands_of)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self._commands_of:
            return None
        module, name, _ = self._commands_of[cmd_name]
        command = getattr(importlib.import_module(f"cathxr.app.{module}"), name)
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, _, summary) in self._commands_of.items()])
