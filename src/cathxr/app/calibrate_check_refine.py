"""`cathxr calibrate check --refine`: better poses from tracked sessions, written into the rig."""

from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cathxr.app.calibrate_check_rig import read_sessions
from cathxr.calibration.epipolar import joined
from cathxr.calibration.refine import refined
from cathxr.storage.rig_file import read_rig, write_rig


def refine_rig(rig_path: Path, sessions: Sequence[Path], *, date: str, dry_run: bool) -> None:
    """Refine the poses and write the rig, with the earlier one beside it.

    Raises:
        CathxrError: it cannot be done or brings nothing; the rig is untouched.
    """
    rig = read_rig(rig_path)
    result = refined(rig, joined([pairs for _, pairs in read_sessions(rig, sessions)]), date=date)
    table = Table(title="Refined poses")
    for name in ("", "before", "after"):
        table.add_column(name, justify="left" if not name else "right")
    table.add_row("held-out pairs agree to, mm", f"{result.before_mm:.3f}", f"{result.after_mm:.3f}")
    table.add_row(
        "expected tip error from calibration, mm", f"{result.expected_before_mm:.3f}", f"{result.expected_after_mm:.3f}"
    )
    for name, (mm, degrees) in result.moved.items():
        table.add_row(f"{name} camera moved", "", f"{mm:.2f} mm, {degrees:.3f}°")
    table.add_row("tips in the region of interest move by, mm", "", f"{result.tip_shift_mm:.2f}")
    Console().print(table)
    click.echo(
        f"{result.n_used} pairs in {result.cells} places were used, {result.n_held_out} were held out; their "
        f"disagreement fell from {result.before_mm:.3f} to {result.after_mm:.3f} mm. Markers still say more "
        "about where the cameras are: calibrate them again when you can."
    )
    if dry_run:
        click.echo("Dry run: the rig is left as it is.")
        return
    write_rig(rig_path, result.rig, backup=True)
    click.echo(f"Written: {rig_path}; the earlier rig is kept beside it.")
