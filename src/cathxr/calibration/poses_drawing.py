"""Pictures of poses: the expected error over the region of interest, and each fiducial's residual."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from cathxr.calibration.drawing import BAD, BLUE, COLOURMAP, FAINT, GRID, INK, new_figure, png
from cathxr.calibration.error_map import error_summary, expected_error_mm
from cathxr.calibration.poses import MarkerResidual, PosesResult
from cathxr.core import FloatArray, Rig, RigCamera
from cathxr.geometry import CameraModel

_PLANES = ((0, 1, "seen from above"), (0, 2, "seen from the front"), (1, 2, "seen along the catheter"))
_CELLS = 49
_MARGIN_SHARE = 0.2
_ARROW_SHARE = 0.07
"""How long the longest residual or circle's radius is drawn, as a share of the picture's width."""


def error_map_png(rig: Rig) -> bytes:
    """Return the error that calibration alone leaves, mm, in the three middle planes of the region of interest, as PNG.

    Raises:
        ValueError: part of the region lies behind a camera.
    """
    slices = [_slice(rig, first, second) for first, second, _ in _PLANES]
    low = min(float(error.min()) for *_, error in slices)
    high = max(float(error.max()) for *_, error in slices)
    levels = np.linspace(low, max(high, low + 1e-6), 33)
    round_levels = MaxNLocator(9, steps=[1, 2, 5, 10]).tick_values(low, high)
    lines_at = [each for each in round_levels if low < each < high]
    figure = new_figure(11.4, 4.2)
    axes = figure.subplots(1, 3)
    shown = None
    for axis, (first, second, view), (across, up, error) in zip(axes, _PLANES, slices, strict=True):
        shown = axis.contourf(across, up, error, levels=levels, cmap=COLOURMAP)
        inside = [each for each in lines_at if error.min() < each < error.max()]
        if inside:
            lines = axis.contour(across, up, error, levels=inside, colors="white", linewidths=0.8, alpha=0.85)
            axis.clabel(lines, fmt="%.4g", fontsize=7.5)
        _frame(axis, rig, first, second)
        _cameras(axis, rig, first, second)
        axis.set_title(f"{'xyz'[first]}{'xyz'[second]}, {view}", fontsize=10.5, color=INK)
    assert shown is not None, "there are three planes"
    bar = figure.colorbar(shown, ax=list(axes), shrink=0.86, pad=0.02, ticks=lines_at or [low])
    bar.ax.set_yticklabels([f"{each:.4g}" for each in lines_at or [low]])
    bar.set_label("expected error, mm", color=INK)
    bar.ax.tick_params(colors=FAINT, labelsize=8)
    bar.outline.set_visible(False)
    summary = error_summary(rig)
    figure.suptitle(
        f"Error that calibration leaves at a point: rms {summary.mean_mm:.3f} mm, "
        f"95 % below {summary.p95_mm:.3f} mm, greatest {summary.max_mm:.3f} mm",
        fontsize=12.5,
        color=INK,
        weight="bold",
    )
    figure.supxlabel(_footnote(rig), fontsize=8.5, color=FAINT)
    return png(figure)


def residuals_png(result: PosesResult) -> bytes:
    """Return where each fiducial was seen and how far from where its camera's pose puts it, enlarged, as PNG."""
    names = [name for name in result.rig.cameras if name in result.rms_px]
    figure = new_figure(6.2 * len(names), 4.1)
    row = figure.subplots(1, len(names), squeeze=False)[0]
    for axis, name in zip(row, names, strict=True):
        own = [each for each in result.residuals if each.camera == name]
        _residuals(axis, result.rig.cameras[name], result, own)
        count = sum(each.used for each in own)
        axis.set_title(
            f"{name}: {count} fiducials, rms {result.rms_px[name]:.3f} px", fontsize=11, color=INK, weight="bold"
        )
    figure.supxlabel(
        "arrows: from where the pose puts each fiducial to where it was seen; circle: two standard deviations",
        fontsize=8.5,
        color=FAINT,
    )
    return png(figure)


