"""Pictures of what happens over time: learning curves, and how many trials are not yet completed."""

import math

from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.report.document import Figure
from cathxr.study.report.drawing import INK, SOFT, colour_of, drawn, mark_of, time_axis

_MOST_CURVES = 60
"""Participants whose own curves are drawn; the mean is of all."""


def learning_curves(analysis: Analysis) -> Figure | None:
    """Return every participant's trials in order and their mean; None with fewer than two trials each."""
    learning, data = analysis.learning, analysis.data
    if len(learning.places) < 2:
        return None
    measure = learning.measure
    keys = [each.key for each in data.conditions]

    def shown(value: float) -> float:
        return math.exp(value) if measure.log else value

    def draw(canvas: Canvas) -> None:
        axes = canvas.add_subplot()
        for curve in learning.curves[:_MOST_CURVES]:
            values = [shown(each) for each in curve.values]
            axes.plot(curve.ordinals, values, "-", color=SOFT, linewidth=0.5, alpha=0.55, zorder=1)
            for at, value, key in zip(curve.ordinals, values, curve.conditions, strict=True):
                axes.plot(at, value, mark_of(key, keys), color=colour_of(key, keys), markersize=3.2, alpha=0.6)
        places = [each for each in learning.places if each.n > 1] or list(learning.places)
        axes.plot(
            [each.ordinal for each in places], [shown(each.mean) for each in places], "-", color=INK, linewidth=2.2
        )
        axes.set_xlabel("trial of the participant, in the order in which they were done")
        axes.set_xticks([each.ordinal for each in learning.places])
        time_axis(axes, log=measure.log, label=measure.label)
        handles = [
            Line2D(
                [],
                [],
                linestyle="",
                color=colour_of(each.key, keys),
                marker=mark_of(each.key, keys),
                markersize=4.5,
                label=each.name,
            )
            for each in data.conditions
        ]
        handles.append(Line2D([], [], color=INK, linewidth=2.2, label="mean"))
        canvas.legend(handles=handles, loc="outside upper right", ncols=len(handles))

    return drawn(
        draw,
        width_mm=150.0,
        height_mm=78.0,
        caption=(
            f"Learning curves: {measure.name} of each participant's trials in order (thin), and their "
            f"{'geometric ' if measure.log else ''}mean (thick). Views are mixed in the mean where orders differ."
        ),
        alt="Means by trial: " + "; ".join(f"{each.ordinal}: {shown(each.mean):.3g}" for each in learning.places[:30]),
    )


def not_yet_completed(analysis: Analysis) -> Figure | None:
    """Return the Kaplan-Meier curves of the views; None without trials."""
    views, data = analysis.censoring.views, analysis.data
    if not views:
        return None
    keys = [each.key for each in data.conditions]

    def draw(canvas: Canvas) -> None:
        axes = canvas.add_subplot()
        for at, view in enumerate(views):
            colour, line = colour_of(view.condition, keys), ("-", "--", ":", "-.")[at % 4]
            end = max(float(view.time_s[-1]), float(view.censored_s[-1]) if len(view.censored_s) else 0.0)
            times, shares = [*view.time_s, end], [*view.not_yet, view.not_yet[-1]]
            axes.step(
                times, shares, line, where="post", color=colour, label=data.name_of(view.condition), linewidth=1.6
            )
            for cut in view.censored_s:
                before = [share for time, share in zip(view.time_s, view.not_yet, strict=True) if time <= cut]
                axes.plot(cut, before[-1], "|", color=colour, markersize=8, markeredgewidth=1.2)
        axes.set_ylim(0.0, 1.02)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("time since the trial began, s")
        axes.set_ylabel("share of trials not yet completed")
        canvas.legend(loc="outside upper right", ncols=len(views))

    medians = "; ".join(
        f"{data.name_of(each.condition)}: median "
        + (f"{each.median_s:.0f} s" if each.median_s is not None else "not reached within the limit")
        for each in views
    )
    cut = " Upright strokes: trials that the time limit cut." if analysis.censoring.censored else ""
    return drawn(
        draw,
        width_mm=120.0,
        height_mm=68.0,
        caption=f"Trials not yet completed over time (Kaplan-Meier). {medians}.{cut}",
        alt=f"Falling step curves of both views. {medians}.",
    )
