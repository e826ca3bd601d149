"""`cathxr calibrate cameras`: which device is top and which is front, and their settings, locked."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH, PageChoice, page_options
from cathxr.core import ConfigError


@click.command("cameras")
@click.option("--config", type=PATH, help="The configuration to write into (config.toml); made where it is not there.")
@click.option("--rig", "rig_path", type=PATH, help="The rig, whose fiducials suggest which camera is which.")
@click.option(
    "--source",
    type=click.Choice(["cameras", "twin"]),
    default="cameras",
    show_default=True,
    help="twin: try it without hardware.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="The twin's seed.")
@click.option("--list", "only_list", is_flag=True, help="Print the cameras found, and end.")
@click.option("--top", metavar="DEVICE", help="Without the page: the top camera (an index or a path); needs --front.")
@click.option("--front", metavar="DEVICE", help="Without the page: the front camera; needs --top.")
@page_options
@told_in_a_sentence
def cameras(
    config: Path | None,
    rig_path: Path | None,
    source: str,
    seed: int,
    only_list: bool,
    top: str | None,
    front: str | None,
    port: int,
    lan: bool,
    no_browser: bool,
) -> None:
    """Say which device is the top camera and which is the front one, and lock exposure, gain, focus and white balance.

    The page shows every camera found. Choose, or let the fiducials tell (both crosses in the box, --rig given), set the
    light for use, and save: each camera settles on automatic and is then fixed where it stands. A camera's name is the
    socket it is plugged into, so leave it there.

    \b
    Examples:
      cathxr calibrate cameras --list
      cathxr calibrate cameras --config config.toml --rig rig.toml
      cathxr calibrate cameras --config config.toml --top /dev/video0 --front /dev/video2
      cathxr calibrate cameras --config trial.toml --source twin
    """  # fmt: skip
    # Imported here: loading OpenCV and what finds the fiducials takes seconds that --help need not wait for.
    from cathxr.app import camera_calibration

    if only_list:
        camera_calibration.print_list()
        return
    if config is None:
        raise ConfigError("Give the configuration to write into with --config config.toml; --list prints the cameras.")
    if top is None and front is None:
        page = PageChoice(port, lan, not no_browser)
        camera_calibration.with_page(config, rig_path=rig_path, source=source, seed=seed, page=page)
        return
    if top is None or front is None:
        raise ConfigError("Without the page both cameras are needed: give --top and --front.")
    if source != "cameras":
        raise ConfigError("The twin's cameras are chosen on the page: leave --top and --front out.")
    camera_calibration.without_page(config, {"top": top, "front": front}, rig_path=rig_path)
