"""Screws with their nuts, and springs, as bought solids. A screw's own z runs from under its head to its end."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache

import build123d as b
import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.part import ALWAYS, BOUGHT, Part, Place
from cathxr.hardware.cad.shapes import Solid, cut, joined, prism, rod
from cathxr.hardware.screws import NUT_MM, Joint

STEEL, BRASS = (0.7, 0.71, 0.73), (0.72, 0.58, 0.28)
_CORE = {2: 1.7, 3: 2.5, 4: 3.3}
"""What is drawn of a thread: its core, which fits into the hole that is cut for it."""
_FLATS = {2: 4.0, 3: 5.5, 4: 7.0}
_HEAD_WIDE = {2: 3.8, 3: 5.5, 4: 7.0}


def screw_places(
    joint: Joint,
    heads: Iterable[Sequence[float] | FloatArray],
    along: Sequence[float] | FloatArray,
    *,
    group: str,
    setup: str = ALWAYS,
) -> Iterator[Place]:
    """Yield a joint's screws and nuts. heads: where each head's underside is, mm; along: from there to the end."""
    columns = columns_along(along)
    for head in heads:
        at = np.asarray(head, dtype=np.float64)
        yield Place(_screw(joint.size_mm, joint.length_mm), at, columns, setup=setup, group=group)
        if joint.nut:
            end = at + joint.grip_mm * columns[:, 2]
            yield Place(_nut(joint.size_mm, joint.nut), end, columns, setup=setup, group=group)


def columns_along(along: Sequence[float] | FloatArray) -> FloatArray:
    """Return axes (3, 3) whose third points along a direction (3,)."""
    z = np.asarray(along, dtype=np.float64) / np.linalg.norm(along)
    aside = np.eye(3)[int(np.abs(z).argmin())]
    x = aside - (aside @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@cache
def _screw(size: int, length: int) -> Part:
    wide, core = _HEAD_WIDE[size], _CORE[size]
    body = joined(rod((0.0, 0.0, 0.0), "z", -float(size), wide), rod((0.0, 0.0, 0.0), "z", float(length), core))
    solid = cut(body, [rod((0.0, 0.0, -size - 1.0), "z", 1.0 + 0.5 * size, 0.5 * wide)])
    return Part(f"screw_m{size}x{length}", f"Screw M{size} x {length}", BOUGHT, solid, STEEL)


@cache
def _nut(size: int, kind: str) -> Part:
    height = NUT_MM[kind] * size
    angle = np.deg2rad(60.0 * np.arange(6))
    outline = _FLATS[size] / np.sqrt(3.0) * np.column_stack([np.cos(angle), np.sin(angle)])
    solid = cut(prism(outline, height), [rod((0.0, 0.0, -1.0), "z", height + 2.0, size + 0.1)])
    return Part(f"{kind.replace(' ', '_')}_m{size}", f"{kind.capitalize()} M{size}", BOUGHT, solid, STEEL)


def pressed_spring(key: str, title: str, length: float, outer: float, wire: float) -> Part:
    """Return a pressure spring along z from 0, as the rings that its coils are seen as."""
    return Part(key, title, BOUGHT, _coils(0.0, length, outer, wire), BRASS)


def pulled_spring(key: str, title: str, length: float, outer: float, wire: float, *, hook_mm: float) -> Part:
    """Return a tension spring along z between the middles of two holes that run along x, `length` apart.

    hook_mm: how far its wire's ends reach into the holes, both ways along x.
    """
    coils = _coils(6.0, length - 6.0, outer, wire)
    wires = [rod((0.0, 0.0, at), "z", sign * 6.0, wire) for at, sign in ((0.0, 1.0), (length, -1.0))]
    wires += [rod((0.0, 0.0, at), "z", sign * wire, outer - wire) for at, sign in ((6.0, 1.0), (length - 6.0, -1.0))]
    hooks = [rod((-hook_mm, 0.0, at), "x", 2.0 * hook_mm, wire) for at in (0.0, length)]
    return Part(key, title, BOUGHT, joined(coils, *wires, *hooks), BRASS)


def _coils(low: float, high: float, outer: float, wire: float) -> Solid:
    """Return a tube whose outside is as wavy as coils are, about ten of them."""
    count = 10
    step, middle = (high - low) / count, 0.5 * outer - wire
    points = [(middle, low)]
    for index in range(count):
        points += [(0.5 * outer - 0.6 * wire, low + index * step), (0.5 * outer, low + (index + 0.5) * step)]
    points += [(0.5 * outer - 0.6 * wire, high), (middle, high)]
    face = b.make_face(b.Polyline(*[(radius, 0.0, z) for radius, z in points], close=True))
    return b.revolve(face, axis=b.Axis.Z)
