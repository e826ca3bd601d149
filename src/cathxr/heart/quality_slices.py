"""Pictures of slices with the surfaces' contours over the CT, or over the labels where there is no CT."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cathxr.core import FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.made import Made
from cathxr.heart.quality_render import png
from cathxr.heart.surface import edge_keys
from cathxr.heart.surfaces import PartSurface
from cathxr.heart.volume import Grid

_SHARES = (0.2, 0.4, 0.6, 0.8)
"""Where the slices are, as shares of what is labelled."""
_MARGIN_MM = 15.0
_LOWEST_HU = -180.0
_LEGEND = 8
"""More names than this make two rows."""
_DARK = "#101318"
_DPI = 110
_PLANES = (
    # normal's axis of LPS, name, what is to the right and what is up in LPS, letters at left, right, top, bottom
    (2, "axial", np.array([1.0, 0, 0]), np.array([0, -1.0, 0]), "R L A P"),
    (1, "coronal", np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), "R L H F"),
    (0, "sagittal", np.array([0, 1.0, 0]), np.array([0, 0, 1.0]), "A P H F"),
)


@dataclass(frozen=True, eq=False)
class _Plane:
    """A plane of the grid. normal, across, up: axes of (i, j, k); flips: whether across and up run backwards."""

    name: str
    letters: tuple[str, str, str, str]
    normal: int
    across: int
    up: int
    flips: tuple[bool, bool]


@dataclass(frozen=True, eq=False)
class _Scene:
    """What is drawn. voxels: each part's vertices as (i, j, k). low, high: the first and last (i, j, k) shown."""

    grid: Grid
    parts: Sequence[PartSurface]
    voxels: Sequence[FloatArray]
    shades: npt.NDArray[np.uint8]
    low: npt.NDArray[np.int64]
    high: npt.NDArray[np.int64]


def slice_pictures(made: Made) -> dict[str, bytes]:
    """Return PNG pictures by the plane's name (axial, coronal, sagittal; of an oblique grid the nearest to these)."""
    grid = made.labels.grid
    low, high = _labelled(made.labels.labels, grid)
    voxels = [grid.to_voxel(part.surface.vertices_mm) for part in made.parts]
    scene = _Scene(grid, made.parts, voxels, _background(made, low, high), low, high)
    return {plane.name: _drawn(plane, scene) for plane in _planes(grid)}


def _planes(grid: Grid) -> list[_Plane]:
    """Return the three planes of the grid, each turned so that it is read as a radiologist reads it."""
    axes = grid.ct_from_voxel[:3, :3] / grid.spacing_mm
    planes = []
    free = [0, 1, 2]
    for lps, name, right, top, letters in _PLANES:
        normal = max(free, key=lambda axis: abs(axes[lps, axis]))
        free.remove(normal)
        across, up = [axis for axis in range(3) if axis != normal]
        if abs(right @ axes[:, across]) < abs(right @ axes[:, up]):
            across, up = up, across
        flips = (bool(right @ axes[:, across] < 0.0), bool(top @ axes[:, up] < 0.0))
        left, to_right, above, below = letters.split()
        planes.append(_Plane(name, (left, to_right, above, below), normal, across, up, flips))
    return planes


