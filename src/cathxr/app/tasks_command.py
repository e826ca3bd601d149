"""`cathxr tasks`: which training tasks there are, what they say, and whether they fit a heart."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH

if TYPE_CHECKING:
    from cathxr.training import PlacedTarget


@click.group("tasks")
def tasks() -> None:
    """List, show and check training tasks.

    \b
    Examples:
      cathxr tasks list
      cathxr tasks show six_targets > my_task.toml
      cathxr tasks check my_task.toml --heart heart/
    """


@tasks.command("list")
@told_in_a_sentence
def list_tasks() -> None:
    """List the built-in tasks.

    \b
    Example:
      cathxr tasks list
    """
    from rich.console import Console
    from rich.table import Table

    from cathxr.training import builtin_tasks

    table = Table()
    for name in ("key", "step", "targets", "order", "limit", "name"):
        table.add_column(name, justify="right" if name in ("step", "targets", "limit") else "left")
    for each in builtin_tasks():
        count = str(each.draw or len(each.targets))
        table.add_row(each.key, str(each.step or ""), count, each.order, f"{each.limit_s:.0f} s", each.name)
    Console().print(table)


@tasks.command("show")
@click.argument("task")
@told_in_a_sentence
def show(task: str) -> None:
    """Print a task as a task file: a start for one of your own. TASK: a built-in key or a file.

    \b
    Example:
      cathxr tasks show six_targets > my_task.toml
    """
    from cathxr.training import find_task, task_toml

    click.echo(task_toml(find_task(task)), nl=False)


@tasks.command("check")
@click.argument("task")
@click.option("--heart", type=PATH, help="The heart folder.  [default: the built-in heart]")
@click.option("--rig", type=PATH, help="The rig, whose region of interest counts.  [default: the example rig]")
@told_in_a_sentence
def check(task: str, heart: Path | None, rig: Path | None) -> None:
    """Check a task against a heart and its registration, and say where its targets lie in the box.

    \b
    Example:
      cathxr tasks check my_task.toml --heart heart/
    """
    from cathxr.app.score_inputs import placed_in
    from cathxr.storage.rig_file import example_rig, read_rig
    from cathxr.training import find_task

    chosen = example_rig() if rig is None else read_rig(rig)
    placed = placed_in(find_task(task), heart, chosen.roi)
    for each in placed.targets:
        click.echo(_line(each))
    click.echo(f"{len(placed.targets)} targets: the task fits.")


def _line(target: "PlacedTarget") -> str:
    x, y, z = target.point_box
    rule = {"tip": "tip within", "beam": "beam within", "plane": "image plane within"}[target.kind]
    angle = "" if target.angle_deg is None else f", {target.angle_deg:g} degrees"
    return (
        f"{target.key}: ({x:.1f}, {y:.1f}, {z:.1f}) mm in the box; {rule} {target.distance_mm:g} mm{angle}, "
        f"for {target.dwell_s:g} s"
    )
