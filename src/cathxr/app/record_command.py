"""`cathxr record`: a session without a page, from the twin or from cameras."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.live_options import PATH, chosen_config, live_options
from cathxr.app.run_command import leave, prepare, stop_signal
from cathxr.core import ConfigError, DataError, DeviceError, RollStatus

_POLL_S = 0.1
_WRITE_S = 120.0
_PICTURES_S = 20.0
"""How long cameras may take to open before a recording is given up."""
_ENCODER_S = 8.0
"""How long an encoder may take to be found before the recording begins without it."""
_CONFIRMED_S = 2.0


@click.command("record")
@live_options
@click.option("--out", required=True, type=PATH, help="The session's folder; it must not exist yet.")
@click.option("--seconds", type=click.FloatRange(min=0.5), default=30.0, show_default=True, help="How long.")
@click.option("--video", is_flag=True, help="Record the pictures too (lossless).")
@click.option(
    "--roll-confirmed",
    is_flag=True,
    help="Roll is right: the handle was not turned while the encoder restarted, as it does when it is opened.",
)
@told_in_a_sentence
def record(
    source: str,
    rig: Path | None,
    config: Path | None,
    method: str | None,
    points: int | None,
    scene: str | None,
    seed: int | None,
    out: Path,
    seconds: float,
    video: bool,
    roll_confirmed: bool,
) -> None:
    """Record a session without a page; on the twin with the exact truth beside it. Ctrl-C ends it early.

    \b
    Example:
      cathxr record --source twin --seconds 10 --out recordings/first
    """
    if source not in ("twin", "cameras"):
        raise ConfigError(f"Only the twin or cameras can be recorded, not '{source}': give --source twin or cameras.")
    if out.exists():
        raise ConfigError(f"{out} exists already: give --out a folder that does not.")
    chosen = chosen_config(config, rig=rig, method=method, points=points, scene=scene, seed=seed)
    recording = chosen.recording.model_copy(update={"folder": str(out.parent), "videos": video})
    chosen = chosen.model_copy(update={"recording": recording})
    from cathxr.app.live_parts import live_parts
    from cathxr.devices.clock import MonotonicClock
    from cathxr.runtime.live import LiveSystem

    parts = live_parts(source, chosen, clock=MonotonicClock())
    prepare(chosen.tracking, parts.rig)
    with stop_signal() as stopping:
        system = LiveSystem(parts.source, clock=MonotonicClock(), options=parts.options)
        if parts.optical is not None:
            parts.optical.readings.add("recorder", system.take_reading)
        failures: list[str] = []
        system.events.add(
            "console",
            lambda event: failures.append(str(event.payload["sentence"])) if event.kind == "recording_failed" else None,
        )
        console = Console(stderr=True)
        columns = (TextColumn("recording"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[pairs]}"))
        with system, Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
            task = bar.add_task("recording", total=seconds, pairs="")
            _wait_for_pictures(system, stopping)
            _wait_for_roll(system, stopping, confirmed=roll_confirmed)
            system.handle("record_start", {"name": out.name})
            while not (stopping.wait(_POLL_S) or failures or system.ended):
                state = system.recording_state()
                bar.update(task, completed=min(state.seconds, seconds))
                if state.seconds >= seconds:
                    break
            if failures:
                raise DataError(failures[0])
            summary = system.handle("record_stop", {})
            # lossless video may lag behind the cameras: nothing is dropped that was taken
            if not system.wait_written(_WRITE_S):
                raise DataError(f"{out} was not written to its end within {_WRITE_S:.0f} s; what is there can be read.")
    lost = summary["lost_pairs"] + summary["lost_items"] + summary["lost_pictures"]
    click.echo(f"{summary['pairs']} pairs in {summary['seconds']:.1f} s, {lost} items lost. Session: {out}")
    leave(ended=system.stop())


def _wait_for_pictures(system: Any, stopping: threading.Event) -> None:
    """Return when pictures of both cameras come: a recording begins with pictures, not with cameras being opened.

    Raises:
        DeviceError: none come; the sentence says what each source says of itself.
    """
    came = threading.Event()
    system.moments.add("record", lambda moment: came.set() if len(moment.images) > 1 else None)
    deadline_s = time.monotonic() + _PICTURES_S
    while not (came.wait(_POLL_S) or stopping.is_set()):
        if time.monotonic() > deadline_s:
            said = "; ".join(
                f"{each.source}: {each.last_error}" for each in system.health_report().sources if each.last_error
            )
            raise DeviceError(
                f"No pictures came from both cameras within {_PICTURES_S:.0f} s ({said or 'no error known'})."
            )
    system.moments.remove("record")


def _wait_for_roll(system: Any, stopping: threading.Event, *, confirmed: bool) -> None:
    """Return when the roll is valid or will not be, and say so then. confirmed: what a person says of it."""
    _wait(stopping, _ENCODER_S, lambda: _is_settled(system.roll_status()))
    if confirmed and system.roll_status().needs == "confirm":
        system.handle("roll_confirm", {})
        _wait(stopping, _CONFIRMED_S, lambda: system.roll_status().valid)
    status = system.roll_status()
    if not status.valid and status.sentence:
        way = " With --roll-confirmed the recording has roll." if status.needs == "confirm" else ""
        click.echo(f"Recording without roll. {status.sentence}{way}", err=True)


def _is_settled(status: RollStatus) -> bool:
    """Return whether waiting changes nothing: it is valid, needs a person, or there is no encoder."""
    return status.valid or bool(status.needs) or not (status.present or status.sentence)


def _wait(stopping: threading.Event, seconds: float, until: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + seconds
    while not until() and time.monotonic() < deadline_s and not stopping.wait(_POLL_S):
        pass
