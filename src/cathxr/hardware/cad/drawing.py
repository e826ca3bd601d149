"""Hidden-line drawings as SVG, from the CAD kernel: three views of a part with its outer dimensions."""

from collections.abc import Iterator, Sequence

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.shapes import Solid

_CURVE_POINTS = 17
_GAP_MM = 22.0
_TEXT_SHARE = 0.035
_VIEWS = (
    ("front", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    ("from the right", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ("from above", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
)


def projected(solid: Solid, towards: Sequence[float], up: Sequence[float]) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the visible and the hidden edges as polylines (N, 2), mm: right and up in the view."""
    eye = tuple(1e4 * float(each) for each in towards)
    visible, hidden = solid.project_to_viewport(eye, tuple(up), (0.0, 0.0, 0.0))
    return [_polyline(each) for each in visible], [_polyline(each) for each in hidden]


def three_views(solid: Solid, title: str) -> str:
    """Return a drawing of a part: three views side by side, hidden edges dashed, width and height of each view."""
    views = [(name, *projected(solid, towards, up)) for name, towards, up in _VIEWS]
    bodies: list[str] = []
    left = 0.0
    boxes = [_bounds([*visible, *hidden]) for _, visible, hidden in views]
    tallest = max(high[1] - low[1] for low, high in boxes)
    whole = sum(high[0] - low[0] for low, high in boxes) + _GAP_MM * (len(boxes) - 1)
    letter = max(2.5, _TEXT_SHARE * min(whole, 3.0 * tallest))
    for (name, visible, hidden), (low, high) in zip(views, boxes, strict=True):
        shift = np.array([left - low[0], -low[1]])
        bodies += _paths(hidden, shift, 'stroke="#999999" stroke-width="0.18" stroke-dasharray="1.2 0.8"')
        bodies += _paths(visible, shift, 'stroke="#000000" stroke-width="0.35"')
        bodies += _labels(name, left, high - low, letter)
        left += high[0] - low[0] + _GAP_MM
    margin = 3.0 * letter
    wide, tall = whole + 2.0 * margin, tallest + 2.0 * margin + 2.0 * letter
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.1f}mm" height="{tall:.1f}mm" '
        f'viewBox="{-margin:.2f} {-tallest - margin:.2f} {wide:.2f} {tall:.2f}">\n<title>{title}</title>\n'
        f'<rect x="{-margin:.2f}" y="{-tallest - margin:.2f}" width="{wide:.2f}" height="{tall:.2f}" fill="#ffffff"/>\n'
        f'<g fill="none" stroke-linecap="round" font-family="sans-serif">\n{"".join(bodies)}</g>\n</svg>\n'
    )


def _labels(name: str, left: float, size: FloatArray, letter: float) -> Iterator[str]:
    middle = left + 0.5 * size[0]
    style = f'fill="#000000" font-size="{letter:.2f}" text-anchor="middle"'
    text = f"{name}: {size[0]:.1f} x {size[1]:.1f}"
    yield f'<text x="{middle:.2f}" y="{1.8 * letter:.2f}" {style}>{text}</text>\n'


def _paths(lines: Sequence[FloatArray], shift: FloatArray, style: str) -> Iterator[str]:
    parts = []
    for line in lines:
        points = " ".join(f"{x:.2f},{-y:.2f}" for x, y in line + shift)
        parts.append(f"M {points}")
    if parts:
        yield f'<path d="{" ".join(parts)}" {style}/>\n'


def _polyline(edge: Solid) -> FloatArray:
    count = 2 if str(edge.geom_type).endswith("LINE") and not str(edge.geom_type).endswith("SPLINE") else _CURVE_POINTS
    points = [edge @ float(at) for at in np.linspace(0.0, 1.0, count)]
    return np.array([[each.X, each.Y] for each in points])


def _bounds(lines: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    points = np.concatenate(lines)
    return points.min(axis=0), points.max(axis=0)
