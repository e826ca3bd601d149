"""Pictures of a lens's calibration: where the board was and how it was tilted, and what the fit leaves over."""

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon, Rectangle
from matplotlib.ticker import MaxNLocator

from cathxr.calibration.coverage import COLUMNS, ROWS
from cathxr.calibration.drawing import BAD, BLUE, COLOURMAP, FAINT, GOOD, GRID, INK, WARN, new_figure, png
from cathxr.calibration.intrinsics import IntrinsicsResult, ViewResult
from cathxr.core import FloatArray

_ARROW_SHARE = 0.04
"""How long an arrow of three times the usual residual is drawn, as a share of the picture's width."""
_MOST_BARS = 30
_LONGEST_NAME = 18


def coverage_png(result: IntrinsicsResult) -> bytes:
    """Return where in the picture the board's corners were seen and how the board was tilted, as PNG."""
    width, height = result.size_px
    figure = new_figure(11.0, 0.56 + 7.1 * height / width * 1.02)
    seen, tilts = figure.subplots(1, 2, width_ratios=(2.6, 1.0))
    _cells(seen, result)
    for view in result.views:
        outline = _outline(view)
        seen.add_patch(Polygon(outline, closed=True, fill=False, edgecolor=BLUE, linewidth=0.7, alpha=0.55))
    corners = np.concatenate([view.corners_px for view in result.views])
    size = float(np.clip(4000.0 / len(corners), 1.5, 6.0))
    seen.scatter(corners[:, 0], corners[:, 1], s=size, color=BLUE, linewidths=0, alpha=0.75)
    centre, std = result.intrinsics.centre_px, result.intrinsics.provenance.std["centre_px"]
    seen.plot(*centre, marker="+", color=BAD, markersize=13, markeredgewidth=1.8, linestyle="none")
    seen.annotate(
        f"optical centre\n{centre[0]:.1f} ± {std[0]:.2g}, {centre[1]:.1f} ± {std[1]:.2g}",
        tuple(centre), xytext=(9, 7), textcoords="offset points", fontsize=8, color=BAD,
        bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip
    _picture_frame(seen, result.size_px)
    seen.set_title("Corners seen; darker cells are still empty", fontsize=10.5, color=INK)
    _tilts(tilts, result)
    count = len(result.views)
    rejected = f", {len(result.rejected)} rejected" if result.rejected else ""
    figure.suptitle(
        f"Where the board was: {count} views{rejected}, {len(corners)} corners", fontsize=12.5, color=INK, weight="bold"
    )
    return png(figure)


def residual_png(result: IntrinsicsResult) -> bytes:
    """Return what is left between the corners found and the corners computed: where, how, in which view, as PNG."""
    width, height = result.size_px
    figure = new_figure(11.0, 0.8 + 7.1 * height / width * 1.02)
    grid = figure.add_gridspec(2, 2, width_ratios=(2.2, 1.0), height_ratios=(1.0, 1.15))
    over, cloud = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
    views = figure.add_subplot(grid[1, 1])
    residuals = np.concatenate([view.residual_px for view in result.views])
    _arrows(over, result, residuals)
    _cloud(cloud, residuals)
    _bars(views, result)
    rms = result.intrinsics.provenance.rms_px or 0.0
    figure.suptitle(
        f"What the lens model leaves over: {rms:.3f} px RMS in {len(result.views)} views",
        fontsize=12.5, color=INK, weight="bold",
    )  # fmt: skip
    return png(figure)


def _cells(axis: Axes, result: IntrinsicsResult) -> None:
    """Shade the cells of the coverage map that no corner lies in."""
    width, height = result.size_px
    corners = np.concatenate([view.corners_px for view in result.views])
    counts, _, _ = np.histogram2d(
        corners[:, 1], corners[:, 0], bins=(ROWS, COLUMNS), range=((-0.5, height - 0.5), (-0.5, width - 0.5))
    )
    for row, column in zip(*np.nonzero(counts < 4), strict=True):
        corner = (column * width / COLUMNS - 0.5, row * height / ROWS - 0.5)
        axis.add_patch(Rectangle(corner, width / COLUMNS, height / ROWS, facecolor=GRID, edgecolor="none", alpha=0.9))
    for column in range(1, COLUMNS):
        axis.axvline(column * width / COLUMNS - 0.5, color=GRID, linewidth=0.6, zorder=0.5)
    for row in range(1, ROWS):
        axis.axhline(row * height / ROWS - 0.5, color=GRID, linewidth=0.6, zorder=0.5)


def _outline(view: ViewResult) -> FloatArray:
    """Return the hull (N, 2) of the corners seen."""
    hull = cv2.convexHull(view.corners_px.astype(np.float32)).reshape(-1, 2)
    return np.asarray(hull, dtype=np.float64)


def _tilts(axis: Axes, result: IntrinsicsResult) -> None:
    """Draw each view's tilt as a point: how far from facing the camera, and towards which side."""
    normals = np.array([view.camera_from_board.rotation[:, 2] for view in result.views])
    toward = np.array([view.camera_from_board.translation_mm for view in result.views])
    normals = normals * np.sign((normals * toward).sum(axis=1))[:, None]
    angle = np.degrees(np.arccos(np.clip(normals[:, 2], -1.0, 1.0)))
    way = np.arctan2(normals[:, 1], normals[:, 0])
    for ring in (20, 40, 60):
        axis.add_patch(Circle((0, 0), ring, fill=False, edgecolor=GRID, linewidth=0.9))
        axis.annotate(
            f"{ring}°", (0.7071 * ring, -0.7071 * ring), fontsize=7.5, color=FAINT, ha="center", va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
        )  # fmt: skip
    axis.scatter(angle * np.cos(way), angle * np.sin(way), s=34, color=BLUE, edgecolor="white", linewidth=0.7, zorder=3)
    axis.plot(0, 0, marker="+", color=FAINT, markersize=9)
    axis.set_xlim(-68, 68)
    axis.set_ylim(68, -68)
    axis.set_aspect("equal")
    axis.axis("off")
    axis.set_title("Tilts of the board", fontsize=10.5, color=INK)
    axis.text(
        0, 78, "Good: points on all sides,\nmost between 20° and 45°.", fontsize=8.5, color=FAINT, ha="center", va="top"
    )


def _arrows(axis: Axes, result: IntrinsicsResult, residuals: FloatArray) -> None:
    """Draw the residuals as arrows over the picture, so much enlarged that patterns show."""
    width, _ = result.size_px
    corners = np.concatenate([view.corners_px for view in result.views])
    usual = max(float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))), 1e-6)
    times = _round_figure(_ARROW_SHARE * width / (3.0 * usual))
    length = np.linalg.norm(residuals, axis=1)
    arrows = axis.quiver(
        corners[:, 0], corners[:, 1], residuals[:, 0] * times, residuals[:, 1] * times, length,
        angles="xy", scale_units="xy", scale=1.0, width=0.0019, cmap=COLOURMAP, clim=(0.0, 3.0 * usual),
    )  # fmt: skip
    _picture_frame(axis, result.size_px)
    axis.set_title(f"Found minus computed, {times:g} times enlarged", fontsize=10.5, color=INK)
    bar = axis.figure.colorbar(arrows, ax=axis, orientation="horizontal", shrink=0.6, pad=0.015, aspect=42)
    bar.set_label("residual, px", color=FAINT, fontsize=8.5)
    bar.ax.tick_params(colors=FAINT, labelsize=8)
    bar.outline.set_visible(False)


