"""A picture of the survey's ratings: every answer, mean and standard deviation by question."""

from collections import Counter

from matplotlib.figure import Figure as Canvas

from cathxr.study.analysis.survey_table import Row
from cathxr.study.report.document import Figure
from cathxr.study.report.drawing import COLOURS, INK, LINE, drawn


def ratings(rows: tuple[Row, ...], name: str) -> Figure:
    """Return the ratings of one survey on one occasion: areas of the dots by how many gave that rating."""

    def draw(canvas: Canvas) -> None:
        axes = canvas.add_subplot()
        for at, row in enumerate(rows):
            for value, count in Counter(value for _, value in row.ratings).items():
                axes.scatter(value, at, s=22.0 * count, color=COLOURS[0], alpha=0.35, linewidths=0)
            spread = row.sd if row.sd is not None else 0.0
            axes.errorbar(row.mean, at, xerr=spread, fmt="D", color=INK, markersize=4, capsize=2.5, linewidth=1.0)
        axes.set_yticks(range(len(rows)), [row.item.item.upper() for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        lows = [row.item.low for row in rows if row.item.low is not None]
        highs = [row.item.high for row in rows if row.item.high is not None]
        if lows and highs:
            margin = 0.06 * (max(highs) - min(lows))
            axes.set_xlim(min(lows) - margin, max(highs) + margin)
        axes.set_xlabel("rating")
        axes.grid(axis="x", color=LINE, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.tick_params(axis="y", length=0)

    return drawn(
        draw,
        width_mm=120.0,
        height_mm=22.0 + 6.2 * len(rows),
        caption=f"{name}: ratings (area by how many gave it), mean (diamond) and sample standard deviation (line).",
        alt="Means: " + "; ".join(f"{row.item.item} {row.mean:.2f}" for row in rows),
    )
