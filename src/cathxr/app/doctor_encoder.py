"""`cathxr doctor encoder`: every port that was tried, and the board live: count, clock, losses, validity."""

import math
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import click
from rich.console import Console
from rich.live import Live
from rich.table import Table

from cathxr.app.config import Config, read_config
from cathxr.app.doctor_encoder_watch import EncoderWatch, Line
from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.app.run_command import stop_signal
from cathxr.core import Clock, ConfigError, DeviceNotFound, Rig
from cathxr.devices.clock import MonotonicClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_ports import Attempt, OpenPort, Port, SerialPort, candidates, try_port
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.storage.rig_file import example_rig, read_rig

TWIN = "twin"
_ONCE_S = 3.0
"""Long enough for the clocks' drift, which is not looked at before a second has passed."""
_READ_S = 0.1
_REFRESH_NS = 200_000_000
_BOOT_S = 0.5
_TWIN_COUNTS, _TWIN_S = 1200.0, 8.0
_MARKS = {"plain": "", "good": "[green]✓[/]", "warn": "[yellow]![/]", "bad": "[red]✕[/]"}


@dataclass(frozen=True)
class _Asked:
    """Where to look. port: None for all; is_twin: at a simulated board; has_rig: the rig is the person's own."""

    port: str | None
    is_twin: bool
    rig: Rig
    has_rig: bool


@click.command("encoder")
@click.option("--port", metavar="PORT", help="Only this serial port, as COM3; twin: a simulated board.")
@click.option("--rig", "rig_path", type=PATH, help="The rig, which turns counts into roll.")
@click.option("--config", type=PATH, help="The configuration, for its rig and its encoder's port.")
@click.option("--once", is_flag=True, help="Print one report and end: exit code 0 when all is well, else 1.")
@click.option("--source", type=click.Choice(["encoder", TWIN]), default="encoder", help="twin: as --port twin.")
@click.pass_context
@told_in_a_sentence
def encoder(
    context: click.Context, port: str | None, rig_path: Path | None, config: Path | None, once: bool, source: str
) -> None:
    """Find the roll encoder and show it live until Ctrl-C. Every port that was tried is listed, with why not.

    Opening a port restarts most boards, so leave it alone while `cathxr run` uses it.

    \b
    Examples:
      cathxr doctor encoder --rig rig.toml
      cathxr doctor encoder --port COM3 --once
      cathxr doctor encoder --port twin
    """
    asked = _asked(port, rig_path=rig_path, config=config, is_twin=TWIN in (source, port))
    clock, console = MonotonicClock(), Console()
    if asked.is_twin:
        console.print("This is a simulated board, without hardware.")
    attempt = _found(asked, clock, console)
    opened: Port = attempt.port  # type: ignore[assignment]  # a board was found
    driver = SerialEncoder(asked.rig, clock=clock, options={"port": attempt.device, "open_port": lambda name: opened})
    watch = EncoderWatch(driver, asked.rig.roll if asked.has_rig else None)
    with stop_signal() as stopping, driver:
        if once:
            _follow(driver, watch, clock, stopping, seconds=_ONCE_S)
            lines = watch.lines()
            console.print(_table(attempt.device, lines))
            if any(line.level == "bad" for line in lines):
                context.exit(FAILED)
        elif console.is_terminal:
            with Live(console=console, auto_refresh=False) as live:
                _follow(
                    driver, watch, clock, stopping,
                    show=lambda: live.update(_table(attempt.device, watch.lines()), refresh=True),
                )  # fmt: skip
        else:
            raise ConfigError("The live view needs a terminal: give --once for a report that can be written elsewhere.")


def _asked(port: str | None, *, rig_path: Path | None, config: Path | None, is_twin: bool) -> _Asked:
    chosen = Config() if config is None else read_config(config)
    path = rig_path or (None if chosen.rig is None else Path(chosen.rig))
    rig = example_rig() if path is None else read_rig(path)
    if rig.roll is None:
        raise ConfigError(f"The rig {path} has no [roll], so that counts mean nothing: add [roll] to it.")
    named = chosen.encoder.options.get("port") if port is None else port
    return _Asked(None if is_twin else named, is_twin, rig, path is not None)


