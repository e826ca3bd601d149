"""`cathxr calibrate check`: is the rig still right? From tracked sessions, pictures of the markers, or a phantom."""

import datetime
from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH
from cathxr.core import ConfigError

NOT_GOOD = 3
"""Exit code of a check that ran and found the rig not good."""


@click.command("check")
@click.option("--rig", "rig_path", type=PATH, help="The rig to check (rig.toml).")
@click.option("--session", "sessions", multiple=True, type=PATH, help="A recorded session; may be given several times.")
@click.option("--top", type=PATH, help="A picture of the markers from the top camera.")
@click.option("--front", type=PATH, help="A picture of the markers from the front camera.")
@click.option(
    "--refine", is_flag=True, help="Refine the cameras' poses with the sessions, and write them into the rig."
)
@click.option(
    "--phantom", "phantom_path", help="A phantom (phantom.toml), or 'example': report the tip's errors in its holes."
)
@click.option("--source", type=click.Choice(["twin"]), help="With --phantom: let the simulated box visit the holes.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The simulated box's seed.")
@click.option("--report", type=PATH, help="Where pictures and tables go.  [default: <rig>_calibration]")
@click.option("--dry-run", is_flag=True, help="Write no rig.")
@told_in_a_sentence
def check(
    rig_path: Path | None,
    sessions: tuple[Path, ...],
    top: Path | None,
    front: Path | None,
    refine: bool,
    phantom_path: str | None,
    source: str | None,
    seed: int,
    report: Path | None,
    dry_run: bool,
) -> None:
    """Check a calibrated rig: do both cameras agree on the catheter, are the markers where they were, how far is the
    tip off in a phantom. Exit 0: good; 3: not good; 1: the check could not be made.

    A session in which the catheter moves slowly through the whole box for a minute says most. With --refine the poses
    are refined with it; the earlier rig stays beside the new one.

    \b
    Example:
      cathxr calibrate check --rig rig.toml --session recordings/slow
      cathxr calibrate check --rig rig.toml --session recordings/slow --refine
      cathxr calibrate check --rig rig.toml --top top.png --front front.png
      cathxr calibrate check --rig rig.toml --phantom phantom.toml --session recordings/holes
      cathxr calibrate check --phantom example --source twin
    """
    if phantom_path is not None:
        _only_phantom(top, front, refine)
        from cathxr.app.calibrate_check_phantom import check_phantom

        check_phantom(rig_path, phantom_path, sessions=sessions, source=source, seed=seed, report=report)
        return
    if rig_path is None:
        raise ConfigError("Say which rig is to be checked: give --rig rig.toml.")
    if source is not None:
        raise ConfigError(
            "--source twin belongs to --phantom: without a phantom give --session or pictures of markers."
        )
    if not sessions and top is None and front is None:
        raise ConfigError(
            "There is nothing to check the rig with: give --session (a recorded session), or --top and --front "
            "(pictures of the markers)."
        )
    folder = report or report_folder(rig_path)
    if refine:
        from cathxr.app.calibrate_check_refine import refine_rig

        if not sessions:
            raise ConfigError("--refine needs recorded sessions: give --session, one or several times.")
        refine_rig(rig_path, sessions, date=datetime.date.today().isoformat(), dry_run=dry_run)
        return
    from cathxr.app.calibrate_check_rig import check_rig

    good = check_rig(rig_path, sessions, {"top": top, "front": front}, folder=folder)
    if not good:
        raise click.exceptions.Exit(NOT_GOOD)


def report_folder(rig_path: Path) -> Path:
    """Return where a rig's calibration pictures go."""
    return rig_path.with_name(f"{rig_path.stem}_calibration")


def _only_phantom(top: Path | None, front: Path | None, refine: bool) -> None:
    if top is not None or front is not None or refine:
        raise ConfigError("--phantom is a check of its own: give it without --top, --front and --refine.")