def _labelled(labels: npt.NDArray[np.uint8], grid: Grid) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the first and the last (i, j, k) of what is shown, a margin included."""
    ranges = [np.flatnonzero((labels != 0).any(axis=tuple(a for a in range(3) if a != axis))) for axis in (2, 1, 0)]
    margin = np.ceil(_MARGIN_MM / grid.spacing_mm).astype(np.int64)
    low = np.array([each[0] for each in ranges]) - margin
    high = np.array([each[-1] for each in ranges]) + margin
    return np.maximum(low, 0), np.minimum(high, np.array(grid.shape[::-1]) - 1)


def _background(made: Made, low: npt.NDArray[np.int64], high: npt.NDArray[np.int64]) -> npt.NDArray[np.uint8]:
    """Return the colours (K, J, I, 3) or the greys (K, J, I) that the contours lie on, of the box that is shown."""
    shown = tuple(slice(int(a), int(b) + 1) for a, b in zip(low[::-1], high[::-1], strict=True))
    labels = made.labels.labels[shown]
    if made.volume is None:
        colours = np.zeros((256, 3), np.uint8)
        for value, key in made.labels.names.items():
            colour = CATALOGUE[key].colour
            colours[value] = [int(int(colour[at : at + 2], 16) * 0.45) for at in (1, 3, 5)]
        colours[0] = 26
        return colours[labels]
    hu = made.volume.hu[shown]
    step = max(1, round((labels.size / 2e6) ** (1 / 3)))
    some = (slice(None, None, step),) * 3
    blood = hu[some][labels[some] > 0]
    top = float(np.percentile(blood, 98)) + 60.0 if blood.size else 600.0
    greys = np.clip((np.arange(-32768, 32768) - _LOWEST_HU) / (max(top, 300.0) - _LOWEST_HU), 0.0, 1.0)
    # A table by the number's bits: an index below zero counts from the table's end, where the negative numbers are.
    return np.asarray(np.roll((greys * 255.0).astype(np.uint8), -32768)[hu])


def _drawn(plane: _Plane, scene: _Scene) -> bytes:
    """Return one plane's picture: four slices side by side."""
    low, high, grid, parts = scene.low, scene.high, scene.grid, scene.parts
    spacing = grid.spacing_mm
    inner = np.ceil(_MARGIN_MM / spacing[plane.normal])
    first, last = low[plane.normal] + inner, high[plane.normal] - inner
    at = [round(float(first + share * (last - first))) for share in _SHARES]
    wide = float((high - low)[plane.across] * spacing[plane.across])
    tall = float((high - low)[plane.up] * spacing[plane.up])
    panel = 3.6
    figure = Figure(figsize=(panel * len(at), min(panel * tall / wide, 6.5) + 0.55), dpi=_DPI, facecolor=_DARK)
    axes = figure.subplots(1, len(at), squeeze=False)[0]
    for each, index in zip(axes, at, strict=True):
        index = int(np.clip(index, low[plane.normal], high[plane.normal]))
        _panel(each, plane, scene, index, round(panel * _DPI))
        count = grid.shape[2 - plane.normal]
        each.set_title(f"{plane.name}, slice {index + 1} of {count}", color="#c8ced8", fontsize=8, pad=4)
    lines = [Line2D([], [], color=_bright(part.key), linewidth=2, label=CATALOGUE[part.key].name) for part in parts]
    lines.append(Line2D([], [], color="white", linewidth=1.2, linestyle=":", label="cap (valve, cut)"))
    columns = len(lines) if len(lines) <= _LEGEND else (len(lines) + 1) // 2
    figure.legend(handles=lines, loc="lower center", ncols=columns, fontsize=7.5, frameon=False, labelcolor="#c8ced8")
    bottom = 0.1 if columns == len(lines) else 0.14
    figure.subplots_adjust(left=0.005, right=0.995, top=0.94, bottom=bottom, wspace=0.02)
    return png(figure)


