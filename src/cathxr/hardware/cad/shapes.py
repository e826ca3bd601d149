"""Solids from plain numbers: blocks, rods, prisms, marks, and where they are put. mm; angles in degrees where said."""

from collections.abc import Iterable, Sequence
from typing import Any

import build123d as b
import numpy as np

from cathxr.core import FloatArray

Solid = Any
"""A build123d shape; its types come and go with the version."""

_SEGMENTS = {
    "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc", "5": "afgcd", "6": "afgecd", "7": "abc",
    "8": "abcdefg", "9": "abcfgd", "F": "aefg", "T": "at",
}  # fmt: skip
_STROKES = {
    "a": (0.0, 1.0, 1.0, 1.0), "b": (1.0, 1.0, 1.0, 0.5), "c": (1.0, 0.5, 1.0, 0.0), "d": (0.0, 0.0, 1.0, 0.0),
    "e": (0.0, 0.5, 0.0, 0.0), "f": (0.0, 1.0, 0.0, 0.5), "g": (0.0, 0.5, 1.0, 0.5), "t": (0.5, 1.0, 0.5, 0.0),
}  # fmt: skip


def block(low: Sequence[float], high: Sequence[float]) -> Solid:
    """Return the block between two corners."""
    first, second = np.minimum(low, high), np.maximum(low, high)
    size, middle = second - first, 0.5 * (first + second)
    return b.Pos(*middle.tolist()) * b.Box(*size.tolist())


def rod(start: Sequence[float], axis: str, length: float, diameter: float) -> Solid:
    """Return a cylinder from `start` along an axis ("x", "y", "z"); a negative length goes the other way."""
    return cone(start, axis, length, diameter, diameter)


def cone(start: Sequence[float], axis: str, length: float, first: float, last: float) -> Solid:
    """Return a cone from `start`: diameters `first` there and `last` at the other end."""
    direction = np.eye(3)["xyz".index(axis)] * np.sign(length)
    plane = b.Plane(origin=tuple(start), z_dir=tuple(direction.tolist()))
    align = (b.Align.CENTER, b.Align.CENTER, b.Align.MIN)
    if first == last:
        return plane * b.Cylinder(0.5 * first, abs(length), align=align)
    return plane * b.Cone(0.5 * first, 0.5 * last, abs(length), align=align)


def ball(centre: Sequence[float], radius: float) -> Solid:
    """Return a ball."""
    return b.Pos(*centre) * b.Sphere(radius)


def prism(outline: FloatArray, height: float, *, base: float = 0.0) -> Solid:
    """Return a closed outline (N, 2) in x, y extruded along z from `base`."""
    face = b.make_face(b.Polyline(*[tuple(each) for each in outline.tolist()], close=True))
    return b.Pos(0.0, 0.0, base) * b.extrude(face, amount=height)


def cut(solid: Solid, tools: Iterable[Solid]) -> Solid:
    """Return a solid without the tools, in one operation; as it is where there are none."""
    tools = list(tools)
    return solid.cut(*tools) if tools else solid


def joined(first: Solid, *others: Solid) -> Solid:
    """Return several solids as one, in one operation."""
    return first.fuse(*others) if others else first


def mark(text: str, size: float, depth: float, *, width: float = 1.0) -> Solid:
    """Return strokes that spell digits, F and T, centred in x, y, from z = -depth to depth: to engrave with."""
    advance, half = 0.6 * size + 2.8 * width, 0.5 * width
    solids = []
    for index, letter in enumerate(text):
        left = (index - 0.5 * (len(text) - 1)) * advance - 0.3 * size
        for stroke in _SEGMENTS[letter]:
            x0, y0, x1, y1 = _STROKES[stroke]
            xs = sorted((left + 0.6 * size * x0, left + 0.6 * size * x1))
            ys = sorted((size * (y0 - 0.5), size * (y1 - 0.5)))
            solids.append(block((xs[0] - half, ys[0] - half, -depth), (xs[1] + half, ys[1] + half, depth)))
    return joined(solids[0], *solids[1:])


def placed(solid: Solid, columns: FloatArray, origin: Sequence[float]) -> Solid:
    """Return a solid moved so that its axes are `columns` (3, 3), a rotation, and its origin lies at `origin`."""
    plane = b.Plane(origin=tuple(origin), x_dir=tuple(columns[:, 0].tolist()), z_dir=tuple(columns[:, 2].tolist()))
    return solid.moved(plane.location)


def mirrored_x(solid: Solid) -> Solid:
    """Return a solid mirrored at x = 0."""
    return b.mirror(solid, about=b.Plane.YZ)


def bounds(solid: Solid) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest corner (3,) of a solid's bounding box."""
    box = solid.bounding_box()
    return np.array(tuple(box.min)), np.array(tuple(box.max))
