"""The inner surface of a short vessel whose wall is a thick, jagged shell: what a ray from its axis meets first."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cathxr.core import DataError, FloatArray
from cathxr.heart.surface import IndexArray, Surface

_STEP_MM = 0.5
_SLICE_MM = 3.0
_ANGLES = 72
_HARMONICS = 6
_JAG_ANGLES = 3
_SMALL = 1e-9


@dataclass(frozen=True, eq=False)
class _Axis:
    """A straight line: origin (3,), unit direction (3,), and the two unit vectors (2, 3) across it."""

    origin_mm: FloatArray
    direction: FloatArray
    sides: FloatArray


def lumen(
    wall: Surface,
    start_mm: FloatArray,
    direction: FloatArray,
    *,
    straight_mm: float,
    rings: int,
    before_mm: float = 0.0,
) -> Surface:
    """Return a smooth tube (rings x 72 vertices) along the inner side of a vessel's closed wall, facing outwards.

    start_mm (3,): centre of the vessel's first end; direction (3,): unit, along the vessel. straight_mm: how far from
    the start the wall is whole all round, over which the axis is fitted. Both ends follow the wall's own ends.
    before_mm: how far the tube goes on before the first one, to meet what the vessel comes out of.

    Raises:
        DataError: the wall does not surround the axis.
    """
    axis = _fitted_axis(wall, start_mm, direction, straight_mm)
    angles = np.arange(_ANGLES) * (2.0 * np.pi / _ANGLES)
    along = (wall.vertices_mm - axis.origin_mm) @ axis.direction
    steps = np.arange(along.min(), along.max(), _STEP_MM)
    radii = np.stack([_first_hits(wall, axis, float(angle), steps) for angle in angles])
    if np.isinf(radii).all(axis=1).any():
        raise DataError("The vessel's wall does not surround its axis; check the wall's surface and its opening.")
    first, last = _ends(radii, steps)
    first, last = _low_pass(first) - before_mm, _low_pass(last)
    at = np.linspace(0.0, 1.0, rings)[:, None] * (last - first) + first
    radius = np.stack([_sampled(at[:, index], steps, radii[index]) for index in range(_ANGLES)], axis=1)
    radius = np.stack([_low_pass(ring) for ring in radius])
    radius = _smoothed_along(radius)
    outward = np.cos(angles)[:, None] * axis.sides[0] + np.sin(angles)[:, None] * axis.sides[1]
    vertices = axis.origin_mm + at[..., None] * axis.direction + radius[..., None] * outward
    return Surface(vertices.reshape(-1, 3), _tube_triangles(rings))


def _fitted_axis(wall: Surface, start_mm: FloatArray, direction: FloatArray, straight_mm: float) -> _Axis:
    """Return the line through the centres of the wall's slices over its first `straight_mm`."""
    along = (wall.vertices_mm - start_mm) @ direction
    edges = np.arange(max(along.min(), 0.0), straight_mm, _SLICE_MM)
    slices = [wall.vertices_mm[(along >= edge) & (along < edge + _SLICE_MM)] for edge in edges]
    centres = np.stack([points.mean(axis=0) for points in slices if len(points)])
    middle = centres.mean(axis=0)
    unit = np.linalg.svd(centres - middle)[2][0] if len(centres) > 2 else direction
    unit = unit * np.sign(unit @ direction)
    helper = np.eye(3)[int(np.abs(unit).argmin())]
    side = np.cross(unit, helper)
    side /= np.linalg.norm(side)
    return _Axis(middle, unit, np.stack([side, np.cross(unit, side)]))


def _first_hits(wall: Surface, axis: _Axis, angle: float, steps: FloatArray) -> FloatArray:
    """Return how far from the axis (S,) a ray at `angle` first meets the wall at each step; infinity where it does not.

    The rays of one angle lie in one half plane: the triangles that cross it become segments, cut by each ray's line.
    """
    outward = np.cos(angle) * axis.sides[0] + np.sin(angle) * axis.sides[1]
    frame = np.stack([axis.direction, outward, np.cross(axis.direction, outward)])
    corners = ((wall.vertices_mm - axis.origin_mm) @ frame.T)[wall.triangles]
    crossing = (corners[..., 2].min(axis=1) <= 0) & (corners[..., 2].max(axis=1) > 0)
    segments = _cut(corners[crossing])
    low, high = np.sort(segments[..., 0], axis=1).T
    slope = np.diff(segments[..., 1], axis=1)[:, 0] / (np.diff(segments[..., 0], axis=1)[:, 0] + _SMALL)
    radius = segments[:, 0, 1] + (steps[:, None] - segments[:, 0, 0]) * slope
    met = (steps[:, None] >= low) & (steps[:, None] <= high) & (radius > 1.0)
    return np.asarray(np.where(met, radius, np.inf).min(axis=1, initial=np.inf))


def _cut(corners: FloatArray) -> FloatArray:
    """Return the segments (T, 2, 2), along and outward, in which triangles (T, 3, 3) cross the plane where z is 0."""
    height = corners[..., 2]
    below = height <= 0
    alone = np.where(below.sum(axis=1) == 1, below.argmax(axis=1), (~below).argmax(axis=1))
    rows = np.arange(len(corners))
    apex = corners[rows, alone]
    ends = []
    for turn in (1, 2):
        other = corners[rows, (alone + turn) % 3]
        share = apex[:, 2] / (apex[:, 2] - other[:, 2])
        ends.append(apex[:, :2] + share[:, None] * (other[:, :2] - apex[:, :2]))
    return np.stack(ends, axis=1)


def _ends(radii: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return for each angle (A,) where along the axis the wall begins and ends, jags counted as wall."""
    hit = np.isfinite(radii)
    first = steps[hit.argmax(axis=1)]
    last = steps[len(steps) - 1 - hit[:, ::-1].argmax(axis=1)]
    window = np.stack([np.roll(np.arange(len(radii)), shift) for shift in range(-_JAG_ANGLES, _JAG_ANGLES + 1)])
    return first[window].min(axis=0), last[window].max(axis=0)


def _sampled(at: FloatArray, steps: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the radius at each place, after a running median over five steps that ignores gaps and spikes."""
    hit = np.isfinite(radius)
    places, values = steps[hit], radius[hit]
    padded = np.pad(values, 2, mode="edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    return np.asarray(np.interp(at, places, median))


def _low_pass(values: FloatArray) -> FloatArray:
    """Return a periodic signal's first few harmonics."""
    spectrum = np.fft.rfft(values)
    spectrum[_HARMONICS + 1 :] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(values)))


def _smoothed_along(radius: FloatArray) -> FloatArray:
    """Return radii (rings, angles) smoothed along the tube by 1-2-1, twice."""
    for _ in range(2):
        padded = np.concatenate([radius[:1], radius, radius[-1:]])
        radius = (padded[:-2] + 2.0 * padded[1:-1] + padded[2:]) / 4.0
    return radius


def _tube_triangles(rings: int) -> IndexArray:
    """Return the triangles of a tube of `rings` rings of 72 vertices, counter-clockwise from outside."""
    ring, turn = np.meshgrid(np.arange(rings - 1), np.arange(_ANGLES), indexing="ij")
    here, there = ring * _ANGLES + turn, ring * _ANGLES + (turn + 1) % _ANGLES
    quads: list[NDArray[np.int64]] = [
        np.stack([here, there, there + _ANGLES], axis=-1).reshape(-1, 3),
        np.stack([here, there + _ANGLES, here + _ANGLES], axis=-1).reshape(-1, 3),
    ]
    return np.concatenate(quads).astype(np.int64)
