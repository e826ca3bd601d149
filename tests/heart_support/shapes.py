"""Signed distances (mm, negative within) of the bodies that phantoms are built of; points are float32 (N, 3)."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float32]
Distances = npt.NDArray[np.float32]
Shape = Callable[[Points], Distances]


def ellipsoid(centre: Sequence[float], semi_axes: Sequence[float], axis: Sequence[float] = (0.0, 0.0, 1.0)) -> Shape:
    """Return an ellipsoid whose third semi-axis lies along `axis`; exact on its surface, to first order near it."""
    third = np.asarray(axis, float) / np.linalg.norm(axis)
    first = np.cross(third, [0.0, 1.0, 0.0] if abs(third[1]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(third, first), third]).astype(np.float32)
    middle, semi = np.asarray(centre, np.float32), np.asarray(semi_axes, np.float32)

    def distance(points: Points) -> Distances:
        scaled = ((points - middle) @ frame.T) / semi
        radius = np.sqrt((scaled**2).sum(axis=1))
        slope = np.sqrt(((scaled / semi) ** 2).sum(axis=1))
        return np.asarray(radius * (radius - 1.0) / np.maximum(slope, 1e-6), np.float32)

    return distance


def tube(path: Sequence[Sequence[float]], radius: float) -> Shape:
    """Return a round tube along the straight pieces of `path`, with round ends."""
    corners = np.asarray(path, np.float32)

    def distance(points: Points) -> Distances:
        nearest = np.full(len(points), np.inf, np.float32)
        for start, end in pairwise(corners):
            along = end - start
            share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
            offset = points - start - share[:, None] * along
            np.minimum(nearest, np.einsum("ij,ij->i", offset, offset), out=nearest)
        return np.asarray(np.sqrt(nearest) - np.float32(radius), np.float32)

    return distance


def box(centre: Sequence[float], half_sizes: Sequence[float]) -> Shape:
    """Return an upright box."""
    middle, half = np.asarray(centre, np.float32), np.asarray(half_sizes, np.float32)

    def distance(points: Points) -> Distances:
        return np.asarray((np.abs(points - middle) - half).max(axis=1), np.float32)

    return distance


def any_of(*shapes: Shape) -> Shape:
    """Return what lies in at least one of the shapes."""
    return lambda points: np.asarray(np.minimum.reduce([shape(points) for shape in shapes]), np.float32)


def ring(centre: Sequence[float], half_sizes: Sequence[float], radius: float, tilt: float) -> Shape:
    """Return a bar bent along an ellipse (half_sizes: x, y) that sinks by `tilt` mm per mm forward: a rib."""
    middle, half = np.asarray(centre, np.float32), np.asarray(half_sizes, np.float32)

    def distance(points: Points) -> Distances:
        offset = points - middle
        scaled = offset[:, :2] / half
        across = (np.sqrt((scaled**2).sum(axis=1)) - 1.0) * half.min()
        along = offset[:, 2] - np.float32(tilt) * offset[:, 1]
        return np.asarray(np.sqrt(across**2 + along**2) - np.float32(radius), np.float32)

    return distance
