"""`cathxr doctor`: what is connected and set up, and what to do where something is missing."""

from importlib import resources
from pathlib import Path

import click

from cathxr.app.doctor_findings import show
from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.lazy_group import LazyGroup
from cathxr.app.page_options import PATH
from cathxr.core import ConfigError
from cathxr.runtime.setup_nouns import SetupCheck

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
    if any(each.verdict == "wrong" for each in findings):
        context.exit(FAILED)


def _cameras() -> SetupCheck:
    from cathxr.devices.listing import list_cameras

    cameras = list_cameras()
    found = ", ".join(str(each) for each in cameras) or "none"
    if len(cameras) >= 2:
        return SetupCheck("cameras", "cameras", "good", found, "cathxr calibrate cameras says which is which")
    return SetupCheck("cameras", "cameras", "warn", found, "connect two; or try it all with --source twin")


def _ports() -> SetupCheck:
    from cathxr.devices.encoder_ports import candidates

    usb = [f"{each.device} ({each.what})" for each in candidates() if each.usb]
    if usb:
        return SetupCheck(
            "encoder", "encoder ports", "good", ", ".join(usb), "cathxr doctor encoder asks what is on them"
        )
    return SetupCheck(
        "encoder", "encoder ports", "warn", "no USB serial port", "connect the board with a USB data cable"
    )


def _rig(path: Path | None) -> SetupCheck:
    from cathxr.runtime.setup_devices import rig_check
    from cathxr.storage.rig_file import read_rig

    if path is None:
        return SetupCheck("rig", "rig", "warn", "not given", "give --rig rig.toml; the twin needs none")
    try:
        rig = read_rig(path)
    except ConfigError as error:
        return SetupCheck("rig", "rig", "wrong", str(path), str(error))
    return rig_check(rig)


def _config(path: Path | None) -> SetupCheck:
    from cathxr.app.config import read_config

    if path is None:
        return SetupCheck("rig", "configuration", "warn", "not given", "give --config config.toml; the twin needs none")
    try:
        config = read_config(path)
    except ConfigError as error:
        return SetupCheck("rig", "configuration", "wrong", str(path), str(error))
    devices = {name: getattr(config.cameras, name).get("device") for name in ("top", "front")}
    encoder = config.encoder.driver or "none"
    found = ", ".join([*(f"{name}: {device or 'none'}" for name, device in devices.items()), f"encoder: {encoder}"])
    if None in devices.values() and config.cameras.driver == "opencv":
        return SetupCheck("rig", "configuration", "warn", found, "cathxr calibrate cameras writes the devices")
    return SetupCheck("rig", "configuration", "good", found)


def _page() -> SetupCheck:
    there = resources.files("cathxr").joinpath("web_client", "index.html").is_file()
    if there:
        return SetupCheck("network", "page", "good", "built")
    return SetupCheck("network", "page", "warn", "not built", "python tools/web_client.py build, in the checkout")
