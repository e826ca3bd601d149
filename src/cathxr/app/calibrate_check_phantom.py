"""`cathxr calibrate check --phantom`: the tip's errors in the holes of a phantom, from sessions or on the twin."""

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.progress import track as progress
from rich.table import Table

from cathxr.app.calibrate_check_rig import write_bytes
from cathxr.app.offline import track_pairs
from cathxr.calibration.check_drawing import phantom_png
from cathxr.calibration.phantom import PhantomResult, phantom_errors
from cathxr.core import ConfigError, Image, Rig, Track
from cathxr.core.phantom import Phantom
from cathxr.storage.phantom_file import example_phantom, read_phantom
from cathxr.storage.rig_file import example_rig, read_rig
from cathxr.storage.session import SessionReader

EXAMPLE = "example"
_RATE_HZ = 10.0
_ROUNDS = 2
_DWELL_S, _TRAVEL_S = 1.2, 1.0
_COLUMNS = (
    "session", "hole", "region", "start_s", "seconds", "tracks", "hole_x_mm", "hole_y_mm", "hole_z_mm",
    "error_x_mm", "error_y_mm", "error_z_mm", "error_mm", "aligned_error_mm", "std_mm", "sigma_mm",
)  # fmt: skip


def check_phantom(
    rig_path: Path | None,
    phantom_path: str,
    *,
    sessions: Sequence[Path],
    source: str | None,
    seed: int,
    report: Path | None,
) -> None:
    """Print the errors in the phantom's holes and write them as CSV and PNG.

    Raises:
        CathxrError: something is missing, or the tip did not rest in the holes.
    """
    if bool(sessions) == (source is not None):
        raise ConfigError("Say who visited the holes: give --session (one or several), or --source twin.")
    phantom = example_phantom() if phantom_path == EXAMPLE else read_phantom(phantom_path)
    rig = None if rig_path is None else read_rig(rig_path)
    if source is not None:
        rig, named = twin_tracks(rig, phantom, seed=seed)
    else:
        named = []
        for folder in sessions:
            reader = SessionReader(folder)
            named.append((folder.name, _tracks(reader, rig)))
            rig = rig or reader.rig
    assert rig is not None
    result = phantom_errors(phantom, named)
    beside = Path("phantom_check") if rig_path is None else rig_path.with_name(f"{rig_path.stem}_calibration")
    folder = report or beside
    write_bytes(folder / "phantom_errors.csv", _csv(result).encode())
    write_bytes(folder / "phantom_errors.png", phantom_png(result, rig.roi))
    _print(result)
    click.echo(_sentence(result))
    click.echo(f"Written: {folder / 'phantom_errors.csv'} and {folder / 'phantom_errors.png'}")


def _tracks(reader: SessionReader, rig: Rig | None) -> list[Track]:
    """Return a session's Tracks: as recorded, or made anew from its Observations with another rig."""
    if rig is None:
        return list(reader.tracks())
    from cathxr.tracking import make_tracker

    tracker = make_tracker(str(reader.config.get("method", "model")), rig)
    return [tracker.update(each) for each in reader.observations()]


def twin_tracks(rig: Rig | None, phantom: Phantom, *, seed: int) -> tuple[Rig, list[tuple[str, list[Track]]]]:
    """Return (the rig tracked with, the named Tracks) of the simulated box of `seed`, whose tip visits the holes.

    rig: what is tracked with; None: the box as it truly is.

    Raises:
        ConfigError: the catheter cannot reach a hole.
    """
    from cathxr.tracking import make_tracker
    from cathxr.twin import true_rig
    from cathxr.twin.phantom import visit
    from cathxr.twin.render import CameraRenderer
    from cathxr.vision import make_detector

    box = true_rig(example_rig(), seed)
    used = rig or box
    for name, camera in used.cameras.items():
        if camera.size_px != box.cameras[name].size_px:
            raise ConfigError(
                f"The rig's {name} camera gives pictures of {camera.size_px} and the simulated box's of "
                f"{box.cameras[name].size_px}: give a rig that was calibrated on the twin, or none."
            )
    trip = visit(box, phantom, seed=seed, rounds=_ROUNDS, dwell_s=_DWELL_S, travel_s=_TRAVEL_S)
    renderers = {name: CameraRenderer(trip.world, name) for name in ("top", "front")}
    count = int((trip.end_ns - trip.world.start_ns) * 1e-9 * _RATE_HZ)
    console = Console(stderr=True)

    def pairs() -> Iterator[tuple[Image, Image]]:
        for index in progress(
            range(count), description="visiting the holes", console=console, disable=not console.is_terminal
        ):
            t_ns = trip.world.start_ns + round(index * 1e9 / _RATE_HZ)
            top, front = (Image(name, index, t_ns, each.picture(t_ns)) for name, each in renderers.items())
            yield top, front

    detectors = {name: make_detector("model", used, name) for name in renderers}
    tracker = make_tracker("model", used)
    return used, [("twin", [each.track for each in track_pairs(used, pairs(), detectors, tracker)])]


def _csv(result: PhantomResult) -> str:
    """Return one row for each visit."""
    places = {each.name: each.position_mm for each in result.phantom.holes}
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for each in result.visits:
        dwell = each.dwell
        numbers = [*places[each.hole], *each.error, np.linalg.norm(each.error), np.linalg.norm(each.aligned)]
        numbers += [np.linalg.norm(dwell.std_mm), dwell.sigma_mm]
        writer.writerow(
            [each.session, each.hole, each.region, f"{dwell.start_s:.3f}", f"{dwell.end_s - dwell.start_s:.3f}",
             dwell.count, *(f"{float(number):.4f}" for number in numbers)]
        )  # fmt: skip
    return buffer.getvalue()


def _print(result: PhantomResult) -> None:
    console = Console()
    table = Table(title=f"Tip error in the phantom {result.phantom.name!r}, mm")
    for name in ("region", "visits", "mean", "p95", "max", "mean, aligned", "max, aligned"):
        table.add_column(name, justify="left" if name == "region" else "right")
    for row in result.rows:
        numbers = (row.mean, row.p95, row.largest, row.aligned_mean, row.aligned_largest)
        table.add_row(row.region, str(row.visits), *(f"{each:.3f}" for each in numbers))
    console.print(table)
    random = "–" if result.random_mm is None else f"{result.random_mm:.3f}"
    bias = ", ".join(f"{each:+.3f}" for each in result.bias)
    console.print(
        f"Systematic {result.systematic_mm:.3f} mm (mean vector {bias}); between visits {random} mm; within a visit "
        f"{result.within_mm:.3f} mm. Tracks state {result.stated_mm:.3f} mm; the holes are known to "
        f"{result.phantom.position_std_mm:.3f} mm along each axis.\nA rigid alignment moves the phantom by "
        f"{result.moved_mm:.2f} mm and turns it by {result.turned_deg:.2f}°.",
        highlight=False,
    )
    for note in result.notes:
        console.print(f"Note: {note}", highlight=False)


def _sentence(result: PhantomResult) -> str:
    whole = result.rows[0]
    return (
        f"The tip is {whole.mean:.2f} mm off on average, {whole.p95:.2f} mm at most in 95 % of {whole.visits} visits, "
        f"{whole.largest:.2f} mm at worst."
    )