def _cloud(axis: Axes, residuals: FloatArray) -> None:
    """Draw all residuals about one point: round and without a second heap is how noise looks."""
    usual = max(float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))), 1e-6)
    size = float(np.clip(3000.0 / len(residuals), 1.5, 6.0))
    axis.scatter(residuals[:, 0], residuals[:, 1], s=size, color=BLUE, linewidths=0, alpha=0.5)
    axis.add_patch(Circle((0, 0), usual, fill=False, edgecolor=BAD, linewidth=1.1, zorder=3))
    axis.annotate(
        "RMS", (0.0, -usual), xytext=(0, 1), textcoords="offset points", ha="center", va="bottom", fontsize=8,
        color=BAD, bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.6},
    )  # fmt: skip
    limit = 4.0 * usual
    axis.set_xlim(-limit, limit)
    axis.set_ylim(limit, -limit)
    axis.set_aspect("equal")
    axis.xaxis.set_major_locator(MaxNLocator(5))
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.grid(color=GRID, linewidth=0.6)
    axis.set_axisbelow(True)
    _quiet(axis)
    axis.set_title("All residuals, px", fontsize=10.5, color=INK)


def _bars(axis: Axes, result: IntrinsicsResult) -> None:
    """Draw each view's residual; of very many, the worst."""
    views = sorted(result.views, key=lambda each: each.rms_px)
    hidden = max(0, len(views) - _MOST_BARS)
    views = views[hidden:]
    usual = float(np.median([each.rms_px for each in result.views]))
    values = np.array([each.rms_px for each in views])
    colours = [GOOD if each <= 1.5 * usual else WARN if each <= 2.5 * usual else BAD for each in values]
    axis.barh(np.arange(len(views)), values, color=colours, height=0.72)
    axis.axvline(usual, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    small = 8.0 if len(views) <= 16 else 5.5
    axis.set_yticks(np.arange(len(views)), [_short(each.name) for each in views], fontsize=small)
    axis.set_ylim(-0.6, len(views) - 0.4)
    axis.xaxis.set_major_locator(MaxNLocator(5))
    _quiet(axis)
    axis.tick_params(axis="y", length=0, labelsize=small)
    more = f", the worst {len(views)}" if hidden else ""
    axis.set_title(f"RMS of each view, px{more} (dashed: median)", fontsize=10.5, color=INK)


def _picture_frame(axis: Axes, size_px: tuple[int, int]) -> None:
    width, height = size_px
    axis.set_xlim(-0.5, width - 0.5)
    axis.set_ylim(height - 0.5, -0.5)
    axis.set_aspect("equal")
    axis.set_xticks([])
    axis.set_yticks([])
    for spine in axis.spines.values():
        spine.set_color(FAINT)
        spine.set_linewidth(1.0)


def _quiet(axis: Axes) -> None:
    axis.tick_params(colors=FAINT, labelsize=8)
    for spine in axis.spines.values():
        spine.set_visible(False)


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST_NAME else f"…{name[1 - _LONGEST_NAME :]}"


def _round_figure(value: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most `value`."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-9)))
    return float(max(each for each in (1.0, 2.0, 5.0) if each <= value / power + 1e-9) * power)