def _panel(axes: Axes, plane: _Plane, scene: _Scene, index: int, wide_px: int) -> None:
    """Draw one slice into matplotlib axes, about `wide_px` wide."""
    low, high, spacing = scene.low, scene.high, scene.grid.spacing_mm
    view: list[int | slice] = [slice(None)] * 3
    view[2 - plane.normal] = index - int(low[plane.normal])
    picture = scene.shades[tuple(view)]
    # What is left of (k, j, i) is in falling order of the axes' numbers: rows are the higher of the two.
    if plane.across > plane.up:
        picture = np.swapaxes(picture, 0, 1)
    edges = [(float(low[axis]) - 0.5, float(high[axis]) + 0.5) for axis in (plane.across, plane.up)]
    (x0, x1), (y0, y1) = (
        (a * spacing[axis], b * spacing[axis]) for (a, b), axis in zip(edges, (plane.across, plane.up), strict=True)
    )
    shown = _sized(picture, wide_px, round(wide_px * (y1 - y0) / (x1 - x0)))
    axes.imshow(shown, extent=(x0, x1, y0, y1), origin="lower", interpolation="nearest")
    for part, ijk in zip(scene.parts, scene.voxels, strict=True):
        for caps in (False, True):
            lines = _cut(ijk, part.surface.triangles[part.caps == caps], plane.normal, float(index))
            seen = [line[:, [plane.across, plane.up]] * spacing[[plane.across, plane.up]] for line in lines]
            style = {"colors": "white", "linewidths": 1.0, "linestyles": ":"} if caps else {"colors": _bright(part.key)}
            axes.add_collection(LineCollection(seen, **({"linewidths": 1.3} | style)))
    axes.set_xlim((x1, x0) if plane.flips[0] else (x0, x1))
    axes.set_ylim((y1, y0) if plane.flips[1] else (y0, y1))
    axes.set_aspect("equal")
    axes.set_axis_off()
    for letter, (x, y) in zip(plane.letters, ((0.02, 0.5), (0.98, 0.5), (0.5, 0.98), (0.5, 0.02)), strict=True):
        across = "left" if x < 0.5 else "right" if x > 0.5 else "center"
        up = "bottom" if y < 0.5 else "top" if y > 0.5 else "center"
        axes.text(x, y, letter, transform=axes.transAxes, color="#ffd866", fontsize=8, ha=across, va=up)


def _sized(picture: npt.NDArray[np.uint8], wide: int, tall: int) -> npt.NDArray[np.uint8]:
    """Return the picture (rows, columns[, 3]) as RGB in the size in which it is drawn."""
    colours = np.ascontiguousarray(picture if picture.ndim == 3 else np.repeat(picture[..., None], 3, axis=2))
    smaller = wide < colours.shape[1]
    kind = cv2.INTER_AREA if smaller else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(colours, (wide, max(tall, 1)), interpolation=kind), np.uint8)


def _cut(ijk: FloatArray, triangles: npt.NDArray[np.int64], axis: int, value: float) -> list[FloatArray]:
    """Return the lines, (N, 3) each, in which a plane of the grid cuts the triangles."""
    height = ijk[:, axis] - value
    height = np.where(np.abs(height) < 1e-6, 1e-6, height)
    above = height[triangles] > 0.0
    crossed = triangles[above.any(axis=1) & ~above.all(axis=1)]
    sides = height[crossed] > 0.0
    lone = np.where(sides.sum(axis=1) == 1, sides.argmax(axis=1), (~sides).argmax(axis=1))
    rows = np.arange(len(crossed))
    a = crossed[rows, lone]
    edges = np.stack([np.stack([a, crossed[rows, (lone + step) % 3]], axis=1) for step in (1, 2)], axis=1)
    edges = np.sort(edges.reshape(-1, 2), axis=1)
    _, first, name = np.unique(edge_keys(edges), return_index=True, return_inverse=True)
    low, high = edges[first].T
    share = (height[low] / (height[low] - height[high]))[:, None]
    points = ijk[low] + share * (ijk[high] - ijk[low])
    return [points[line] for line in _chained(name.reshape(-1, 2).tolist())]


def _chained(segments: list[list[int]]) -> list[list[int]]:
    """Return segments, from point to point, as lines that are as long as possible; closed ones end where they begin."""
    beside: dict[int, list[int]] = {}
    for one, other in segments:
        beside.setdefault(one, []).append(other)
        beside.setdefault(other, []).append(one)
    lines = []
    # Open lines from their ends first, and then the closed ones from anywhere.
    for start in [*(point for point, others in beside.items() if len(others) == 1), *beside]:
        line = [start]
        while beside[line[-1]]:
            here = line[-1]
            line.append(beside[here].pop())
            beside[line[-1]].remove(here)
        if len(line) > 1:
            lines.append(line)
    return lines


def _bright(key: str) -> tuple[float, float, float]:
    """Return a structure's colour as a line on a grey picture shows it."""
    colour = np.array([int(CATALOGUE[key].colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    red, green, blue = np.minimum(0.12 + 1.12 * colour, 1.0)
    return float(red), float(green), float(blue)
