"""The pictures of docs/accuracy.md: tip error over the ROI and over the tip's speed."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cathxr.app.bench_accuracy import Errors
from cathxr.core import FloatArray

if TYPE_CHECKING:
    from cathxr.app.bench_accuracy_page import Alone

_EXACT, _POSED, _THIRD = "#1f6fb2", "#d1691b", "#3a8a4d"
_BINS = 9
_LEAST_IN_BIN = 12
_DPI = 110


def place_picture(places: Mapping[str, tuple[Errors, Errors]], alone: "Alone", path: Path) -> None:
    """Write the tip error along x, y and z, and the calibration's own error in the planes y = 0 and x = middle."""
    plt = _pyplot()
    figure, axes = plt.subplots(2, 3, figsize=(12.0, 7.0), layout="constrained")
    exact, posed = (_joined([each[which] for each in places.values()]) for which in (0, 1))
    for column, name in enumerate("xyz"):
        panel = axes[0, column]
        _scatter(panel, posed[0][:, column], posed[1], _POSED, "poses from four fiducials")
        _scatter(panel, exact[0][:, column], exact[1], _EXACT, "exact poses")
        panel.set(xlabel=f"true tip, {name} in the box, mm", yscale="log")
    axes[0, 0].set_ylabel("tip error, mm")
    axes[0, 0].legend(loc="lower left", fontsize=8)
    grid = alone.rms_mm.reshape(alone.shape)
    points = alone.points_box.reshape(*alone.shape, 3)
    middle = [n // 2 for n in alone.shape]
    planes = (
        (points[:, middle[1], :, 0], points[:, middle[1], :, 2], grid[:, middle[1], :], "x", "z", "y = 0"),
        (points[:, :, middle[2], 0], points[:, :, middle[2], 1], grid[:, :, middle[2]], "x", "y", "z = 0"),
        (points[middle[0], :, :, 1], points[middle[0], :, :, 2], grid[middle[0], :, :], "y", "z", "x in the middle"),
    )
    levels = np.linspace(float(grid.min()), float(grid.max()), 13)
    for panel, (across, up, values, first, second, where) in zip(axes[1], planes, strict=True):
        filled = panel.contourf(across, up, values, levels=levels, cmap="viridis")
        panel.set(xlabel=f"{first}, mm", ylabel=f"{second}, mm", title=f"calibration alone, {where}", aspect="equal")
    figure.colorbar(filled, ax=axes[1], label="RMS error, mm", shrink=0.9, format="%.2f")
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})
    plt.close(figure)


def speed_picture(exposures: Mapping[float, Errors], path: Path) -> None:
    """Write the tip error over the tip's true speed, for several exposures."""
    plt = _pyplot()
    figure, panel = plt.subplots(figsize=(8.0, 4.2), layout="constrained")
    for (exposure, errors), colour in zip(exposures.items(), (_THIRD, _EXACT, _POSED), strict=False):
        _scatter(panel, np.array(errors.speed_mm_s), np.array(errors.tip_mm), colour, f"exposure {exposure:g} ms")
    panel.set(xlabel="true speed of the tip, mm/s", ylabel="tip error, mm", yscale="log", xlim=(0.0, None))
    panel.set_title("Scene quick, exact poses; lines: median", fontsize=10)
    panel.legend(fontsize=8)
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})
    plt.close(figure)


def _joined(several: list[Errors]) -> tuple[FloatArray, FloatArray]:
    """Return where the true tips were (N, 3) mm, and the errors (N,) mm."""
    places = [place for each in several for place in each.box_mm]
    return np.array(places).reshape(-1, 3), np.array([error for each in several for error in each.tip_mm])


def _scatter(panel: Any, across: FloatArray, errors: FloatArray, colour: str, name: str) -> None:
    """Draw every pair, and the median of pairs that are alike."""
    panel.scatter(across, np.maximum(errors, 1e-4), s=5, color=colour, alpha=0.4, linewidths=0)
    if not across.size:
        return
    edges = np.linspace(float(across.min()), float(across.max()) + 1e-9, _BINS + 1)
    which = np.digitize(across, edges) - 1
    middles = [
        (0.5 * (edges[i] + edges[i + 1]), float(np.median(errors[which == i])))
        for i in range(_BINS)
        if np.count_nonzero(which == i) >= _LEAST_IN_BIN
    ]
    panel.plot([at for at, _ in middles], [median for _, median in middles], color=colour, linewidth=2, label=name)
    panel.grid(True, which="both", alpha=0.2)


def _pyplot() -> Any:
    """Return pyplot with a backend that needs no screen."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
