"""`cathxr hardware check`: whether a set of parameters can be built, and whether its solids are right."""

from pathlib import Path

import click
from rich.console import Console

from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.hardware_command import missing_cad
from cathxr.app.hardware_file import read_checked
from cathxr.app.hardware_params import PARAMS_OPTION, show_figures
from cathxr.app.hardware_progress import shown_progress


@click.command("check")
@PARAMS_OPTION
@click.option("--figures-only", is_flag=True, help="Only the rules and figures, without making solids.")
@click.pass_context
@told_in_a_sentence
def check(context: click.Context, params_path: Path | None, figures_only: bool) -> None:
    """Check a rig: its rules, then every solid (closed, printable, apart from the others) and what the cameras see.

    \b
    Examples:
      cathxr hardware check
      cathxr hardware check --params params.toml
      cathxr hardware check --params params.toml --figures-only
    """
    layout, found = read_checked(params_path)
    console = Console()
    show_figures(console, layout, found)
    if figures_only:
        return
    if missing_cad():
        raise click.ClickException(
            "The solids were not checked, as this needs the CAD kernel: install it with pip install 'cathxr[cad]', or "
            "give --figures-only"
        )
    with shown_progress() as report:
        report("Loading the CAD kernel", None)
        from cathxr.hardware.cad.assembly import rig_3d
        from cathxr.hardware.cad.checks import all_problems

        report("Making the solids", None)
        rig = rig_3d(layout)
        problems = all_problems(rig, report=report)
    for each in problems:
        click.echo(f"{'Warning' if each.is_warning else 'Wrong'}: {each.what}: {each.sentence}.")
    wrong = [each for each in problems if not each.is_warning]
    click.echo(
        f"{len(rig.made())} printed parts, {len(rig.places)} placed parts: {len(wrong)} wrong, "
        f"{len(problems) - len(wrong)} to look at."
    )
    if wrong:
        context.exit(FAILED)
