"""How far points are from a surface. Needs the extra `heart` (VTK)."""

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray
from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

from cathxr.core import FloatArray
from cathxr.heart.surface import Surface
from cathxr.heart.surfaces.poly import poly_data

_SAMPLES = 20_000


def distances_mm(points_mm: FloatArray, surface: Surface) -> FloatArray:
    """Return how far each point (N, 3) is from the surface: (N,) mm, not below zero."""
    distance = vtkImplicitPolyDataDistance()
    distance.SetInput(poly_data(surface))
    found = vtkDoubleArray()
    distance.FunctionValue(numpy_to_vtk(np.ascontiguousarray(points_mm, dtype=np.float64)), found)
    return np.asarray(np.abs(vtk_to_numpy(found)))


def sampled(surface: Surface, count: int = _SAMPLES) -> FloatArray:
    """Return `count` points (count, 3) mm spread evenly by area over the surface; the same surface gives the same."""
    area = np.cumsum(np.linalg.norm(surface.area_vectors, axis=1))
    steps = (np.arange(count) + 0.5) / count
    triangle = np.minimum(np.searchsorted(area, steps * area[-1]), len(area) - 1)
    # The additive recurrence of the golden ratio's relatives covers each triangle evenly without a random generator.
    u, v = np.mod(np.arange(count) * 0.7548776662466927, 1.0), np.mod(np.arange(count) * 0.5698402909980532, 1.0)
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    a, b, c = np.moveaxis(surface.vertices_mm[surface.triangles[triangle]], 1, 0)
    return np.asarray(a + u[:, None] * (b - a) + v[:, None] * (c - a))
