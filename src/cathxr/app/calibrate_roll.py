"""`cathxr calibrate roll`: roll's zero, the gears' play and their ratio, with the jig."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH, PageChoice, page_options
from cathxr.core import ConfigError


@click.command("roll")
@click.option("--rig", "rig_path", required=True, type=PATH, help="The rig (rig.toml); its [roll] is measured.")
@click.option(
    "--source",
    type=click.Choice(["encoder", "twin"]),
    default="encoder",
    show_default=True,
    help="twin: a simulated hand does it, without hardware.",
)
@click.option("--config", type=PATH, help="The configuration that names the encoder (config.toml).")
@click.option("--device", metavar="PORT", help="The encoder's serial port, as COM3.  [default: found by itself]")
@click.option("--page", is_flag=True, help="On the page instead of the console.")
@click.option("--no-backlash", is_flag=True, help="Leave out the rocking: for sprung gears, which have no play.")
@click.option("--no-turn", is_flag=True, help="Leave out the full turn.")
@click.option(
    "--jig-std-deg",
    type=click.FloatRange(0.0, 10.0),
    default=0.3,
    show_default=True,
    help="What the jig and its lock leave open (standard deviation).",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of the simulation; with an odd one the gears are not as the rig says.",
)
@click.option("--yes", is_flag=True, help="With --source twin: confirm and save by itself.")
@click.option("--dry-run", is_flag=True, help="Write no rig and leave the board's zero as it is.")  # fmt: skip
@page_options
@told_in_a_sentence
def roll(
    rig_path: Path,
    source: str,
    config: Path | None,
    device: str | None,
    page: bool,
    no_backlash: bool,
    no_turn: bool,
    jig_std_deg: float,
    seed: int,
    yes: bool,
    dry_run: bool,
    port: int,
    lan: bool,
    no_browser: bool,
) -> None:
    """Measure roll with the jig: its zero, the backlash of the gears, and whether one turn gives the right counts.

    Slide the transducer into the jig at the far end of the box, turn the gear's mark T to the right side, lock, and
    confirm; rock the encoder's gear within its play; turn the handle once round. Everything goes into the rig's [roll]
    with its error and date, and the board is told its zero. A run that fails or is cancelled changes nothing.

    \b
    Examples:
      cathxr calibrate roll --rig rig.toml
      cathxr calibrate roll --rig rig.toml --config config.toml --page
      cathxr calibrate roll --rig rig.toml --source twin --dry-run
    """
    # Imported here: what serves the page takes a second to load that --help need not wait for.
    from cathxr.app.calibrate_roll_run import RollChoice, calibrate_roll
    from cathxr.runtime.calibration_roll import RollSteps

    if source == "twin" and (device is not None or config is not None):
        raise ConfigError("The simulation has an encoder of its own: leave --device and --config out.")
    if yes and (source != "twin" or page):
        raise ConfigError("--yes is for --source twin on the console: with a real jig a person confirms each step.")
    choice = RollChoice(
        source=source,
        config=config,
        device=device,
        seed=seed,
        steps=RollSteps(backlash=not no_backlash, turn=not no_turn, jig_std_deg=jig_std_deg),
        page=PageChoice(port, lan, not no_browser) if page else None,
        confirms_itself=yes,
        dry_run=dry_run,
    )
    calibrate_roll(rig_path, choice)
