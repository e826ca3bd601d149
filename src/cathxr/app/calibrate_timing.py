"""`cathxr calibrate timing`: the delays between the cameras and to the encoder, from a motion to and fro."""

import datetime
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from cathxr.app.calibrate_check import report_folder
from cathxr.app.calibrate_check_rig import write_bytes
from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH
from cathxr.core import ConfigError, Detection, Reading, Rig, Timing
from cathxr.storage.rig_file import read_rig, write_rig


@click.command("timing")
@click.option("--rig", "rig_path", required=True, type=PATH, help="The rig (rig.toml).")
@click.option("--session", type=PATH, help="A recorded session of such a motion.")
@click.option("--source", type=click.Choice(["twin", "cameras"]), help="Or measure now, on the twin or the cameras.")
@click.option("--config", type=PATH, help="With --source: which devices (config.toml).")
@click.option(
    "--seconds", type=click.FloatRange(8.0, 120.0), default=12.0, show_default=True, help="With --source: how long."
)
@click.option("--seed", type=click.IntRange(min=0), help="The twin's seed.  [default: 0]")
@click.option("--report", type=PATH, help="Where the picture goes.  [default: <rig>_calibration]")
@click.option("--dry-run", is_flag=True, help="Write no rig.")
@told_in_a_sentence
def timing(
    rig_path: Path,
    session: Path | None,
    source: str | None,
    config: Path | None,
    seconds: float,
    seed: int | None,
    report: Path | None,
    dry_run: bool,
) -> None:
    """Measure the delay between the cameras and of the encoder, and write them into the rig as [timing].

    Bend the tip by a quarter turn and keep the bend. Then, for 12 s, push and pull the catheter by some centimetres
    while you turn it to and fro by a quarter turn or more, about every two seconds.

    \b
    Example:
      cathxr calibrate timing --rig rig.toml --source cameras --config config.toml
      cathxr calibrate timing --rig rig.toml --session recordings/to_and_fro
    """
    if (session is None) == (source is None):
        raise ConfigError("Say where the motion comes from: give either --session, or --source twin or cameras.")
    rig = read_rig(rig_path)
    if session is not None:
        detections, readings, recorded = _from_session(session)
    else:
        from cathxr.app.calibrate_timing_live import measured_live

        assert source is not None
        detections, readings = measured_live(source, rig_path, config=config, seconds=seconds, seed=seed)
        recorded = rig.timing
    from cathxr.calibration.check_drawing import timing_png
    from cathxr.calibration.timing import calibrate_timing

    date = datetime.date.today().isoformat()
    result = calibrate_timing(rig, detections, readings, recorded=recorded, date=date)
    folder = report or report_folder(rig_path)
    write_bytes(folder / "timing.png", timing_png(result))
    _print(rig, recorded, result.rig.timing, has_encoder=result.encoder is not None)
    for warning in result.warnings:
        click.echo(f"Note: {warning}")
    if rig.roll is not None and not readings:
        click.echo("Note: no encoder reading was recorded; only the cameras' offset was measured.")
    click.echo(_sentence(result.rig.timing, result.cameras.lag_s, result.cameras.std_s))
    click.echo(f"Picture: {folder / 'timing.png'}")
    if dry_run:
        click.echo("Dry run: the rig is left as it is.")
        return
    write_rig(rig_path, result.rig, backup=True)
    click.echo(f"Written: {rig_path}; the earlier rig is kept beside it.")


def _from_session(folder: Path) -> tuple[list[Detection], list[Reading], Timing]:
    """Return (detections of both cameras, encoder reports, the [timing] that their stamps already carry)."""
    from cathxr.storage.session import SessionReader

    reader = SessionReader(folder)
    detections = [each for observation in reader.observations() for each in observation.detections]
    return detections, list(reader.readings()), reader.rig.timing


def _print(rig: Rig, before: Timing, after: Timing, *, has_encoder: bool) -> None:
    table = Table(title="Delays")
    for name in ("", "before, ms", "now, ms", "change, ms", "± ms"):
        table.add_column(name, justify="left" if not name else "right")
    rows = [("front camera after top camera", "front_offset_s")]
    if has_encoder:
        rows.append(("encoder after top camera", "encoder_latency_s"))
    for label, key in rows:
        old, new = (1e3 * getattr(each, key) for each in (before, after))
        std = 1e3 * float(np.asarray(after.provenance.std[key]))
        table.add_row(label, f"{old:+.2f}", f"{new:+.2f}", f"{new - old:+.2f}", f"{std:.2f}")
    Console().print(table)


def _sentence(after: Timing, change_s: float, std_s: float) -> str:
    if abs(change_s) < max(3.0 * std_s, 5e-4):
        return "Good: the delays in the rig hold."
    offset = 1e3 * after.front_offset_s
    return f"The front camera's stamps come {offset:+.1f} ms after the top camera's, and the rig is to say so."
