"""Pictures of the tip's paths: in 3D and seen along each axis of the box. Gaps in a path stay gaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import MaxNLocator

from cathxr.core.arrays import FloatArray
from cathxr.study.analysis.analyse import Analysis
from cathxr.study.report.document import Figure
from cathxr.study.report.drawing import INK, LINE, colour_of, drawn

_PLANES = (("seen from above", 0, 1), ("seen from the front", 0, 2), ("seen from the inlet", 1, 2))
_AXES = ("x (insertion), mm", "y, mm", "z (up), mm")
_MOST_POINTS = 400
_WIDTH_MM, _MOST_MM = 170.0, 225.0
_LABELS_MM = 13.0
"""What an axis and its title take beside a picture."""


@dataclass(frozen=True, eq=False)
class TrialPath:
    """One trial's path. tip_box: (N, 3) mm in `box`; seen: (N,) bool, False where the tip was not tracked.

    targets_box: (M, 3) mm, the trial's targets, M may be 0.
    """

    trial: str
    condition: str
    tip_box: FloatArray
    seen: np.ndarray
    targets_box: FloatArray

    def runs(self) -> list[FloatArray]:
        """Return the stretches that were seen without a gap, thinned to what a picture can show."""
        edges = np.flatnonzero(np.diff(np.concatenate([[0], self.seen.astype(np.int8), [0]])))
        step = max(1, int(self.seen.sum()) // _MOST_POINTS)
        found = []
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            at = np.unique(np.append(np.arange(start, stop, step), stop - 1))
            found.append(self.tip_box[at])
        return found


def paths(analysis: Analysis, trial_paths: Sequence[TrialPath]) -> Figure | None:
    """Return a column of four pictures for each view that has paths; None without any."""
    data = analysis.data
    keys = [each.key for each in data.conditions]
    present = [each for each in data.conditions if any(path.condition == each.key for path in trial_paths)]
    if not present:
        return None
    every = np.concatenate([each.tip_box[each.seen] for each in trial_paths if each.seen.any()])
    if not len(every):
        return None
    low, high = every.min(axis=0), every.max(axis=0)
    margin = 0.05 * float((high - low).max()) + 1.0
    low, high = low - margin, high + margin

    spans = high - low
    wide = _WIDTH_MM / len(present) - _LABELS_MM
    scale = wide / spans[0]  # of paper to box, one for every plane, so that lengths can be compared
    heights = [scale * spans[1] + _LABELS_MM, scale * spans[2] + _LABELS_MM]
    space_mm = 0.75 * wide

    def draw(canvas: Canvas) -> None:
        rows = canvas.add_gridspec(4, len(present), height_ratios=[space_mm, *heights, heights[1]])
        for column, condition in enumerate(present):
            colour = colour_of(condition.key, keys)
            chosen = [each for each in trial_paths if each.condition == condition.key]
            space = canvas.add_subplot(rows[0, column], projection="3d")
            for path in chosen:
                for run in path.runs():
                    space.plot(run[:, 0], run[:, 1], run[:, 2], color=colour, linewidth=0.5, alpha=0.6)
                space.scatter(*path.targets_box.T, color=INK, s=6, depthshade=False)
            space.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
            space.set_box_aspect(tuple(spans), zoom=1.25)
            for axis in (space.xaxis, space.yaxis, space.zaxis):
                axis.set_major_locator(MaxNLocator(4))
            space.tick_params(labelsize=5.5, pad=-2)
            space.set_title(f"{condition.name}: {len(chosen)} trials", fontsize=9)
            for at, (title, across, up) in enumerate(_PLANES):
                axes = canvas.add_subplot(rows[1 + at, column])
                _plane(axes, chosen, across, up, colour)
                axes.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]), aspect="equal")
                axes.set_title(title, fontsize=8)

    shown = ", ".join(f"{sum(p.condition == c.key for p in trial_paths)} in {c.name}" for c in present)
    return drawn(
        draw,
        width_mm=_WIDTH_MM,
        height_mm=min(space_mm + sum(heights) + heights[1] + 8.0, _MOST_MM),
        caption=(
            f"Paths of the tip in the box, in 3D and by plane ({shown}); dots: targets. A line ends where the tip was "
            "not tracked and begins again where it was: nothing is drawn between."
        ),
        alt=f"Lines of the catheter tip's paths in 3D and in the three planes of the box, {shown}.",
    )


def _plane(axes: Axes, chosen: Sequence[TrialPath], across: int, up: int, colour: str) -> None:
    for path in chosen:
        for run in path.runs():
            axes.plot(run[:, across], run[:, up], color=colour, linewidth=0.5, alpha=0.6)
        axes.plot(path.targets_box[:, across], path.targets_box[:, up], "o", color=INK, markersize=2.5)
    axes.set_xlabel(_AXES[across], fontsize=6.5)
    axes.set_ylabel(_AXES[up], fontsize=6.5)
    axes.tick_params(labelsize=6)
    axes.grid(color=LINE, linewidth=0.5)
