"""`cathxr hardware`: the rig as things to print, cut and buy. What makes solids is the extra `cad`."""

import importlib.util

import click

from cathxr.app.lazy_group import LazyGroup

_COMMANDS = {
    "params": ("hardware_params", "params", "Show what a set of parameters is worth; write params.toml."),
    "check": ("hardware_check", "check", "Check a set of parameters, and the solids made from it."),
    "export": ("hardware_export", "export", "Write every file that is needed to build the rig."),
    "manual": ("hardware_manual", "manual", "Make the pictures of the building manual."),
}
_NEED_CAD = ("export", "manual")


def missing_cad() -> bool:
    """Return whether the CAD kernel's library is not installed."""
    return importlib.util.find_spec("build123d") is None


class _HardwareGroup(LazyGroup):
    """Says in a sentence that the extra is missing, before a sub-command's module is imported."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _NEED_CAD and missing_cad():
            raise click.ClickException("This needs the CAD kernel: install it with pip install 'cathxr[cad]'")
        return super().get_command(ctx, cmd_name)


@click.group("hardware", cls=_HardwareGroup, commands_of=_COMMANDS)
def hardware() -> None:
    """Make the vision box, the roll unit and the phantom from one set of parameters; docs/build says how to build them.

    \b
    Examples:
      cathxr hardware params --out params.toml
      cathxr hardware check --params params.toml
      cathxr hardware export --params params.toml --out rig/
    """
