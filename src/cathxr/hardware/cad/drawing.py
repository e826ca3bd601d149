"""Hidden-line drawings as SVG, from the CAD kernel: three views of a part, third angle, with its main dimensions."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.shapes import Solid
from cathxr.hardware.dimensions import dimension_across, dimension_up, text_at

_CURVE_POINTS = 33
_ARC_OFF_MM = 2e-3
_LETTER_SHARE = 0.021
_VIEWS = (
    ("front", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    ("right", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ("above", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
)


@dataclass(frozen=True, eq=False)
class Line:
    """One edge in a view. points (N, 2), mm; radius, centre: of the circle on which it lies, None for others."""

    points: FloatArray
    radius: float | None = None
    centre: FloatArray | None = None

    @property
    def is_whole(self) -> bool:
        """Whether it ends where it began."""
        return bool(np.linalg.norm(self.points[0] - self.points[-1]) < _ARC_OFF_MM)


def projected(solid: Solid, towards: Sequence[float], up: Sequence[float]) -> tuple[list[Line], list[Line]]:
    """Return the visible and the hidden edges, mm: right and up in the view."""
    eye = tuple(1e4 * float(each) for each in towards)
    visible, hidden = solid.project_to_viewport(eye, tuple(up), (0.0, 0.0, 0.0))
    return [_line(each) for each in visible], [_line(each) for each in hidden]


def three_views(solid: Solid, title: str) -> str:
    """Return a drawing of a part: front, right of it the view from the right, over it the one from above.

    Hidden edges are dashed; circles that are whole are listed by their diameters under each view.
    """
    views = {name: projected(solid, towards, up) for name, towards, up in _VIEWS}
    boxes = {name: _bounds([*visible, *hidden]) for name, (visible, hidden) in views.items()}
    size = {name: high - low for name, (low, high) in boxes.items()}
    letter = max(2.6, _LETTER_SHARE * float(size["front"][0] + size["right"][0] + size["above"][1]))
    gap = 7.0 * letter
    corner = {
        "front": np.zeros(2),
        "right": np.array([size["front"][0] + gap, 0.0]),
        "above": np.array([0.0, size["front"][1] + gap]),
    }
    bodies: list[str] = []
    for name, (visible, hidden) in views.items():
        shift = corner[name] - boxes[name][0]
        thin, dash = 0.03 * letter, f"{0.3 * letter:.2f} {0.2 * letter:.2f}"
        bodies += _paths(hidden, shift, f'stroke="#8a8a8a" stroke-width="{thin:.3f}" stroke-dasharray="{dash}"')
        bodies += _paths(visible, shift, f'stroke="#000000" stroke-width="{2.0 * thin:.3f}"')
        below = corner[name] + np.array([0.0, -(3.6 if name == "front" else 1.8) * letter])
        bodies += text_at(below, f"{name}{_holes(visible)}", 0.8 * letter, anchor="start")
    wide, deep, tall = size["front"][0], size["above"][1], size["front"][1]
    bodies += dimension_across(np.zeros(2), wide, letter)
    bodies += dimension_up(np.zeros(2), tall, letter)
    bodies += dimension_up(corner["above"], deep, letter)
    low = np.array([-6.0 * letter, -7.0 * letter])
    high = np.array([corner["right"][0] + max(float(size["right"][0]), 12.0 * letter) + 2.0 * letter,
                     corner["above"][1] + deep + 2.0 * letter])  # fmt: skip
    bodies += text_at(np.array([0.0, -6.2 * letter]), f"{title}: mm, third angle", letter, anchor="start", bold=True)
    return _page(low, high, title, "".join(bodies))


def _page(low: FloatArray, high: FloatArray, title: str, bodies: str) -> str:
    wide, tall = (high - low).tolist()
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.1f}mm" height="{tall:.1f}mm" '
        f'viewBox="{low[0]:.2f} {-high[1]:.2f} {wide:.2f} {tall:.2f}">\n<title>{title}</title>\n'
        f'<rect x="{low[0]:.2f}" y="{-high[1]:.2f}" width="{wide:.2f}" height="{tall:.2f}" fill="#ffffff"/>\n'
        f'<g fill="none" stroke-linecap="round" font-family="sans-serif">\n{bodies}</g>\n</svg>\n'
    )


def _holes(visible: Sequence[Line]) -> str:
    """Return how many whole circles of each diameter a view shows, as text; empty where there is none."""
    found = Counter(round(2.0 * each.radius, 1) for each in visible if each.radius is not None and each.is_whole)
    listed = [f"{count} x Ø{diameter:g}" for diameter, count in sorted(found.items(), reverse=True)]
    return f": {', '.join(listed)}" if listed else ""


def _paths(lines: Sequence[Line], shift: FloatArray, style: str) -> Iterator[str]:
    parts = []
    for line in lines:
        points = line.points + shift
        if line.radius is None:
            parts.append("M " + " ".join(f"{x:.2f},{-y:.2f}" for x, y in points))
        else:
            parts.append(_arc(points, line.radius))
    if parts:
        yield f'<path d="{" ".join(parts)}" {style}/>\n'


def _arc(points: FloatArray, radius: float) -> str:
    """Return an arc as two true arcs of SVG, which are drawn as such at any size."""
    first, middle, last = points[0], points[len(points) // 2], points[-1]
    if np.linalg.norm(first - last) < _ARC_OFF_MM:
        last = first
    quarter = points[len(points) // 4]
    a, b = quarter - first, middle - first
    # In SVG y points down, so that a turn to the left goes there with sweep 0.
    sweep = 0 if a[0] * b[1] - a[1] * b[0] > 0 else 1
    text = f"M {first[0]:.3f},{-first[1]:.3f}"
    for end in (middle, last):
        text += f" A {radius:.3f} {radius:.3f} 0 0 {sweep} {end[0]:.3f},{-end[1]:.3f}"
    return text


def _line(edge: Solid) -> Line:
    kind = str(edge.geom_type)
    count = 2 if kind.endswith(".LINE") else _CURVE_POINTS
    places = [edge @ float(at) for at in np.linspace(0.0, 1.0, count)]
    points = np.array([[each.X, each.Y] for each in places])
    if count == 2:
        return Line(points)
    # What the kernel calls a spline is a circle more often than not.
    rows = np.column_stack([2.0 * points, np.ones(count)])
    solved = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    centre, radius = solved[:2], float(np.sqrt(max(solved[2] + solved[:2] @ solved[:2], 0.0)))
    off = np.abs(np.linalg.norm(points - centre, axis=1) - radius).max()
    if off < _ARC_OFF_MM and radius < 1e3:
        return Line(points, radius, centre)
    return Line(points)


def _bounds(lines: Sequence[Line]) -> tuple[FloatArray, FloatArray]:
    points = np.concatenate([each.points for each in lines])
    return points.min(axis=0), points.max(axis=0)
