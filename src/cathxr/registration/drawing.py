"""Pictures of a registration: the heart coloured by its predicted error, and where a landmark is to be touched."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cathxr.core import FloatArray
from cathxr.registration.model import LandmarkPair
from cathxr.registration.solve import Solution

_INK, _FAINT, _GRID, _BLUE, _RED = "#1d2733", "#6b7785", "#d9dee4", "#2166ac", "#d73027"
_NIGHT = "#0b1017"
_MOST_TRIANGLES = 60_000
_PICTURE_IN, _PICTURE_DPI, _MARGIN = 5.6, 100, 0.08
_LABEL_AWAY_PT = 6.0


@dataclass(frozen=True, eq=False)
class View:
    """A look at the heart: across and up are the picture's axes in `ct`, towards points at the viewer (each (3,))."""

    title: str
    across: FloatArray
    up: FloatArray
    towards: FloatArray
    sides: tuple[str, str]


_VIEWS = (
    View("from the front", np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), np.array([0, -1.0, 0]), ("R", "L")),
    View("from the left", np.array([0, 1.0, 0]), np.array([0, 0, 1.0]), np.array([1.0, 0, 0]), ("A", "P")),
)


@dataclass(frozen=True, eq=False)
class HeartShape:
    """The heart's surface: vertices (N, 3) mm in `ct`, triangles (M, 3) of indices, a colour "#rrggbb" for each."""

    vertices_ct: FloatArray
    triangles: NDArray[np.int64]
    colours: Sequence[str]

    def lighter(self) -> "HeartShape":
        """Return the same shape with few enough triangles to be drawn in a second or two."""
        every = -(-len(self.triangles) // _MOST_TRIANGLES)
        if every == 1:
            return self
        # Without every second triangle a surface would show holes: vertices are brought together on a grid instead.
        span = float(np.ptp(self.vertices_ct, axis=0).max())
        cells = np.round(self.vertices_ct / (span / 160.0)).astype(np.int64)
        _, first, index = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        triangles = index.reshape(-1)[self.triangles]
        a, b, c = triangles.T
        kept = (a != b) & (b != c) & (c != a)
        colours = np.asarray(self.colours)[kept]
        return HeartShape(self.vertices_ct[first], triangles[kept], [str(each) for each in colours])


@dataclass(frozen=True, eq=False)
class HeartPicture:
    """The heart seen from one side, as PNG of size_px. low, high (2,): the picture's corners, mm across and up."""

    view: View
    png: bytes
    size_px: tuple[int, int]
    low: FloatArray
    high: FloatArray

    def places(self, points_ct: FloatArray) -> FloatArray:
        """Return where points (N, 3) mm in `ct` are: (N, 2), shares of the width from the left, height from the top."""
        shares = (_seen(points_ct, self.view) - self.low) / (self.high - self.low)
        return np.stack([shares[:, 0], 1.0 - shares[:, 1]], axis=1)


def tre_png(solution: Solution, shape: HeartShape) -> bytes:
    """Return the heart coloured by the expected error, from two sides, and each landmark's errors as bars."""
    figure = _figure(11.0, 8.2)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 0.04), height_ratios=(1.7, 1.0))
    found, light = solution.registration, shape.lighter()
    tre = solution.predicted_tre_mm(found.box(light.vertices_ct))
    greatest = 1.0 if tre is None else max(0.1, float(tre.max()))
    scale = Normalize(0.0, greatest)
    colours = _part_colours(light)
    if tre is not None:
        colours = colormaps["viridis"](scale(tre[light.triangles].mean(axis=1)))[:, :3]
    for column, view in enumerate(_VIEWS):
        axes = figure.add_subplot(grid[0, column])
        _draw_heart(axes, light, view, colours)
        _draw_landmarks(axes, view, found.landmarks)
        axes.set_title(view.title, color=_INK, fontsize=10)
    if tre is not None:
        bar = figure.colorbar(ScalarMappable(scale, "viridis"), cax=figure.add_subplot(grid[0, 2]))
        bar.set_label("predicted target error, mm", color=_INK)
    _draw_bars(figure.add_subplot(grid[1, :]), found.landmarks)
    figure.suptitle(_headline(solution), color=_INK, fontsize=11)
    return _png(figure)


def heart_pictures(shape: HeartShape, points_ct: FloatArray) -> tuple[HeartPicture, ...]:
    """Return the heart from two sides, wide enough that points (N, 3) mm in `ct` are in the pictures too."""
    light = shape.lighter()
    made = []
    for view in _VIEWS:
        seen = _seen(np.vstack([light.vertices_ct, points_ct]), view)
        middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
        half = (0.5 + _MARGIN) * np.ptp(seen, axis=0)
        width_in = float(_PICTURE_IN * half[0] / half.max())
        height_in = float(_PICTURE_IN * half[1] / half.max())
        figure = Figure(figsize=(width_in, height_in), facecolor=_NIGHT)
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        _draw_heart(axes, light, view, _part_colours(light))
        low, high = middle - half, middle + half
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        size = (round(width_in * _PICTURE_DPI), round(height_in * _PICTURE_DPI))
        made.append(HeartPicture(view, _png(figure, dpi=_PICTURE_DPI), size, low, high))
    return tuple(made)


