"""`cathxr heart`: from a CT to a heart folder. Its libraries are the extra `heart`."""

import importlib.util

import click

from cathxr.app.lazy_group import LazyGroup

_COMMANDS = {
    "info": ("heart_info", "info", "Show what is at a path: series, phases, spacing, contrast."),
    "build": ("heart_build", "build", "Build a heart folder from a CT, or from ready masks."),
    "seeds": ("heart_seeds", "seeds", "Correct the segmentation on a page, by seeds."),
}
_LIBRARIES = ("pydicom", "SimpleITK", "skimage", "vtkmodules", "trimesh", "fast_simplification")


class _HeartGroup(LazyGroup):
    """Says in a sentence that the extra is missing, before a sub-command's module is imported."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _COMMANDS and (missing := [each for each in _LIBRARIES if not importlib.util.find_spec(each)]):
            raise click.ClickException(
                f"This needs more libraries ({', '.join(missing)}): install them with pip install 'cathxr[heart]'"
            )
        return super().get_command(ctx, cmd_name)


@click.group("heart", cls=_HeartGroup, commands_of=_COMMANDS)
def heart() -> None:
    """Bring a patient's heart from a cardiac CT into the scene, without anything that names the patient.

    \b
    Examples:
      cathxr heart info ct_series/
      cathxr heart build ct_series/ --out heart/
      cathxr heart seeds ct_series/ --out seeds.csv
    """
