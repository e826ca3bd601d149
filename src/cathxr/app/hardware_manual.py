"""`cathxr hardware manual`: pictures, figures and bill of docs/build, from the solids that are printed."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click
import cv2

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.hardware_file import read_checked
from cathxr.app.hardware_params import PARAMS_OPTION
from cathxr.app.hardware_progress import shown_progress
from cathxr.app.hardware_tables import figures_text
from cathxr.app.hardware_views import VIEWS, bodies_of
from cathxr.app.page_options import PATH
from cathxr.core import DataError
from cathxr.hardware.bill import bill_markdown, bill_rows
from cathxr.hardware.render import picture, view_axes
from cathxr.hardware.wiring import wiring_svg
from cathxr.storage.atomic import os_reason

_DRAWINGS = (
    "beam", "corner_right", "inlet_holder", "camera_carrier", "cross_top", "cross_leg", "jig", "phantom",
    "catheter_gear", "encoder_gear", "catheter_lock", "roll_base", "encoder_plate", "rail_bracket",
)  # fmt: skip


@click.command("manual")
@click.option("--out", type=PATH, required=True, metavar="DIR", help="The manual's folder; it must exist.")
@PARAMS_OPTION
@told_in_a_sentence
def manual(out: Path, params_path: Path | None) -> None:
    """Make what the building manual shows: renders step by step, drawings, wiring, figures, bill, the twin's pictures.

    DIR gets figures.md, bill.md and the folder images.

    \b
    Examples:
      cathxr hardware manual --out docs/build
    """
    layout, _ = read_checked(params_path)
    if not out.is_dir():
        raise DataError(f"{out}: there is no such folder; make it first.")
    with shown_progress() as report:
        report("Loading the CAD kernel", None)
        from cathxr.hardware.cad.assembly import rig_3d
        from cathxr.hardware.cad.checks import mesh_of
        from cathxr.hardware.cad.drawing import three_views
        from cathxr.hardware.cad.export import made_parts

        report("Making the solids", None)
        rig = rig_3d(layout)
        meshes = {key: mesh_of(part.solid, tolerance_mm=0.15) for key, part in rig.parts.items()}
        images = out / "images"
        try:
            images.mkdir(exist_ok=True)
            _write_text(out / "figures.md", figures_text(layout))
            _write_text(out / "bill.md", bill_markdown(layout, bill_rows(layout, made_parts(rig))))
            _write_text(images / "wiring.svg", wiring_svg(layout))
            _renders(rig, meshes, images, report)
            for index, key in enumerate(_DRAWINGS):
                report("Drawing parts", index / len(_DRAWINGS))
                part = rig.parts[key]
                _write_text(images / f"drawing_{key}.svg", three_views(part.solid, part.title))
            report("Looking through the twin's cameras", None)
            _twin_pictures(rig, images)
        except OSError as error:
            raise DataError(f"{out}: cannot write the manual ({os_reason(error)}); check the folder.") from error
    click.echo(f"Written: the manual's figures, bill and pictures in {out}")


def _renders(rig: Any, meshes: Mapping[str, Any], out: Path, report: Callable[[str, float | None], None]) -> None:
    """Write every render."""
    for index, view in enumerate(VIEWS):
        report("Rendering", index / len(VIEWS))
        _write(out / f"{view.name}.png", picture(bodies_of(view, rig, meshes), view_axes(view.eye)))


def _twin_pictures(rig: Any, out: Path) -> None:
    """Write what both cameras see in the twin of the nominal rig, with the frame put into its scene."""
    from cathxr.app.hardware_twin import twin_pictures

    for name, pixels in twin_pictures(rig.layout).items():
        _write(out / f"{name}.png", pixels)


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _write(path: Path, pixels: Any) -> None:
    good, data = cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    if not good:
        raise DataError(f"{path}: the picture could not be coded.")
    path.write_bytes(data.tobytes())