def _figure(width_in: float, height_in: float) -> Figure:
    figure = Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _png(figure: Figure, *, dpi: int = 130) -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def _seen(points: FloatArray, view: View) -> FloatArray:
    """Return points (N, 3) as (N, 2) in a view."""
    return np.asarray(points @ np.stack([view.across, view.up], axis=1))


def _part_colours(shape: HeartShape) -> FloatArray:
    """Return each triangle's own colour (M, 3), softened."""
    own = {name: 0.75 * np.array(to_rgb(name)) + 0.25 for name in set(shape.colours)}
    return np.stack([own[name] for name in shape.colours])


def _draw_heart(axes: Axes, shape: HeartShape, view: View, colours: FloatArray) -> None:
    """Draw the triangles that face the viewer, the nearest last, shaded as if lit from beside the viewer."""
    corners = shape.vertices_ct[shape.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    facing = normals @ view.towards > 0.0
    light = view.towards + 0.5 * view.up - 0.4 * view.across
    shade = 0.65 + 0.35 * np.clip(normals @ (light / np.linalg.norm(light)), 0.0, 1.0)
    depth = corners.mean(axis=1) @ view.towards
    order = np.flatnonzero(facing)[np.argsort(depth[facing])]
    flat = _seen(corners[order].reshape(-1, 3), view).reshape(-1, 3, 2)
    faces = np.clip(colours[order] * shade[order, None], 0.0, 1.0)
    axes.add_collection(PolyCollection(list(flat), facecolors=faces, edgecolors=faces, linewidths=0.3))
    low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
    margin = 0.06 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_axis_off()
    for place, name, side in ((0.01, view.sides[0], "left"), (0.99, view.sides[1], "right")):
        axes.text(place, 0.5, name, transform=axes.transAxes, ha=side, va="center", color=_FAINT, fontsize=9)


def _draw_landmarks(axes: Axes, view: View, landmarks: Sequence[LandmarkPair]) -> None:
    at = _seen(np.stack([each.ct_mm for each in landmarks]), view)
    axes.plot(at[:, 0], at[:, 1], "o", ms=5, mfc="white", mec=_INK, zorder=5)
    low, high = axes.get_xlim()
    for number, (x, y) in enumerate(at, start=1):
        away = -_LABEL_AWAY_PT if x > 0.5 * (low + high) else _LABEL_AWAY_PT
        axes.annotate(
            str(number), (x, y), xytext=(away, 4), textcoords="offset points", ha="right" if away < 0 else "left",
            fontsize=9, color=_INK, zorder=6, bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"},
        )  # fmt: skip
    # landmarks that lie off the surface are shown too
    axes.set_xlim(min(low, float(at[:, 0].min()) - 5.0), max(high, float(at[:, 0].max()) + 5.0))
    bottom, top = axes.get_ylim()
    axes.set_ylim(min(bottom, float(at[:, 1].min()) - 5.0), max(top, float(at[:, 1].max()) + 5.0))


def _draw_bars(axes: Axes, landmarks: Sequence[LandmarkPair]) -> None:
    """Draw each landmark's residual and held-out error."""
    place = np.arange(len(landmarks))
    residuals = [each.residual_mm or 0.0 for each in landmarks]
    axes.bar(place - 0.19, residuals, 0.36, color=_GRID, edgecolor=_FAINT, label="left by the fit (not a target error)")
    held = [(index, each.held_out_mm) for index, each in enumerate(landmarks) if each.held_out_mm is not None]
    if held:
        places, errors = np.array(held).T
        axes.bar(places + 0.19, errors, 0.36, color=_BLUE, label="held out: left by a fit to all the others")
    names = [f"{index}  {each.name.replace('_', ' ')}" for index, each in enumerate(landmarks, start=1)]
    axes.set_xticks(place, names, rotation=18 if len(names) > 4 else 0, ha="right" if len(names) > 4 else "center")
    axes.set_ylabel("mm", color=_INK)
    axes.grid(axis="y", color=_GRID, lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=_INK, labelsize=8)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=8, frameon=False, ncols=2)
    for side in axes.spines.values():
        side.set_color(_GRID)


def _headline(solution: Solution) -> str:
    found = solution.registration
    parts = []
    if found.predicted_tre_mm is not None:
        worst = "" if found.worst_tre_mm is None else f", {found.worst_tre_mm:.1f} mm at worst over the heart"
        parts.append(f"Predicted error {found.predicted_tre_mm:.1f} mm at the landmarks' centroid{worst}")
    if found.tre_mm is not None:
        parts.append(f"held out {found.tre_mm:.1f} mm")
    parts.append(f"FRE {found.fre_mm:.1f} mm ({found.kind.value}, {len(found.landmarks)} landmarks)")
    return "; ".join(parts)
