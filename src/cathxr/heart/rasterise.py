"""Closed surfaces to voxels."""

from typing import Any

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.heart.surface import Surface
from cathxr.heart.volume import Grid


def inside(surface: Surface, grid: Grid) -> npt.NDArray[np.bool_]:
    """Return which voxels' centres (K, J, I) lie within the closed surface.

    The surface may leave the grid; the part outside is cut off. VTK's stencil fills it (the extra `heart` is needed).
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkImagingStencil import vtkImageStencilToImage, vtkPolyDataToImageStencil

    # In voxel coordinates the grid is VTK's plain one, whatever its axes are in `ct`.
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(grid.to_voxel(surface.vertices_mm)), deep=True))
    threes = np.column_stack([np.full(len(surface.triangles), 3), surface.triangles]).astype(np.int64)
    cells: Any = vtkCellArray()
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(threes.ravel(), deep=True))
    poly = vtkPolyData()
    poly.SetPoints(points)
    poly.SetPolys(cells)
    depth, rows, columns = grid.shape
    stencil: Any = vtkPolyDataToImageStencil()
    stencil.SetInputData(poly)
    stencil.SetOutputSpacing(1.0, 1.0, 1.0)
    stencil.SetOutputOrigin(0.0, 0.0, 0.0)
    stencil.SetOutputWholeExtent(0, columns - 1, 0, rows - 1, 0, depth - 1)
    image: Any = vtkImageStencilToImage()
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutsideValue(0)
    image.SetOutputScalarTypeToUnsignedChar()
    image.Update()
    return np.asarray(vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).reshape(grid.shape) != 0)


def upright_grid(low_mm: FloatArray, high_mm: FloatArray, spacing_mm: float) -> Grid:
    """Return the grid whose axes are those of `ct` and whose voxels' centres run from `low_mm` to `high_mm` (3,)."""
    counts = np.ceil((high_mm - low_mm) / spacing_mm).astype(int) + 1
    matrix = np.diag([spacing_mm, spacing_mm, spacing_mm, 1.0])
    matrix[:3, 3] = low_mm
    return Grid((int(counts[2]), int(counts[1]), int(counts[0])), matrix)
