"""`cathxr doctor box`: light, focus and fiducials of both cameras, each with what to do."""

from collections.abc import Iterator
from pathlib import Path

import click

from cathxr.app.doctor_findings import Finding, show
from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.core import ConfigError, PixelArray, Rig


@click.command("box")
@click.option("--rig", "rig_path", type=PATH, help="The rig: the nominal one of `hardware export` will do.")
@click.option("--config", type=PATH, help="The configuration that names the cameras (config.toml).")
@click.option(
    "--source",
    type=click.Choice(["cameras", "twin"]),
    default="cameras",
    show_default=True,
    help="Where pictures come from when none are given.",
)
@click.option("--top", type=PATH, help="A picture of the top camera, in place of one taken now.")
@click.option("--front", type=PATH, help="A picture of the front camera.")
@click.option("--crosses", is_flag=True, help="Both crosses are in and lit from the front: look for the fiducials.")
@click.pass_context
@told_in_a_sentence
def box(
    context: click.Context,
    rig_path: Path | None,
    config: Path | None,
    source: str,
    top: Path | None,
    front: Path | None,
    crosses: bool,
) -> None:
    """Check exposure, back-light and focus of the empty box; with --crosses, which fiducials each camera sees.

    \b
    Examples:
      cathxr doctor box --rig rig.toml --config config.toml
      cathxr doctor box --rig rig.toml --config config.toml --crosses
      cathxr doctor box --source twin
    """  # fmt: skip
    from cathxr.app.calibrate_markers_inputs import live_pictures, read_pictures
    from cathxr.storage.rig_file import example_rig, read_rig

    given = {name: path for name, path in (("top", top), ("front", front)) if path is not None}
    if rig_path is None and source != "twin":
        raise ConfigError("Give the rig with --rig rig.toml: it says where in a picture the box is.")
    rig = example_rig() if rig_path is None else read_rig(rig_path)
    if given:
        taken = read_pictures(rig, {name: [path] for name, path in given.items()})
    else:
        taken = live_pictures(rig, source, config=config, seed=None, scene="pillars" if crosses else "empty")
    findings = [
        finding
        for name, pictures in taken.items()
        for finding in (_markers if crosses else _light)(rig, name, pictures[0].pixels)
    ]
    show(findings)
    if any(each.level == "wrong" for each in findings):
        context.exit(FAILED)


def _light(rig: Rig, name: str, pixels: PixelArray) -> Iterator[Finding]:
    from cathxr.calibration import picture_checks as limits

    found = limits.light_and_focus(pixels, rig.cameras[name], rig.roi)
    low, high = limits.LEVELS
    what, told = (
        f"exposure, {name}",
        f"brightest part {100 * found.level:.0f} %, {100 * found.saturated:.2f} % saturated",
    )
    if found.saturated > limits.MOST_SATURATED or found.level > high:
        yield Finding(what, "wrong", told, "shorten the exposure or dim the back light")
    elif found.level < low:
        yield Finding(what, "wrong", told, "is the back light on? lengthen the exposure or turn it up")
    else:
        yield Finding(what, "good", told)
    what, told = f"back light, {name}", f"darkest over brightest part of the ROI: {found.evenness:.2f}"
    if found.evenness < limits.LEAST_EVENNESS:
        yield Finding(what, "wrong", told, "look for LED rows that are out, and at the camera's distance and tilt")
    else:
        yield Finding(what, "good", told)
    what = f"focus, {name}"
    if found.blur_px is None:
        yield Finding(what, "missing", "no edge to tell by", "put the inlet in; its edge is what is looked at")
    elif found.blur_px > limits.MOST_BLUR_PX:
        yield Finding(what, "wrong", f"edges {found.blur_px:.1f} px wide", "turn the lens until the inlet is sharpest")
    else:
        yield Finding(what, "good", f"edges {found.blur_px:.1f} px wide")


def _markers(rig: Rig, name: str, pixels: PixelArray) -> Iterator[Finding]:
    from cathxr.calibration.marker_finding import find_markers

    seen = find_markers(rig, name, pixels)
    own = [each.name for each in rig.markers.get(name, ())]
    found = [each.name for each in seen.markers]
    told = f"{len(found)} of {sum(len(each) for each in rig.markers.values())}: {', '.join(found) or 'none'}"
    what = f"fiducials, {name}"
    if seen.problem is not None:
        yield Finding(what, "wrong", told, seen.problem)
    elif missing := [each for each in seen.missing if each in own]:
        yield Finding(what, "missing", told, f"not seen: {', '.join(missing)}; light them, clean them, move the finger")
    else:
        yield Finding(what, "good", told)
