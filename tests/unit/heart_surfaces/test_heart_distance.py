"""Distances from a surface, against the plain reference: every triangle, sampled as finely as the tolerance asks."""

import numpy as np
import pytest

from cathxr.heart.surface import Surface
from cathxr.heart.surfaces.distance import distances_mm, sampled


def soup(rng: np.random.Generator, count: int = 60) -> Surface:
    corners = rng.uniform(-20.0, 20.0, (count, 1, 3)) + rng.normal(0.0, 3.0, (count, 3, 3))
    return Surface(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def by_every_triangle(points: np.ndarray, surface: Surface) -> np.ndarray:
    """Return the distance to the nearest of many points that lie on the triangles' edges and inside."""
    steps = np.linspace(0.0, 1.0, 41)
    u, v = (each.ravel() for each in np.meshgrid(steps, steps))
    u, v = u[u + v <= 1.0 + 1e-9], v[u + v <= 1.0 + 1e-9]
    a, b, c = np.moveaxis(surface.vertices_mm[surface.triangles], 1, 0)
    on = a[:, None] + u[:, None] * (b - a)[:, None] + v[:, None] * (c - a)[:, None]
    return np.array([np.linalg.norm(on - each, axis=-1).min() for each in points])


@pytest.mark.parametrize("spread", [1.0, 15.0, 60.0])
def test_distances_are_those_of_the_nearest_triangle(spread):
    rng = np.random.default_rng(5)
    surface = soup(rng)
    points = rng.normal(0.0, spread, (80, 3))
    reference = by_every_triangle(points, surface)
    # The reference's points are up to 12 mm / 40 apart, so that it is too large by the half of that at most.
    found = distances_mm(points, surface)
    assert (found <= reference + 1e-9).all()
    assert (found >= reference - 0.2).all()
    near = distances_mm(points, surface, within_mm=2.0)
    assert np.array_equal(np.isfinite(near), found < 2.0)
    assert np.array_equal(near[found < 2.0], found[found < 2.0])


def test_points_on_the_surface_have_no_distance():
    surface = soup(np.random.default_rng(6))
    assert distances_mm(sampled(surface, 500), surface).max() < 1e-9


def test_a_flat_surface_has_distances_too():
    square = Surface(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    assert distances_mm(np.array([[5.0, 5.0, 3.0], [13.0, 14.0, 0.0]]), square) == pytest.approx([3.0, 5.0])
