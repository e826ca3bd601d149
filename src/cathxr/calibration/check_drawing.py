"""Pictures of a check: where and when the two views disagree, what a phantom shows, how two signals lag."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cathxr.calibration.drawing import BAD, BLUE, COLOURMAP, FAINT, GOOD, GRID, INK, WARN, new_figure, png
from cathxr.calibration.drift import SessionCheck
from cathxr.calibration.phantom import PhantomResult
from cathxr.calibration.timing import TimingResult
from cathxr.calibration.timing_signals import Lag, Signal
from cathxr.core import Roi

_LEAST_SCALE_MM = 0.1
_SESSION_COLOURS = (BLUE, WARN, GOOD, BAD, FAINT)
_ARROW_SHARE = 0.12


def check_png(check: SessionCheck, roi: Roi) -> bytes:
    """Return the disagreement of the two views over the ROI, seen from above and from the front, and over time."""
    figure, above, front, bar, time = _laid_out()
    tips, gaps = check.pairs.tip_box, check.gaps_mm
    limit = max(_LEAST_SCALE_MM, float(np.quantile(np.abs(gaps), 0.98)))
    shown = None
    for axes, axis, name in ((above, 1, "y"), (front, 2, "z")):
        shown = axes.scatter(tips[:, 0], tips[:, axis], c=gaps, s=9, cmap="coolwarm", vmin=-limit, vmax=limit)
        axes.set(xlabel="x, mm (insertion)", ylabel=f"{name}, mm")
        axes.set_xlim(roi.min_mm[0], roi.max_mm[0])
        axes.set_ylim(roi.min_mm[axis], roi.max_mm[axis])
        axes.set_aspect("equal")
        _plain(axes)
    above.set_title("Where the two views disagree: seen from above", color=INK, fontsize=10)
    front.set_title("seen from the front", color=INK, fontsize=10)
    assert shown is not None
    figure.colorbar(shown, cax=bar, label="distance of the two rays, mm")
    for index, row in enumerate(check.sessions):
        own = check.pairs.session == index
        minutes = (check.pairs.t_s[own] - check.pairs.t_s[own].min()) / 60.0
        colour = _SESSION_COLOURS[index % len(_SESSION_COLOURS)]
        time.plot(minutes, gaps[own], ".", ms=2.5, color=colour, label=row.name)
    time.axhline(0.0, color=INK, lw=0.8)
    time.set(
        xlabel="time in the session, minutes", ylabel="distance of the two rays, mm", ylim=(-1.3 * limit, 1.3 * limit)
    )
    time.legend(loc="upper right", fontsize=8, markerscale=3, frameon=False)
    _plain(time)
    return png(figure)


def phantom_png(result: PhantomResult, roi: Roi) -> bytes:
    """Return each visit's error: as arrows from above and from the front, and as bars, before and after alignment."""
    figure, above, front, bar, bars = _laid_out()
    names = [each.name for each in result.phantom.holes]
    places = {each.name: each.position_mm for each in result.phantom.holes}
    length = np.array([np.linalg.norm(each.error) for each in result.visits])
    stretch = _ARROW_SHARE * float(np.ptp([roi.min_mm[0], roi.max_mm[0]])) / max(1e-6, float(length.max()))
    shown = None
    for axes, axis, name in ((above, 1, "y"), (front, 2, "z")):
        at = np.stack([places[each.hole] for each in result.visits])[:, [0, axis]]
        error = np.stack([each.error for each in result.visits])[:, [0, axis]]
        axes.plot(*result.phantom.positions_mm[:, [0, axis]].T, "o", mfc="none", mec=FAINT, ms=6)
        shown = axes.quiver(
            at[:, 0], at[:, 1], *(stretch * error).T, length, cmap=COLOURMAP, angles="xy", scale_units="xy", scale=1.0,
            width=0.006,
        )  # fmt: skip
        axes.set(xlabel="x, mm (insertion)", ylabel=f"{name}, mm")
        axes.set_xlim(roi.min_mm[0], roi.max_mm[0])
        axes.set_ylim(roi.min_mm[axis], roi.max_mm[axis])
        axes.set_aspect("equal")
        _plain(axes)
    above.set_title(f"Errors from above (arrows {stretch:.0f} times as long)", color=INK, fontsize=10)
    front.set_title("from the front", color=INK, fontsize=10)
    assert shown is not None
    figure.colorbar(shown, cax=bar, label="tip error, mm")
    index = np.array([names.index(each.hole) for each in result.visits])
    aligned = np.array([np.linalg.norm(each.aligned) for each in result.visits])
    bars.plot(index - 0.12, length, "o", color=BLUE, ms=5, label="as it is")
    bars.plot(index + 0.12, aligned, "s", color=WARN, ms=4, label="after a rigid alignment of the phantom")
    bars.axhline(result.rows[0].mean, color=BLUE, lw=0.8, ls="--", label=f"mean {result.rows[0].mean:.2f} mm")
    bars.set_xticks(range(len(names)), names)
    bars.set(xlabel="hole", ylabel="tip error, mm", ylim=(0.0, 1.25 * float(max(length.max(), aligned.max()))))
    bars.legend(loc="upper left", fontsize=8, frameon=False, ncols=3)
    _plain(bars)
    return png(figure)


