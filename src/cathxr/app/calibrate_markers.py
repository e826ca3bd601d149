"""`cathxr calibrate markers`: pictures of the fiducials in, the cameras' poses with their errors into the rig."""

import datetime
import sys
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console

from cathxr.app.calibrate_markers_inputs import TakenPicture, live_pictures, read_pictures
from cathxr.app.calibrate_markers_report import Report, print_result
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PageChoice, page_options
from cathxr.app.patience import said_when_compiling
from cathxr.calibration.pose_view import known_markers
from cathxr.calibration.poses import PosesResult, calibrate_poses
from cathxr.calibration.sighting import Sighting
from cathxr.core import CalibrationError, ConfigError, Rig
from cathxr.storage.atomic import check_writable
from cathxr.storage.rig_file import read_rig, write_rig

_PATH = click.Path(path_type=Path)


@click.command("markers")
@click.option("--rig", "rig_path", required=True, type=_PATH, help="The rig to measure (rig.toml), lenses calibrated.")
@click.option("--top", multiple=True, type=_PATH, help="A picture of the top camera; again for more of the same scene.")
@click.option("--front", multiple=True, type=_PATH, help="A picture of the front camera, likewise.")
@click.option("--source", type=click.Choice(["twin", "cameras"]), help="Take the pictures now, instead of files.")
@click.option("--config", type=_PATH, help="Which devices the cameras are (config.toml), for --source cameras.")
@click.option("--seed", type=click.IntRange(min=0), help="The twin's seed: where its cameras really are.  [default: 0]")
@click.option("--click", "by_hand", is_flag=True, help="Place the fiducials on a page in the browser.")
@click.option("--report", type=_PATH, help="Folder for the pictures.  [default: <rig>_calibration beside the rig]")
@click.option("--dry-run", is_flag=True, help="Measure and report, and leave the rig as it is.")
@click.option("--yes", is_flag=True, help="Write the rig in spite of warnings, without asking.")
@page_options
@told_in_a_sentence
def markers(
    rig_path: Path,
    top: tuple[Path, ...],
    front: tuple[Path, ...],
    source: str | None,
    config: Path | None,
    seed: int | None,
    by_hand: bool,
    report: Path | None,
    dry_run: bool,
    yes: bool,
    port: int,
    lan: bool,
    no_browser: bool,
) -> None:
    """Measure where the cameras are, with the fiducials on the removable crosses.

    Put in one cross before its own camera, or both at once (each camera then uses all eight, which is three times
    better); light them from the front. Give --top or --front again for more pictures: one cross each, or several of the
    same. Calibrate the lenses first: calibrate intrinsics.

    \b
    Examples:
      cathxr calibrate markers --rig rig.toml --top top.png --front front.png
      cathxr calibrate markers --rig rig.toml --source cameras --config config.toml
      cathxr calibrate markers --rig rig.toml --top top.png --front front.png --click
      cathxr calibrate markers --rig rig.toml --source twin --dry-run
    """
    rig = read_rig(rig_path)
    _check_options(rig_path, rig, top + front, source, config, seed)
    if not dry_run:
        check_writable(rig_path, what="the rig")
    if source is None:
        pictures = read_pictures(rig, {"top": top, "front": front})
    else:
        pictures = live_pictures(rig, source, config=config, seed=seed)
    folder = report or rig_path.with_name(f"{rig_path.stem}_calibration")
    if by_hand:
        # Loaded here: the server and its page are not needed otherwise.
        from cathxr.app.calibrate_markers_click import calibrate_markers_click

        by_camera = {name: [each.pixels for each in taken] for name, taken in pictures.items()}
        calibrate_markers_click(
            rig_path, by_camera, report=folder, dry_run=dry_run, page=PageChoice(port, lan, not no_browser)
        )
        return
    sheets = Report(folder)
    console = Console()
    with said_when_compiling():
        sightings = [_sighting(rig, name, taken, sheets) for name, taken in pictures.items()]
    result = _solved(rig, sightings, sheets)
    sheets.add_result(result)
    sheets.write()
    print_result(console, result, sheets.paths)
    _write(rig_path, result, dry_run=dry_run, yes=yes)


def _check_options(
    rig_path: Path,
    rig: Rig,
    files: Sequence[Path],
    source: str | None,
    config: Path | None,
    seed: int | None,
) -> None:
    """Return when the options belong together.

    Raises:
        ConfigError: they do not, or the rig has no fiducials.
    """
    if source is None and not files:
        raise ConfigError("Give pictures with --top and --front, or take them now with --source cameras (or twin).")
    if source is not None and files:
        raise ConfigError("Give pictures with --top and --front, or take them with --source: not both.")
    if source != "cameras" and config is not None:
        raise ConfigError("--config says which devices the cameras are: it goes with --source cameras only.")
    if source != "twin" and seed is not None:
        raise ConfigError("--seed says where the twin's cameras are: it goes with --source twin only.")
    try:
        known_markers(rig)
    except CalibrationError as error:
        raise ConfigError(f"{rig_path}: {error}") from error


def _sighting(rig: Rig, camera: str, taken: Sequence[TakenPicture], sheets: Report) -> Sighting:
    """Return what was found in all pictures of a camera; what was found in each goes into the report."""
    from cathxr.calibration.marker_clicks import merged
    from cathxr.calibration.marker_finding import find_markers

    sightings = []
    for number, each in enumerate(taken, 1):
        try:
            sighting = find_markers(rig, camera, each.pixels)
        except CalibrationError as error:
            raise CalibrationError(f"{each.name}: {error}") from error
        sightings.append(sighting)
        sheets.add_sighting(camera if len(taken) == 1 else f"{camera}_{number}", each.pixels, sighting)
    return sightings[0] if len(sightings) == 1 else merged(sightings)


def _solved(rig: Rig, sightings: Sequence[Sighting], sheets: Report) -> PosesResult:
    """Return the poses; where there are none, the report's pictures are written and named in the error.

    Raises:
        CalibrationError: see `calibrate_poses`.
    """
    problems = [each.problem for each in sightings if each.problem is not None]
    try:
        if problems:
            raise CalibrationError(" ".join(problems))
        return calibrate_poses(rig, sightings, date=datetime.date.today().isoformat())
    except CalibrationError as error:
        sheets.write()
        named = " and ".join(str(path) for path in sheets.paths)
        raise CalibrationError(f"{error} The rig is untouched; what was found is drawn in {named}.") from error


def _write(rig_path: Path, result: PosesResult, *, dry_run: bool, yes: bool) -> None:
    """Write the rig, unless a person does not want to.

    Raises:
        CalibrationError: there are warnings, nobody to ask, and no --yes.
    """
    if dry_run:
        click.echo(f"Nothing was written into {rig_path} (--dry-run).")
        return
    if result.warnings and not yes:
        if not sys.stdin.isatty():
            raise CalibrationError(
                f"{rig_path} is untouched because of the warning{'s' if len(result.warnings) > 1 else ''} above: "
                "correct what causes it, or add --yes to write these poses nevertheless."
            )
        if not click.confirm(f"Write these poses into {rig_path} in spite of the warnings?"):
            raise CalibrationError(f"{rig_path} is untouched, as you chose.")
    write_rig(rig_path, result.rig, backup=True)
    click.echo(f"The poses are in {rig_path}; the earlier file is beside it.")