def _slice(rig: Rig, first: int, second: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the two coordinates and the expected error, each (cells, cells), of a middle plane."""
    low, high = rig.roi.min_mm, rig.roi.max_mm
    across, up = np.meshgrid(
        np.linspace(low[first], high[first], _CELLS), np.linspace(low[second], high[second], _CELLS)
    )
    points = np.tile((low + high) / 2.0, (across.size, 1))
    points[:, first], points[:, second] = across.ravel(), up.ravel()
    return across, up, expected_error_mm(rig, points).reshape(across.shape)


def _frame(axis: Axes, rig: Rig, first: int, second: int) -> None:
    """Draw the region's outline and leave a margin for the cameras' arrows."""
    low, high = rig.roi.min_mm, rig.roi.max_mm
    size = high - low
    axis.add_patch(
        Rectangle((low[first], low[second]), size[first], size[second], fill=False, edgecolor=INK, linewidth=1.4)
    )
    margin = _MARGIN_SHARE * float(max(size[first], size[second]))
    axis.set_xlim(low[first] - margin, high[first] + margin)
    axis.set_ylim(low[second] - margin, high[second] + margin)
    axis.set_aspect("equal")
    axis.set_xlabel(f"{'xyz'[first]}, mm", color=INK)
    axis.set_ylabel(f"{'xyz'[second]}, mm", color=INK, labelpad=1)
    _plain(axis)


def _cameras(axis: Axes, rig: Rig, first: int, second: int) -> None:
    """Draw an arrow along each camera's line of sight, outside the region; a ring where it looks into the plane."""
    low, high = rig.roi.min_mm[[first, second]], rig.roi.max_mm[[first, second]]
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    margin = _MARGIN_SHARE * 2.0 * float(half.max())
    for camera in rig.cameras.values():
        centre = CameraModel.of(camera).centre_box
        away = centre - (rig.roi.min_mm + rig.roi.max_mm) / 2.0
        flat = away[[first, second]]
        if float(np.linalg.norm(flat)) < 0.4 * float(np.linalg.norm(away)):
            continue  # it looks along the line of sight of this drawing
        unit = flat / np.linalg.norm(flat)
        edge = float((half / np.maximum(np.abs(unit), 1e-9)).min())
        _arrow(axis, middle + unit * (edge + 0.55 * margin), middle + unit * (edge + 0.06 * margin))
        label = middle + unit * (edge + 0.55 * margin)
        # Beside the arrow's end where that lies level, over or under it where it stands upright.
        level = abs(unit[0]) > abs(unit[1])
        side = "bottom" if unit[1] > 0 or level else "top"
        axis.text(
            label[0], label[1] + (3.0 if level else 0.0), camera.name, color=BLUE, fontsize=9, ha="center", va=side
        )


def _residuals(axis: Axes, camera: RigCamera, result: PosesResult, own: Sequence[MarkerResidual]) -> None:
    width, height = camera.size_px
    places = {each.name: each.position_mm for group in result.rig.markers.values() for each in group}
    at = CameraModel.of(camera).project(np.stack([places[each.name] for each in own]))
    used = [each for each in own if each.used]
    spread = [2.0 * each.sigma_px * result.noise_scale[camera.name] for each in own]
    longest = max([*(float(np.linalg.norm(each.residual_px)) for each in used), *spread])
    enlarged = _round_down(_ARROW_SHARE * width / max(longest, 1e-3))
    axis.add_patch(Rectangle((-0.5, -0.5), width, height, facecolor="#f6f8fa", edgecolor=GRID, linewidth=1.2))
    for each, place, radius in zip(own, at, spread, strict=True):
        if each.used:
            _circle(axis, place, radius * enlarged)
            _arrow(axis, place, place + enlarged * each.residual_px)
        axis.plot(*place, "o" if each.used else "x", color=BLUE if each.used else BAD, markersize=4 if each.used else 8)
    for each, place in zip(own, _label_places(at, camera.size_px), strict=True):
        length = float(np.linalg.norm(each.residual_px))
        text = f"{each.name}  {length:.2f} px" if each.used else f"{each.name}  {length:.1f} px: left out"
        axis.text(
            float(place[0]), float(place[1]), text, color=INK if each.used else BAD, fontsize=8.5,
            ha="center", va="center",
        )  # fmt: skip
    axis.text(
        0.01, 0.985, f"enlarged {enlarged:g} times", transform=axis.transAxes, fontsize=8.5, color=FAINT, va="top"
    )
    axis.set_xlim(-0.5, width - 0.5)
    axis.set_ylim(height - 0.5, -0.5)
    axis.set_aspect("equal")
    axis.set_xlabel("px", color=INK)
    _plain(axis)


def _label_places(at: FloatArray, size_px: tuple[int, int]) -> list[FloatArray]:
    """Return where each fiducial's name goes: under it or over it, inside the picture and not over another name."""
    width, height = size_px
    room = np.array([0.16 * width, 0.045 * height])
    step = np.array([0.0, 0.055 * height])
    taken: list[FloatArray] = []
    for place in at:
        rows = [place + side * rank * step for rank in (2.4, 3.2, 4.0, 4.8) for side in (1.0, -1.0)]
        free = [
            each
            for each in rows
            if 0.03 * height < each[1] < 0.97 * height and all((np.abs(each - other) > room).any() for other in taken)
        ]
        taken.append((free or rows)[0])
    return taken


def _arrow(axis: Axes, tail: FloatArray, tip: FloatArray) -> None:
    axis.annotate(
        "",
        xy=(float(tip[0]), float(tip[1])),
        xytext=(float(tail[0]), float(tail[1])),
        arrowprops={"arrowstyle": "-|>", "color": BLUE, "lw": 1.6, "shrinkA": 0, "shrinkB": 0},
    )


def _circle(axis: Axes, at: FloatArray, radius: float) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 61)
    axis.plot(at[0] + radius * np.cos(turn), at[1] + radius * np.sin(turn), color=FAINT, linewidth=0.8, alpha=0.7)


def _plain(axis: Axes) -> None:
    axis.tick_params(colors=FAINT, labelsize=8)
    for spine in axis.spines.values():
        spine.set_visible(False)


def _round_down(value: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not more than `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(each for each in (1.0, 2.0, 5.0) if each * power <= value * (1.0 + 1e-9)))


def _footnote(rig: Rig) -> str:
    parts = []
    for name, camera in rig.cameras.items():
        stated = camera.pose_provenance
        if stated.covariance is None:
            parts.append(f"{name}: no error stated, 0.1 px on four fiducials assumed")
        else:
            n = "" if stated.n is None else f" from {stated.n} fiducials"
            when = "" if stated.date is None else f", {stated.date}"
            parts.append(f"{name}: pose{n}{when}")
    return "; ".join(parts)