def _found(asked: _Asked, clock: Clock, console: Console) -> Attempt:
    """Return the board, its port open, after printing what came of every port.

    Raises:
        DeviceNotFound: there is none, or more than one.
    """
    attempts = _attempts(asked, clock, console)
    boards = [each for each in attempts if each.port is not None]
    table = Table("port", "what it is", "what came of it", title="Ports", title_justify="left")
    for each in attempts:
        table.add_row(each.device, each.what, "[green]the roll encoder[/]" if each.port is not None else each.reason)
    if attempts:
        console.print(table)
    if len(boards) == 1:
        return boards[0]
    for each in boards:
        assert each.port is not None, "it is a board"
        each.port.close()
    if boards:
        names = " and ".join(each.device for each in boards)
        raise DeviceNotFound(f"There are {len(boards)} roll encoders, on {names}: name one with --port.")
    if asked.port is not None:
        raise DeviceNotFound(f"There is no roll encoder on {asked.port}: {attempts[0].reason}.")
    if not any(each.reason for each in attempts):
        raise DeviceNotFound("This computer has no serial port: connect the board with a USB data cable.")
    raise DeviceNotFound("No roll encoder was found: the table says why for each port; name one with --port.")


def _attempts(asked: _Asked, clock: Clock, console: Console) -> list[Attempt]:
    if asked.is_twin:
        return [try_port(TWIN, "a simulated board", clock, open_port=_twin_port(clock))]
    if asked.port is not None:
        return [try_port(asked.port, "named", clock, open_port=SerialPort)]
    there = candidates()
    likely = [each for each in there if each.usb]
    if not likely:
        return [Attempt(each.device, each.what, "not tried, as it is no USB port") for each in there]
    with (
        console.status(f"Asking {len(likely)} ports: a board may take four seconds to answer …"),
        ThreadPoolExecutor(max_workers=len(likely), thread_name_prefix="doctor") as pool,
    ):
        tried = list(pool.map(lambda each: try_port(each.device, each.what, clock, open_port=SerialPort), likely))
    others = [Attempt(each.device, each.what, "not tried, as it is no USB port") for each in there if not each.usb]
    return [*tried, *others]


def _twin_port(clock: Clock) -> OpenPort:
    """Return what opens a simulated board whose handle is turned to and fro."""

    def count_at(t_ns: int) -> int:
        return round(_TWIN_COUNTS * math.sin(2.0 * math.pi * t_ns * 1e-9 / _TWIN_S))

    return FakePort(FakeBoard(count_at, start_ns=clock.now_ns()), clock, name=TWIN, waits_s=_BOOT_S).open


def _follow(
    driver: SerialEncoder,
    watch: EncoderWatch,
    clock: Clock,
    stopping: threading.Event,
    *,
    seconds: float = math.inf,
    show: Callable[[], object] = lambda: None,
) -> None:
    """Read for so long, or until told to stop, and show how it is five times a second.

    Raises:
        DeviceError: the board has gone.
    """
    begun_ns = shown_ns = clock.now_ns()
    while not stopping.is_set():
        reading = driver.read(_READ_S)
        now_ns = clock.now_ns()
        if reading is not None:
            watch.take(reading, now_ns)
        if now_ns - shown_ns >= _REFRESH_NS:
            shown_ns = now_ns
            show()
        if now_ns - begun_ns > seconds * 1e9:
            return
    if seconds < math.inf:
        raise KeyboardInterrupt


def _table(device: str, lines: list[Line]) -> Table:
    table = Table(title=f"Roll encoder on {device}", title_justify="left", show_header=False, min_width=76)
    for each in lines:
        table.add_row(each.label, each.value, _MARKS[each.level])
    return table
