"""`cathxr doctor`: what is connected and set up, and what to do where something is missing."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.lazy_group import LazyGroup
from cathxr.app.page_options import PATH
from cathxr.core import ConfigError, Rig

_COMMANDS = {
    "encoder": ("doctor_encoder", "encoder", "Find the roll encoder and show it live."),
}
_STYLES = {"good": "green", "missing": "yellow", "wrong": "red"}


@dataclass(frozen=True)
class _Finding:
    """What one check found. level: "good", "missing" (not needed for everything) or "wrong"."""

    what: str
    level: str
    found: str
    then: str = ""


@click.group("doctor", cls=LazyGroup, commands_of=_COMMANDS, invoke_without_command=True)
@click.option("--rig", "rig_path", type=PATH, help="The rig (rig.toml) to look at.")
@click.option("--config", type=PATH, help="The configuration (config.toml) to look at.")
@click.pass_context
@told_in_a_sentence
def doctor(context: click.Context, rig_path: Path | None, config: Path | None) -> None:
    """Check what is connected and set up. Without a command: a table of all that is quick to see.

    Nothing is changed, and no port is opened: `cathxr doctor encoder` does that.

    \b
    Examples:
      cathxr doctor --rig rig.toml --config config.toml
      cathxr doctor encoder --rig rig.toml
    """
    if context.invoked_subcommand is not None:
        return
    findings = [_cameras(), _ports(), _rig(rig_path), _config(config), _page()]
    table = Table("check", "", "found", "what to do")
    for each in findings:
        table.add_row(each.what, f"[{_STYLES[each.level]}]{each.level}[/]", each.found, each.then)
    Console().print(table)
    if any(each.level == "wrong" for each in findings):
        context.exit(FAILED)


def _cameras() -> _Finding:
    from cathxr.devices.listing import list_cameras

    cameras = list_cameras()
    found = ", ".join(str(each) for each in cameras) or "none"
    if len(cameras) >= 2:
        return _Finding("cameras", "good", found, "cathxr calibrate cameras says which is which")
    return _Finding("cameras", "missing", found, "connect two; or try it all with --source twin")


def _ports() -> _Finding:
    from cathxr.devices.encoder_ports import candidates

    usb = [f"{each.device} ({each.what})" for each in candidates() if each.usb]
    if usb:
        return _Finding("encoder ports", "good", ", ".join(usb), "cathxr doctor encoder asks what is on them")
    return _Finding("encoder ports", "missing", "no USB serial port", "connect the board with a USB data cable")


def _rig(path: Path | None) -> _Finding:
    from cathxr.storage.rig_file import read_rig

    if path is None:
        return _Finding("rig", "missing", "not given", "give --rig rig.toml; the twin needs none")
    try:
        rig = read_rig(path)
    except ConfigError as error:
        return _Finding("rig", "wrong", str(path), str(error))
    dates = _measured(rig)
    open_steps = [name for name, date in dates.items() if date is None]
    found = ", ".join(f"{name} {date or 'not measured'}" for name, date in dates.items())
    if open_steps:
        return _Finding("rig", "missing", found, f"cathxr calibrate --help names the command for {open_steps[0]}")
    return _Finding("rig", "good", found)


def _measured(rig: Rig) -> dict[str, str | None]:
    """Return when each part of a rig was measured, None where it was not."""
    dates: dict[str, str | None] = {}
    for name, camera in rig.cameras.items():
        dates[f"lens {name}"] = camera.intrinsics.provenance.date
        dates[f"pose {name}"] = camera.pose_provenance.date
    if rig.roll is not None:
        dates["roll"] = rig.roll.provenance.date
    dates["timing"] = rig.timing.provenance.date
    return dates


def _config(path: Path | None) -> _Finding:
    from cathxr.app.config import read_config

    if path is None:
        return _Finding("configuration", "missing", "not given", "give --config config.toml; the twin needs none")
    try:
        config = read_config(path)
    except ConfigError as error:
        return _Finding("configuration", "wrong", str(path), str(error))
    devices = {name: getattr(config.cameras, name).get("device") for name in ("top", "front")}
    encoder = config.encoder.driver or "none"
    found = ", ".join([*(f"{name}: {device or 'none'}" for name, device in devices.items()), f"encoder: {encoder}"])
    if None in devices.values() and config.cameras.driver == "opencv":
        return _Finding("configuration", "missing", found, "cathxr calibrate cameras writes the devices")
    return _Finding("configuration", "good", found)


def _page() -> _Finding:
    there = resources.files("cathxr").joinpath("web_client", "index.html").is_file()
    if there:
        return _Finding("page", "good", "built")
    return _Finding("page", "missing", "not built", "python tools/web_client.py build, in the checkout")
