"""`cathxr heart build`: from a CT series, or from ready labels, to a heart folder."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.page_options import PATH


@click.command("build")
@click.argument("path", type=PATH)
@click.option("--out", type=PATH, required=True, metavar="HEART/", help="The heart folder to make, or to make anew.")
@click.option("--phase", help="The cardiac phase of a multi-phase series, as `cathxr heart info` names it.")
@click.option("--series", type=click.IntRange(min=0), help="The series, as `cathxr heart info` numbers it.")
@click.option("--labels", type=PATH, metavar="MASK", help="Take these labels in place of a segmentation.")
@click.option("--names", type=PATH, metavar="FILE", help="What the values of MASK stand for (TOML or CSV).")
@click.option("--seeds", type=PATH, metavar="CSV", help="Correct the segmentation by these seeds.")
@click.option(
    "--budget", type=click.IntRange(min=1000), default=150_000, show_default=True, help="Triangles of all surfaces."
)
@click.option("--name", default="", help="What the heart is called; no patient's name.")
@told_in_a_sentence
def build(
    path: Path,
    out: Path,
    phase: str | None,
    series: int | None,
    labels: Path | None,
    names: Path | None,
    seeds: Path | None,
    budget: int,
    name: str,
) -> None:
    """Make a heart folder from the CT at PATH: a DICOM folder or ZIP archive, NIfTI or NRRD.

    With --labels the structures are taken as they are: a label map, a DICOM segmentation, a TotalSegmentator folder
    or a folder of STL parts. Where there is no CT, give the labels twice: as PATH and as --labels.
    Look at quality.html in the folder before you use the heart.

    \b
    Examples:
      cathxr heart build ct_series/ --out heart/
      cathxr heart build ct_series/ --out heart/ --phase 75 --seeds seeds.csv
      cathxr heart build cta.nii.gz --labels totalsegmentator/ --out heart/
    """
    from cathxr.app.heart_build_run import BuildChoice, build_and_tell

    build_and_tell(
        BuildChoice(
            path=path,
            out=out,
            phase=phase,
            series=series,
            labels=labels,
            names=names,
            seeds=seeds,
            budget=budget,
            name=name,
        )
    )
