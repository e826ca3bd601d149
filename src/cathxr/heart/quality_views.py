"""The 3D picture of a heart: from the front, the back and the left, and seen through, with its openings named."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from cathxr.core import FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.jobs import Together, one_after_another
from cathxr.heart.made import Made
from cathxr.heart.quality_render import Body, Camera, framed, png, rendered
from cathxr.heart.surface import vertex_normals
from cathxr.heart.surfaces import PartSurface

_SIZE_PX = (560, 560)
_DPI = 110
_PAPER = "#24282f"
_SEE_THROUGH = 0.22
_LINE_PX = 17.0
_CUT_LONG, _CUT_SHORT = ", cut by the volume's boundary", ", cut"
_PANELS = (
    ("front", "from the front", False),
    ("back", "from the back", False),
    ("left", "from the patient's left", False),
    ("front", "from the front, seen through; openings are named", True),
)


def view_picture(made: Made, *, together: Together = one_after_another) -> bytes:
    """Return a PNG picture with four views of the surfaces."""
    everything = np.concatenate([part.surface.vertices_mm for part in made.parts])
    wide, tall = 2 * _SIZE_PX[0], 2 * _SIZE_PX[1]
    figure = Figure(figsize=(wide / _DPI, tall / _DPI), dpi=_DPI, facecolor=_PAPER)
    # Names stand beside the heart where it is seen through.
    cameras = [framed(view, everything, _SIZE_PX, margin=0.17 if through else 0.09) for view, _, through in _PANELS]
    whole, see_through = (
        [body for part in made.parts for body in _bodies(part, through=each)] for each in (False, True)
    )
    pictures = together(
        [
            partial(rendered, see_through if through else whole, camera)
            for camera, (_, _, through) in zip(cameras, _PANELS, strict=True)
        ]
    )
    for number, ((_, title, through), camera) in enumerate(zip(_PANELS, cameras, strict=True)):
        column, row = number % 2, 1 - number // 2
        axes = figure.add_axes((column / 2, row / 2, 0.5, 0.5))
        axes.imshow(pictures[number], interpolation="nearest")
        axes.set_axis_off()
        axes.text(12, 20, title, color="#d5dae3", fontsize=8.5)
        if through:
            _name_openings(axes, made, camera)
    return png(figure)


def _bodies(part: PartSurface, *, through: bool) -> list[Body]:
    """Return what is drawn of a part: all of it, or its walls alone, seen through."""
    anatomy = CATALOGUE[part.key]
    if not through:
        surface = part.surface
        # Tissue around the blood would hide all of it.
        opacity = 1.0 if anatomy.blood else 0.25
        return [Body(surface.vertices_mm, vertex_normals(surface), surface.triangles, anatomy.colour, opacity)]
    walls = part.surface.keep(~part.caps) if not part.caps.all() else part.surface
    opacity = _SEE_THROUGH if anatomy.blood else 0.06
    return [Body(walls.vertices_mm, vertex_normals(walls), walls.triangles, anatomy.colour, opacity)]


def _name_openings(axes: Axes, made: Made, camera: Camera) -> None:
    """Draw a ring and a name for each opening, the names in two columns so that they do not cover each other."""
    width, height = _SIZE_PX
    centres = {key: camera.project(each.centroid_mm[None])[0] for key, each in made.places.openings.items()}
    for side in (0, 1):
        on_side = [key for key, at in centres.items() if (at[0] >= width / 2) == bool(side)]
        on_side.sort(key=lambda key: float(centres[key][1]))
        heights = _spread([float(centres[key][1]) for key in on_side], 44.0, height - 14.0)
        for key, text_at in zip(on_side, heights, strict=True):
            opening, at = made.places.openings[key], centres[key]
            ring = camera.project(_ring(opening.centroid_mm, opening.normal, opening.diameter_mm / 2.0))
            axes.plot(ring[:, 0], ring[:, 1], color="#ffe08a", linewidth=1.1, alpha=0.95)
            axes.annotate(
                opening.name.replace(_CUT_LONG, _CUT_SHORT),
                xy=(at[0], at[1]),
                xytext=(width - 8 if side else 8, text_at),
                color="#ffe9b0",
                fontsize=7.5,
                ha="right" if side else "left",
                va="center",
                arrowprops={"arrowstyle": "-", "color": "#ffe9b0", "linewidth": 0.6, "alpha": 0.7},
                path_effects=[Stroke(linewidth=2.2, foreground=_PAPER), Normal()],
                zorder=5,
            )
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)


def _spread(wanted: Sequence[float], first: float, last: float) -> list[float]:
    """Return heights near the wanted ones (rising), far enough apart for a line of text each, from first to last."""
    step = min(_LINE_PX, (last - first) / max(len(wanted), 1))
    heights: list[float] = []
    for each in wanted:
        heights.append(max(each, heights[-1] + step if heights else first))
    below = last + step
    for number in reversed(range(len(heights))):
        below = heights[number] = min(heights[number], below - step)
    return heights


def _ring(centre: FloatArray, normal: FloatArray, radius: float) -> FloatArray:
    """Return points (65, 3) mm on a circle."""
    helper = np.eye(3)[int(np.abs(normal).argmin())]
    one = np.cross(normal, helper)
    one /= np.linalg.norm(one)
    two = np.cross(normal, one)
    angle = np.linspace(0.0, 2.0 * np.pi, 65)[:, None]
    return np.asarray(centre + radius * (np.cos(angle) * one + np.sin(angle) * two))
