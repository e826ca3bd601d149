"""`cathxr hardware manual`: the pictures of docs/build, from the same solids as the files that are printed."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.hardware_file import read_checked
from cathxr.app.hardware_params import PARAMS_OPTION
from cathxr.app.hardware_progress import shown_progress
from cathxr.app.page_options import PATH
from cathxr.core import DataError, FloatArray
from cathxr.hardware.layout import Layout
from cathxr.hardware.render import Drawn, picture, view_axes
from cathxr.storage.atomic import os_reason

_DRAWINGS = (
    "beam", "corner_right", "inlet_holder", "camera_carrier", "cross_top", "cross_leg", "jig", "phantom",
    "catheter_gear", "encoder_gear", "catheter_lock", "roll_base", "encoder_plate", "rail_bracket",
)  # fmt: skip
_APART: Mapping[str, tuple[float, float]] = {
    "inlet": (-110.0, 0.0), "roll": (-190.0, 0.0), "panels": (0.0, 75.0), "light": (0.0, 75.0), "camera": (0.0, 40.0),
}  # fmt: skip
"""How far groups are moved in the exploded view: along x, and along the normal of the face that they belong to."""
_ISO, _LOW, _NEAR = (-0.62, -0.85, 0.55), (-0.75, -0.55, -0.45), (-0.5, -0.8, 0.75)


@click.command("manual")
@click.option("--out", type=PATH, required=True, metavar="DIR", help="The folder for the pictures; it must exist.")
@PARAMS_OPTION
@told_in_a_sentence
def manual(out: Path, params_path: Path | None) -> None:
    """Make the pictures of the building manual: renders, an exploded view, drawings, and what the cameras see.

    \b
    Examples:
      cathxr hardware manual --out docs/build/images
    """
    layout, _ = read_checked(params_path)
    if not out.is_dir():
        raise DataError(f"{out}: there is no such folder; make it first.")
    with shown_progress() as report:
        report("Loading the CAD kernel", None)
        from cathxr.hardware.cad.assembly import rig_3d
        from cathxr.hardware.cad.checks import mesh_of
        from cathxr.hardware.cad.drawing import three_views

        report("Making the solids", None)
        rig = rig_3d(layout)
        meshes = {key: mesh_of(part.solid, tolerance_mm=0.15) for key, part in rig.parts.items()}
        try:
            _renders(rig, meshes, out, report)
            for index, key in enumerate(_DRAWINGS):
                report("Drawing parts", index / len(_DRAWINGS))
                part = rig.parts[key]
                text = three_views(part.solid, part.title)
                (out / f"drawing_{key}.svg").write_text(text, encoding="utf-8", newline="\n")
            report("Looking through the twin's cameras", None)
            _twin_pictures(rig, meshes, out)
        except OSError as error:
            raise DataError(f"{out}: cannot write the pictures ({os_reason(error)}); check the folder.") from error
    click.echo(f"Written: the manual's pictures in {out}")


def _renders(rig: Any, meshes: Mapping[str, Any], out: Path, report: Callable[[str, float | None], None]) -> None:
    """Write every render; a view is a name, the places in it, where the eye is, and whether it is exploded."""
    always, crosses = rig.within([]), rig.within(["calibration"])
    bare = [each for each in always if each.group in ("frame", "rods")]
    inside = {"mask", "end_panel", "diffuser", "light_wall", "led_plate", "spacer", "camera_plate", "camera", "foot"}
    views: tuple[tuple[str, Iterable[Any], tuple[float, float, float], bool], ...] = (
        ("assembly", always, _ISO, False),
        ("exploded", always, _ISO, True),
        ("frame", bare, _ISO, False),
        ("light_box", [each for each in always if each.group in ("light", "frame")], _LOW, True),
        ("camera", [each for each in always if each.part.key in ("camera", "camera_carrier")
                    and each.columns[2, 2] > 0.5], _NEAR, False),
        ("crosses", [each for each in crosses if each.group == "cross" or each.part.key == "beam"], _ISO, False),
        ("inlet", [each for each in always if each.group == "inlet"], _ISO, True),
        ("roll_unit", [each for each in always if each.group == "roll"], (-0.45, 0.85, 0.7), False),
        ("phantom", [each for each in rig.within(["phantom"]) if each.group in ("phantom", "inlet")
                     and each.part.key not in inside], (-0.75, -0.85, 0.8), False),
        ("jig", [each for each in rig.within(["jig"]) if each.group == "jig" or each.part.key == "end_panel"], _NEAR,
         False),
    )  # fmt: skip
    for index, (name, places, eye, exploded) in enumerate(views):
        report("Rendering", index / len(views))
        bodies = [
            Drawn(meshes[each.part.key].moved(each.columns, each.origin + _apart(rig.layout, each, exploded)).triangles,
                  each.part.colour)
            for each in places
        ]  # fmt: skip
        _write(out / f"{name}.png", picture(bodies, view_axes(eye), width_px=1100, height_px=800))


def _apart(layout: Layout, place: Any, exploded: bool) -> FloatArray:
    """Return how far a place is moved in an exploded view."""
    if not exploded or place.group not in _APART:
        return np.zeros(3)
    along_x, outwards = _APART[place.group]
    normal = place.columns[:, 2]
    low, high = place.solid().bounding_box().min, place.solid().bounding_box().max
    middle = 0.5 * (np.array(tuple(low)) + np.array(tuple(high))) - layout.centre
    # Walls and spacers lie beside a face: they go with the face that they stand on.
    if place.part.key == "light_wall":
        normal = place.columns[:, 1]
    if place.part.key == "foot":
        normal = -normal
    away = np.sign(middle @ normal) * normal
    if place.part.key.endswith("F"):  # an insert is drawn out of its holder
        along_x *= 1.6
    share = {"led_plate": 2.0, "light_wall": 1.3, "spacer": 1.3, "foot": 2.6}.get(place.part.key, 1.0)
    return np.asarray(np.array([along_x, 0.0, 0.0]) + share * outwards * away, dtype=np.float64)


def _twin_pictures(rig: Any, meshes: Mapping[str, Any], out: Path) -> None:
    """Write what both cameras see in the twin of the nominal rig, with the frame put into its scene."""
    from cathxr.app.hardware_twin import twin_pictures

    for name, pixels in twin_pictures(rig.layout).items():
        _write(out / f"{name}.png", pixels)


def _write(path: Path, pixels: Any) -> None:
    good, data = cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    if not good:
        raise DataError(f"{path}: the picture could not be coded.")
    path.write_bytes(data.tobytes())
