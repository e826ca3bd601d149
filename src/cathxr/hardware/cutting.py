"""Sheet parts as DXF (R12, mm) and SVG (mm), moved out by half the kerf so that what is cut has the drawn size."""

from collections.abc import Iterator

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.panels import Panel

_MARGIN_MM = 5.0


def offset(outline: FloatArray, by_mm: float) -> FloatArray:
    """Return a closed polygon (N, 2) with its edges moved outwards (inwards: negative), corners kept sharp."""
    points = outline if _turns_left(outline) else outline[::-1]
    before = points - np.roll(points, 1, axis=0)
    after = np.roll(points, -1, axis=0) - points
    first, second = (np.column_stack([each[:, 1], -each[:, 0]]) / np.linalg.norm(each, axis=1)[:, None]
                     for each in (before, after))  # fmt: skip
    return np.asarray(points + by_mm * (first + second) / (1.0 + (first * second).sum(axis=1))[:, None])


def paths(panel: Panel, kerf_mm: float) -> tuple[list[FloatArray], FloatArray]:
    """Return what the laser follows: closed polygons (inner ones first) and circles (M, 3), centre and diameter."""
    inner = [offset(each, -0.5 * kerf_mm) for each in panel.cutouts]
    circles = panel.circles - np.array([0.0, 0.0, kerf_mm])
    return [*inner, offset(panel.outline, 0.5 * kerf_mm)], circles


def dxf_text(panel: Panel, kerf_mm: float) -> str:
    """Return a DXF of the oldest common form (R12), which every laser's program reads. Unit: mm."""
    polygons, circles = paths(panel, kerf_mm)
    lines = ["0", "SECTION", "2", "HEADER", "9", "$ACADVER", "1", "AC1009", "9", "$INSUNITS", "70", "4", "0", "ENDSEC"]
    lines += ["0", "SECTION", "2", "ENTITIES"]
    for u, v, diameter in circles:
        lines += [
            "0",
            "CIRCLE",
            "8",
            "CUT",
            "10",
            f"{u:.4f}",
            "20",
            f"{v:.4f}",
            "30",
            "0.0",
            "40",
            f"{diameter / 2:.4f}",
        ]
    for polygon in polygons:
        lines += ["0", "POLYLINE", "8", "CUT", "66", "1", "70", "1", "10", "0.0", "20", "0.0", "30", "0.0"]
        for u, v in polygon:
            lines += ["0", "VERTEX", "8", "CUT", "10", f"{u:.4f}", "20", f"{v:.4f}", "30", "0.0"]
        lines += ["0", "SEQEND", "8", "CUT"]
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF"]) + "\n"


def svg_text(panel: Panel, kerf_mm: float) -> str:
    """Return the same as SVG, one user unit a millimetre, v upwards."""
    polygons, circles = paths(panel, kerf_mm)
    low, high = polygons[-1].min(axis=0) - _MARGIN_MM, polygons[-1].max(axis=0) + _MARGIN_MM
    wide, tall = high - low
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.4f}mm" height="{tall:.4f}mm" '
        f'viewBox="{low[0]:.4f} {-high[1]:.4f} {wide:.4f} {tall:.4f}">\n'
        f"<title>{panel.title}, {panel.thickness_mm:g} mm {panel.material}, {panel.quantity} pieces</title>\n"
        '<g fill="none" stroke="#000000" stroke-width="0.1">\n'
        + "".join(_svg_shapes(polygons, circles))
        + "</g>\n</svg>\n"
    )


def _svg_shapes(polygons: list[FloatArray], circles: FloatArray) -> Iterator[str]:
    for u, v, diameter in circles:
        yield f'<circle cx="{u:.4f}" cy="{-v:.4f}" r="{diameter / 2:.4f}"/>\n'
    for polygon in polygons:
        points = " ".join(f"{u:.4f},{-v:.4f}" for u, v in polygon)
        yield f'<polygon points="{points}"/>\n'


def _turns_left(outline: FloatArray) -> bool:
    x, y = outline.T
    return bool(x @ np.roll(y, -1) - y @ np.roll(x, -1) > 0)
