"""`cathxr heart seeds`: a page on which a person corrects the segmentation of a heart by seeds."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH, PageChoice, page_options


@click.command("seeds")
@click.argument("path", type=PATH)
@click.option("--labels", type=PATH, metavar="MASK", help="Begin with ready labels in place of a segmentation.")
@click.option("--names", type=PATH, help="What the values of MASK stand for (TOML or CSV).")
@click.option("--phase", help="The cardiac phase of a multi-phase series, as `cathxr heart info` names it.")
@click.option("--series", type=click.IntRange(min=0), help="The series, as `cathxr heart info` numbers it.")
@click.option("--seeds", type=PATH, metavar="CSV", help="Begin with these seeds; without it, with those of --out.")
@click.option("--out", type=PATH, default=Path("seeds.csv"), show_default=True, help="Where the seeds are written.")
@click.option("--build", type=PATH, metavar="HEART/", help="When done, build this heart folder with the seeds.")
@click.option("--name", default="", help="The heart's name in the folder that --build makes; no patient's name.")
@page_options
@told_in_a_sentence
def seeds(
    path: Path, labels: Path | None, names: Path | None, phase: str | None, series: int | None, seeds: Path | None,
    out: Path, build: Path | None, name: str, port: int, lan: bool, no_browser: bool,
) -> None:  # fmt: skip
    """Correct a heart's segmentation on a page: slices of the CT at PATH with the labels over them.

    Choose a structure and click where it truly is; segment again to see what the seed does; save. The file of seeds is
    what `cathxr heart build --seeds` takes.

    \b
    Examples:
      cathxr heart seeds ct_series/ --out seeds.csv
      cathxr heart seeds cta.nii.gz --labels mask.nii.gz --out seeds.csv
      cathxr heart seeds ct_series/ --out seeds.csv --build heart/ --lan     from a tablet
    """
    from cathxr.app.heart_seeds_run import SeedsChoice, place_seeds

    choice = SeedsChoice(
        path, out=out, labels=labels, names=names, phase=phase, series=series, seeds=seeds, build=build, name=name,
        page=PageChoice(port, lan, not no_browser),
    )  # fmt: skip
    place_seeds(choice)
