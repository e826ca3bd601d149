"""Pictures of the primary measure: by participant and view, and how each participant changed."""

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from cathxr.study.analysis.analyse import Analysis
from cathxr.study.analysis.data import Measure
from cathxr.study.analysis.describe import PersonValues, by_person
from cathxr.study.report.document import Figure
from cathxr.study.report.drawing import SOFT, colour_of, drawn, mark_of, time_axis

_MOST = 24
"""Participants in one picture; beyond, marks and codes would lie over each other."""
_MOST_PICTURES = 4


def times_by_participant(analysis: Analysis) -> tuple[Figure, ...]:
    """Return one picture for each 24 participants, up to four: trials as marks, a person's mean in a view as a line."""
    data, measure = analysis.data, analysis.data.primary
    people = by_person(data, measure)
    codes = list(dict.fromkeys(each.participant for each in people))
    figures = []
    for start in range(0, min(len(codes), _MOST * _MOST_PICTURES), _MOST):
        chosen = codes[start : start + _MOST]
        shown = [each for each in people if each.participant in chosen]
        part = f" (participants {start + 1} to {start + len(chosen)} of {len(codes)})" if len(codes) > _MOST else ""
        cut = any(any(each.cut) for each in shown)
        figures.append(
            drawn(
                lambda canvas, chosen=chosen, shown=shown: _by_participant(canvas, chosen, shown, analysis),  # type: ignore[misc]
                width_mm=170.0,
                height_mm=72.0,
                caption=(
                    f"{measure.name} of every trial by participant and view{part}. Marks: trials, from left to right "
                    f"as they were done; bars: the participant's {'geometric ' if measure.log else ''}mean in the view."
                    + (" Open marks with an arrow: cut by the time limit, the true time is longer." if cut else "")
                ),
                alt=_alt(shown, analysis),
            )
        )
    return tuple(figures)


def _alt(shown: Sequence[PersonValues], analysis: Analysis) -> str:
    data, measure = analysis.data, analysis.data.primary
    told = [
        f"{each.participant} {data.name_of(each.condition)} {_mean(each, measure):.3g} {measure.unit}".strip()
        for each in shown
    ]
    return f"{measure.name} by participant and view; means: " + "; ".join(told[:60])


def _mean(each: PersonValues, measure: Measure) -> float:
    if measure.log:
        return math.exp(sum(math.log(value) for value in each.values) / len(each.values))
    return sum(each.values) / len(each.values)


def _by_participant(canvas: Canvas, codes: Sequence[str], shown: Sequence[PersonValues], analysis: Analysis) -> None:
    data, measure = analysis.data, analysis.data.primary
    keys = [each.key for each in data.conditions]
    axes = canvas.add_subplot()
    wide = 0.8 / len(keys)
    for each in shown:
        left = codes.index(each.participant) - 0.4 + wide * keys.index(each.condition)
        colour, mark = colour_of(each.condition, keys), mark_of(each.condition, keys)
        axes.hlines(_mean(each, measure), left + 0.08 * wide, left + 0.92 * wide, color=colour, linewidth=1.8)
        for at, (value, cut) in enumerate(zip(each.values, each.cut, strict=True)):
            x = left + wide * (at + 1) / (len(each.values) + 1)
            face = "white" if cut else colour
            axes.plot(
                x, value, mark, markersize=4.0, color=colour, markerfacecolor=face, markeredgewidth=0.9, alpha=0.85
            )
            if cut:  # an arrow upwards: longer than this
                axes.annotate(
                    "", (x, value), (0, 11), textcoords="offset points", annotation_clip=False,
                    arrowprops={"arrowstyle": "<-", "color": colour, "lw": 1.0, "shrinkB": 3.0},
                )  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / max(low, 1e-9)) ** 0.05 if measure.log else high)
    axes.set_xticks(range(len(codes)), codes, rotation=0 if len(codes) <= 12 else 60)
    axes.set_xlim(-0.6, len(codes) - 0.4)
    axes.tick_params(axis="x", length=0)
    time_axis(axes, log=measure.log, label=measure.label)
    handles = [
        Line2D([], [], color=colour_of(each.key, keys), marker=mark_of(each.key, keys), markersize=4.5, label=each.name)
        for each in data.conditions
    ]
    canvas.legend(handles=handles, loc="outside upper right", ncols=len(handles))


def changes(analysis: Analysis) -> Figure | None:
    """Return each participant's means as a line from the reference to the other view; None without a pair of views."""
    data, measure = analysis.data, analysis.data.primary
    comparisons = [each for each in analysis.primary.comparisons if len(each.differences.d)]
    if not comparisons:
        return None
    means = {(each.participant, each.condition): _mean(each, measure) for each in by_person(data, measure)}
    sequences = sorted({data.sequence_of(code) for each in comparisons for code in each.differences.participants})
    dashes: dict[str, Any] = {each: ("-", "--", ":", "-.")[at % 4] for at, each in enumerate(sequences)}

    def draw(canvas: Canvas) -> None:
        every = canvas.subplots(1, len(comparisons), sharey=True, squeeze=False)[0]
        keys = [each.key for each in data.conditions]
        for axes, comparison in zip(every, comparisons, strict=True):
            ends = (comparison.reference.key, comparison.subject.key)
            for code in comparison.differences.participants:
                values = [means[code, each] for each in ends]
                axes.plot((0, 1), values, dashes[data.sequence_of(code)], color=SOFT, linewidth=1.0, zorder=1)
                for x, (key, value) in enumerate(zip(ends, values, strict=True)):
                    axes.plot(x, value, mark_of(key, keys), color=colour_of(key, keys), markersize=5)
            axes.set_xticks((0, 1), (comparison.reference.name, comparison.subject.name))
            axes.set_xlim(-0.3, 1.3)
            time_axis(axes, log=measure.log, label=measure.label)
        handles = [Line2D([], [], color=SOFT, linestyle=dashes[each], label=data.order_of(each)) for each in sequences]
        canvas.legend(handles=handles, loc="outside upper right", ncols=1, title="order of views", title_fontsize=7.5)

    same = "; ".join(
        f"{each.effects.same_way} of {each.effects.n} changed in the direction of the mean"
        for each in comparisons
        if each.effects is not None
    )
    return drawn(
        draw,
        width_mm=62.0 + 48.0 * len(comparisons),
        height_mm=80.0,
        caption=f"Each participant's mean in both views ({same}). The kind of line says in which order they had them.",
        alt=f"Lines from the participants' mean {measure.name.lower()} in one view to that in the other. {same}.",
    )
