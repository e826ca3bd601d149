"""The look of every calibration picture, and how a figure becomes a PNG."""

from io import BytesIO

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

INK, FAINT, GRID = "#1d2733", "#6b7785", "#d9dee4"
GOOD, WARN, BAD, BLUE = "#1a9850", "#e08214", "#d73027", "#2166ac"
COLOURMAP = "viridis"


def new_figure(width_in: float = 8.0, height_in: float = 4.8) -> Figure:
    """Return an empty figure that draws without a screen and touches no global state."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def png(figure: Figure, *, dpi: int = 130) -> bytes:
    """Return the figure as PNG."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()
