"""The zero surface of a level set, closed, in `ct`. Needs the extra `heart` (VTK)."""

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

from cathxr.heart.surface import Surface
from cathxr.heart.surfaces.fields import Field, LevelSet
from cathxr.heart.volume import Grid

_NEVER_ZERO = 1e-4
"""Values nearer to zero are moved away from it: a vertex on a grid point would make triangles of no area."""


def contoured(level_set: LevelSet, grid: Grid) -> Surface:
    """Return the closed surface at zero, outward, mm in `ct`; a structure that the volume's end cuts ends flat there.

    Source: Schroeder, Maynard and Geveci, "Flying edges: a high-performance scalable isocontouring algorithm",
    LDAV 2015.
    """
    field = _closed(level_set)
    image = vtkImageData()
    k, j, i = field.shape
    image.SetDimensions(i, j, k)
    scalars = numpy_to_vtk(field.reshape(-1), deep=False)
    image.GetPointData().SetScalars(scalars)
    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 0.0)
    edges.ComputeNormalsOff()
    edges.ComputeGradientsOff()
    edges.ComputeScalarsOff()
    edges.Update()
    found = edges.GetOutput()
    if not found.GetNumberOfPolys():
        return Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    points = vtk_to_numpy(found.GetPoints().GetData()).astype(np.float64)
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
    voxel = points - 1.0 + np.array(level_set.box.first[::-1])
    return Surface(grid.to_ct(voxel), triangles)


def _closed(level_set: LevelSet) -> Field:
    """Return the field with one more voxel on each side, so that what reaches the volume's end is closed there."""
    field = np.where(np.abs(level_set.inside) < _NEVER_ZERO, np.float32(-_NEVER_ZERO), level_set.inside)
    padded = np.pad(field, 1, mode="edge")
    for axis in range(3):
        for side in (0, -1):
            index: list[slice | int] = [slice(None)] * 3
            index[axis] = side
            # As far below zero as the last voxel is above it: the surface then lies on the last voxel's outer face.
            padded[tuple(index)] = -np.abs(padded[tuple(index)])
    return np.ascontiguousarray(padded, dtype=np.float32)
