"""`cathxr doctor`: what is connected and set up, and what to do where something is missing."""

from importlib import resources
from pathlib import Path

import click

from cathxr.app.doctor_findings import Finding, show
from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.lazy_group import LazyGroup
from cathxr.app.page_options import PATH
from cathxr.core import ConfigError, Rig

_COMMANDS = {
    "box": ("doctor_box", "box", "Check light, focus and fiducials in both cameras' pictures."),
    "encoder": ("doctor_encoder", "encoder", "Find the roll encoder and show it live."),
}


@click.group("doctor", cls=LazyGroup, commands_of=_COMMANDS, invoke_without_command=True)
@click.option("--rig", "rig_path", type=PATH, help="The rig (rig.toml) to look at.")
@click.option("--config", type=PATH, help="The configuration (config.toml) to look at.")
@click.pass_context
@told_in_a_sentence
def doctor(context: click.Context, rig_path: Path | None, config: Path | None) -> None:
    """Check what is connected and set up. Without a command: a table of all that is quick to see.

    Nothing is changed, and neither camera nor port is opened: `cathxr doctor box` and `cathxr doctor encoder` do that.

    \b
    Examples:
      cathxr doctor --rig rig.toml --config config.toml
      cathxr doctor box --rig rig.toml --config config.toml
      cathxr doctor encoder --rig rig.toml
    """
    if context.invoked_subcommand is not None:
        return
    from cathxr.app.doctor_network import network_findings

    findings = [_cameras(), _ports(), _rig(rig_path), _config(config), _page(), *network_findings()]
    show(findings)
    if any(each.level == "wrong" for each in findings):
        context.exit(FAILED)


def _cameras() -> Finding:
    from cathxr.devices.listing import list_cameras

    cameras = list_cameras()
    found = ", ".join(str(each) for each in cameras) or "none"
    if len(cameras) >= 2:
        return Finding("cameras", "good", found, "cathxr calibrate cameras says which is which")
    return Finding("cameras", "missing", found, "connect two; or try it all with --source twin")


def _ports() -> Finding:
    from cathxr.devices.encoder_ports import candidates

    usb = [f"{each.device} ({each.what})" for each in candidates() if each.usb]
    if usb:
        return Finding("encoder ports", "good", ", ".join(usb), "cathxr doctor encoder asks what is on them")
    return Finding("encoder ports", "missing", "no USB serial port", "connect the board with a USB data cable")


def _rig(path: Path | None) -> Finding:
    from cathxr.storage.rig_file import read_rig

    if path is None:
        return Finding("rig", "missing", "not given", "give --rig rig.toml; the twin needs none")
    try:
        rig = read_rig(path)
    except ConfigError as error:
        return Finding("rig", "wrong", str(path), str(error))
    dates = _measured(rig)
    open_steps = [name for name, date in dates.items() if date is None]
    found = ", ".join(f"{name} {date or 'not measured'}" for name, date in dates.items())
    if open_steps:
        return Finding("rig", "missing", found, f"cathxr calibrate --help names the command for {open_steps[0]}")
    return Finding("rig", "good", found)


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


def _config(path: Path | None) -> Finding:
    from cathxr.app.config import read_config

    if path is None:
        return Finding("configuration", "missing", "not given", "give --config config.toml; the twin needs none")
    try:
        config = read_config(path)
    except ConfigError as error:
        return Finding("configuration", "wrong", str(path), str(error))
    devices = {name: getattr(config.cameras, name).get("device") for name in ("top", "front")}
    encoder = config.encoder.driver or "none"
    found = ", ".join([*(f"{name}: {device or 'none'}" for name, device in devices.items()), f"encoder: {encoder}"])
    if None in devices.values() and config.cameras.driver == "opencv":
        return Finding("configuration", "missing", found, "cathxr calibrate cameras writes the devices")
    return Finding("configuration", "good", found)


def _page() -> Finding:
    there = resources.files("cathxr").joinpath("web_client", "index.html").is_file()
    if there:
        return Finding("page", "good", "built")
    return Finding("page", "missing", "not built", "python tools/web_client.py build, in the checkout")
