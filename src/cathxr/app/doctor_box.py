"""`cathxr doctor box`: light, focus and fiducials of both cameras, and which is which, each with what to do."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import click

from cathxr.app.doctor_findings import show
from cathxr.app.errors import FAILED, told_in_a_sentence
from cathxr.app.page_options import PATH
from cathxr.core import ConfigError, PixelArray, Rig
from cathxr.runtime.setup_nouns import SetupCheck


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
    """Check exposure, back-light and focus of the empty box; with --crosses, which fiducials each camera
    sees, and which camera is which by them.

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
    findings = tuple(_found(rig, {name: each[0].pixels for name, each in taken.items()}, crosses=crosses))
    show(findings)
    if any(each.verdict == "wrong" for each in findings):
        context.exit(FAILED)


def _found(rig: Rig, pictures: Mapping[str, PixelArray], *, crosses: bool) -> Iterator[SetupCheck]:
    """Yield what the pictures say; which camera is which is told by both pictures with both crosses."""
    from cathxr.runtime import setup_pictures as checks

    known = {name: pictures[name] for name in checks.CAMERAS if name in pictures}
    if not crosses:
        for name, pixels in known.items():
            yield from checks.light_checks(rig, name, pixels)
        return
    for sighting in checks.sightings(rig, known).values():
        yield checks.marker_check(rig, sighting)
    if len(known) == len(checks.CAMERAS):
        yield checks.which_check(rig, known)