def timing_png(result: TimingResult) -> bytes:
    """Return for each delay that was measured: the two signals brought together, and the correlation over the lag."""
    rows: list[tuple[str, str, Lag, tuple[Signal, Signal], float]] = [
        ("cameras", "tip's shared coordinate, mm", result.cameras, result.camera_signals, 1.0)
    ]
    if result.encoder is not None and result.encoder_signals is not None:
        rows.append(("encoder", "roll, degrees", result.encoder, result.encoder_signals, float(np.rad2deg(1.0))))
    figure = new_figure(11.0, 3.4 * len(rows))
    grid = figure.add_gridspec(len(rows), 2, width_ratios=(3.0, 1.2))
    for index, (name, label, lag, (first, second), unit) in enumerate(rows):
        motion, curve = figure.add_subplot(grid[index, 0]), figure.add_subplot(grid[index, 1])
        zero = float(first.t_s[0])
        other = second.value * lag.gain
        other = other - other.mean() + first.value.mean()
        labels = (
            ("top camera", "front camera, moved by the lag")
            if index == 0
            else ("pictures", "encoder, moved by the lag")
        )
        motion.plot(first.t_s - zero, unit * first.value, color=BLUE, lw=1.6, label=labels[0])
        motion.plot(second.t_s - lag.lag_s - zero, unit * other, color=WARN, lw=1.0, ls="--", label=labels[1])
        motion.set(xlabel="time, s", ylabel=label)
        motion.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=8, frameon=False)
        curve.plot(1e3 * lag.lags_s, lag.correlations, color=INK, lw=1.2)
        curve.axvline(1e3 * lag.lag_s, color=BAD, lw=1.0)
        curve.set(xlabel="lag, ms", ylabel="correlation", ylim=(-1.05, 1.1))
        curve.set_title(f"{name}: {1e3 * lag.lag_s:+.2f} ± {1e3 * lag.std_s:.2f} ms", color=INK, fontsize=10)
        _plain(motion)
        _plain(curve)
    return png(figure)


def _laid_out() -> tuple[Figure, Axes, Axes, Axes, Axes]:
    """Return (figure, two square maps, the place of their colour bar, a wide plot below)."""
    figure = new_figure(11.0, 8.4)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 0.04), height_ratios=(1.5, 1.0))
    maps = [figure.add_subplot(grid[0, column]) for column in range(3)]
    return figure, maps[0], maps[1], maps[2], figure.add_subplot(grid[1, :])


def _plain(axes: Axes) -> None:
    axes.grid(color=GRID, lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=FAINT, labelsize=8)
    for side in axes.spines.values():
        side.set_color(GRID)
