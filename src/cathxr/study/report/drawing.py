"""How pictures of a report look, and how a drawing becomes one: an SVG for the screen and a PNG for paper."""

import io
from collections.abc import Callable, Sequence

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from cathxr.study.report.document import Figure

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of the conditions in the study's order: Okabe and Ito's, told apart by everybody."""
MARKS = ("o", "s", "^", "D", "v", "P")
INK, SOFT, LINE = "#1b2330", "#586273", "#d9dee6"
_MM = 1.0 / 25.4
_DPI = 220
_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.0,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "text.color": INK,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "cathxr",
    "path.simplify": True,
}


def drawn(draw: Callable[[Canvas], None], *, width_mm: float, height_mm: float, caption: str, alt: str) -> Figure:
    """Return what `draw` draws, both ways. The same data give the same bytes."""
    with matplotlib.rc_context(_STYLE):  # type: ignore[arg-type]
        canvas = Canvas(figsize=(width_mm * _MM, height_mm * _MM), layout="constrained")
        draw(canvas)
        svg, png = io.BytesIO(), io.BytesIO()
        canvas.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
        canvas.savefig(png, format="png", dpi=_DPI, metadata={"Software": None})
    return Figure(caption, alt, svg.getvalue(), png.getvalue(), width_mm, height_mm)


def colour_of(condition: str, conditions: Sequence[str]) -> str:
    """Return a condition's colour."""
    return COLOURS[conditions.index(condition) % len(COLOURS)]


def mark_of(condition: str, conditions: Sequence[str]) -> str:
    """Return a condition's mark, so that colour is not all that tells conditions apart."""
    return MARKS[conditions.index(condition) % len(MARKS)]


def time_axis(axes: Axes, *, log: bool, label: str) -> None:
    """Set the y axis up: logarithmic with plain numbers for what is compared as a ratio."""
    axes.set_ylabel(label + (" (log scale)" if log else ""))
    if log:
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        ticks = [
            each * 10.0**power
            for power in range(-3, 7)
            for each in (1, 1.5, 2, 3, 4, 5, 7)
            if low <= each * 10**power <= high
        ]
        axes.set_yticks(ticks, [f"{each:g}" for each in ticks])
        axes.minorticks_off()
    else:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.grid(axis="y", color=LINE, linewidth=0.6)
    axes.set_axisbelow(True)
