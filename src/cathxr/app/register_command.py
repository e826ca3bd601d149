"""`cathxr register`: where the box lies in the heart, from landmarks in a file, touched with the tip, or fiducials."""

import datetime
from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PageChoice, page_options
from cathxr.core import ConfigError, RegistrationError

_PATH = click.Path(path_type=Path)
_KINDS = ("rigid", "similarity", "affine")


@click.command("register")
@click.option("--heart", "heart_path", type=_PATH, help="The heart's folder.  [default: the built-in heart]")
@click.option("--pairs", "pairs_path", type=_PATH, help="Landmarks with their places in the box (TOML or CSV).")
@click.option(
    "--fiducials", is_flag=True, help="The rig's fiducials are the landmarks; affine unless --kind says else."
)
@click.option("--touch", is_flag=True, help="Touch each landmark with the tracked tip, guided by a page.")
@click.option("--placement", is_flag=True, help="No landmarks: the inlet before one opening, the axis towards another.")
@click.option("--kind", type=click.Choice(_KINDS), help="What is fitted.  [default: rigid]")
@click.option("--rig", "rig_path", type=_PATH, help="The rig (rig.toml), for --fiducials and --touch.")
@click.option("--fle", type=click.FloatRange(0.0, min_open=True), help="How well a landmark is known, mm (3D, rms).")
@click.option("--leave-out", multiple=True, metavar="NAME", help="Without this landmark; may be given several times.")
@click.option("--inlet", default="inferior_vena_cava", show_default=True, help="With --placement: the way in.")
@click.option("--towards", default="superior_vena_cava", show_default=True, help="With --placement: the axis' aim.")
@click.option(
    "--before", type=click.FloatRange(0.0, 200.0), default=35.0, show_default=True,
    help="With --placement: from the box's inlet to that opening, mm.",
)  # fmt: skip
@click.option("--landmark", "wanted", multiple=True, metavar="NAME", help="With --touch: this one; again for others.")
@click.option(
    "--source",
    type=click.Choice(["twin", "cameras"]),
    default="cameras",
    show_default=True,
    help="With --touch: where the tip is tracked.",
)
@click.option("--config", type=_PATH, help="With --touch: which devices the cameras are (config.toml).")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The twin's seed.")
@click.option("--out", type=_PATH, help="The file to write.  [default: registration.toml in the heart's folder]")
@click.option("--report", type=_PATH, help="Folder of the picture.  [default: <out>_report]")
@click.option("--dry-run", is_flag=True, help="Measure and show, and write nothing.")
@click.option("--yes", is_flag=True, help="Write in spite of grave doubts.")
@page_options
@told_in_a_sentence
def register(
    heart_path: Path | None,
    pairs_path: Path | None,
    fiducials: bool,
    touch: bool,
    placement: bool,
    kind: str | None,
    rig_path: Path | None,
    fle: float | None,
    leave_out: tuple[str, ...],
    inlet: str,
    towards: str,
    before: float,
    wanted: tuple[str, ...],
    source: str,
    config: Path | None,
    seed: int,
    out: Path | None,
    report: Path | None,
    dry_run: bool,
    yes: bool,
    port: int,
    lan: bool,
    no_browser: bool,
) -> None:
    """Register the box with a heart, and say how large the error is, everywhere in the heart.

    Landmarks are pairs of places, in the box and in the heart's CT; the latter may be left to the heart's own landmarks
    and openings. An earlier registration.toml is kept beside the new one; when anything fails it stays as it was.

    \b
    Examples:
      cathxr register --heart heart --pairs landmarks.csv
      cathxr register --heart heart --touch --rig rig.toml --config config.toml
      cathxr register --heart heart --fiducials --rig rig.toml
      cathxr register --heart heart --placement
      cathxr register --touch --source twin --dry-run
    """
    ways = [name for name, given in (("--touch", touch), ("--placement", placement)) if given]
    if pairs_path is not None or fiducials:
        ways.append("--fiducials" if fiducials else "--pairs")
    if len(ways) != 1:
        told = "Choose one way" if ways else "Say how"
        raise ConfigError(f"{told} to register: --pairs FILE, --touch, --fiducials with --rig, or --placement.")
    from cathxr.app.register_run import FileChoice, TouchChoice, place, register_file, register_touch

    today = datetime.date.today().isoformat()
    if placement:
        place(heart_path, out=out, inlet=inlet, towards=towards, before_mm=before, date=today, dry_run=dry_run)
        return
    if touch:
        register_touch(
            heart_path,
            TouchChoice(
                rig=rig_path, kind=kind or "rigid", wanted=wanted, source=source, config=config, seed=seed, out=out,
                report=report, dry_run=dry_run, date=today, page=PageChoice(port, lan, not no_browser),
            ),
        )  # fmt: skip
        return
    if fiducials and rig_path is None:
        raise RegistrationError("--fiducials are the rig's: give it with --rig rig.toml.")
    register_file(
        heart_path,
        FileChoice(
            pairs=pairs_path, rig=rig_path if fiducials else None, kind=kind or ("affine" if fiducials else "rigid"),
            fle_mm=fle, leave_out=leave_out, out=out, report=report, dry_run=dry_run, yes=yes, date=today,
        ),
    )  # fmt: skip
