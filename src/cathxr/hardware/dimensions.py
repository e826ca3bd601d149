"""Dimension lines and texts of the drawings, as SVG elements. Places (2,) are mm, y upwards."""

from collections.abc import Iterator

import numpy as np

from cathxr.core import FloatArray

_THIN = 'stroke="#1b5e9e" stroke-width="0.2"'


def text_at(
    place: FloatArray, text: str, size: float, *, anchor: str = "middle", turned: bool = False, bold: bool = False
) -> Iterator[str]:
    """Yield a text. anchor: "start", "middle" or "end"; turned: it reads upwards."""
    x, y = place[0], -place[1]
    turn = f' transform="rotate(-90 {x:.2f} {y:.2f})"' if turned else ""
    weight = ' font-weight="bold"' if bold else ""
    yield (
        f'<text x="{x:.2f}" y="{y:.2f}" fill="#000000" font-size="{size:.2f}" text-anchor="{anchor}"{weight}{turn}>'
        f"{text}</text>\n"
    )


def dimension_across(corner: FloatArray, length: float, letter: float) -> Iterator[str]:
    """Yield the dimension of a width, under what begins at its lower left `corner`."""
    low = corner - np.array([0.0, 1.1 * letter])
    yield from _measured(low, low + np.array([length, 0.0]), letter)
    for x in (0.0, length):
        yield _stroke(corner + np.array([x, -0.25 * letter]), corner + np.array([x, -1.5 * letter]))
    yield from text_at(low + np.array([0.5 * length, -1.1 * letter]), f"{length:.1f}", letter)


def dimension_up(corner: FloatArray, length: float, letter: float) -> Iterator[str]:
    """Yield the dimension of a height, left of what begins at its lower left `corner`."""
    low = corner - np.array([1.1 * letter, 0.0])
    yield from _measured(low, low + np.array([0.0, length]), letter)
    for y in (0.0, length):
        yield _stroke(corner + np.array([-0.25 * letter, y]), corner + np.array([-1.5 * letter, y]))
    yield from text_at(low + np.array([-0.4 * letter, 0.5 * length]), f"{length:.1f}", letter, turned=True)


def _measured(first: FloatArray, last: FloatArray, letter: float) -> Iterator[str]:
    """Yield a line with an arrow at each end; where it is too short for them, from outside."""
    along = (last - first) / np.linalg.norm(last - first)
    aside = np.array([-along[1], along[0]])
    inside = float(np.linalg.norm(last - first)) > 2.0 * letter
    yield _stroke(first, last)
    for end, sign in ((first, 1.0), (last, -1.0)):
        inwards = sign * (1.0 if inside else -1.0) * along
        back = end + 0.7 * letter * inwards
        wings = [back + 0.17 * letter * aside, back - 0.17 * letter * aside]
        points = " ".join(f"{x:.2f},{-y:.2f}" for x, y in (end, *wings))
        yield f'<polygon points="{points}" fill="#1b5e9e" stroke="none"/>\n'
        if not inside:
            yield _stroke(end, end + 1.6 * letter * inwards)


def _stroke(first: FloatArray, last: FloatArray) -> str:
    return f'<path d="M {first[0]:.2f},{-first[1]:.2f} L {last[0]:.2f},{-last[1]:.2f}" {_THIN}/>\n'
