"""The flow of participants as a diagram."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import FancyBboxPatch

from cathxr.study.analysis.flow import Flow
from cathxr.study.report.document import Figure
from cathxr.study.report.drawing import SOFT, drawn

_MOST_ARMS = 4


def flow_diagram(flow: Flow) -> Figure | None:
    """Return the diagram: joined, allocated to each order, began, analysed; None with no or too many orders."""
    if not 1 <= len(flow.arms) <= _MOST_ARMS:
        return None

    def draw(canvas: Canvas) -> None:
        axes = canvas.add_subplot()
        axes.set_axis_off()
        axes.set_xlim(0.0, 1.0)
        axes.set_ylim(0.0, 1.0)
        count = len(flow.arms)
        _box(axes, 0.5, 0.88, f"Joined\nn = {flow.participants}", 0.26)
        if flow.not_allocated:
            _box(axes, 0.86, 0.88, f"Not allocated yet\nn = {flow.not_allocated}", 0.24)
            _arrow(axes, (0.63, 0.88), (0.74, 0.88))
        for at, arm in enumerate(flow.arms):
            x = (at + 0.5) / count
            wide = min(0.36, 0.9 / count)
            _box(axes, x, 0.62, f"Allocated to {arm.name}\nn = {arm.allocated}", wide)
            none = arm.allocated - arm.began
            _box(axes, x, 0.36, f"Began\nn = {arm.began}" + (f" (not: {none})" if none else ""), wide)
            lost = arm.began - arm.analysed
            told = f"Analysed: n = {arm.analysed}, {arm.trials} trials" + (
                f"\nwithout a valid trial: {lost}" if lost else ""
            )
            _box(axes, x, 0.10, told, wide)
            _arrow(axes, (0.5, 0.80), (x, 0.70))
            _arrow(axes, (x, 0.54), (x, 0.44))
            _arrow(axes, (x, 0.28), (x, 0.18))

    told = "; ".join(
        f"{arm.name}: allocated {arm.allocated}, began {arm.began}, analysed {arm.analysed}" for arm in flow.arms
    )
    return drawn(
        draw, width_mm=150.0, height_mm=76.0, caption="Flow of participants, by the order of views.",
        alt=f"{flow.participants} joined; {told}",
    )  # fmt: skip


def _box(axes: Axes, x: float, y: float, text: str, wide: float) -> None:
    axes.add_patch(
        FancyBboxPatch(
            (x - wide / 2, y - 0.075),
            wide,
            0.15,
            boxstyle="round,pad=0.0,rounding_size=0.015",
            linewidth=0.9,
            edgecolor=SOFT,
            facecolor="#f4f6f9",
        )
    )
    axes.text(x, y, text, ha="center", va="center", fontsize=7.8, linespacing=1.35)


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.annotate(
        "", end, start, arrowprops={"arrowstyle": "-|>", "color": SOFT, "lw": 0.9, "shrinkA": 0, "shrinkB": 1}
    )
