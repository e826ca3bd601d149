"""The acoustic volume of a real heart, from the closed surfaces of its chambers and walls."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.surface import Surface, read_stl
from cathxr.ultrasound import AcousticField

CHAMBERS = ("lv_cavity", "rv_cavity", "la_cavity", "ra_cavity")
_WALLS = ("lv_myocardium", "septum", "rv_myocardium", "la_wall", "ra_wall", "aorta_wall", "pulmonary_artery_wall")
_MARGIN_MM = 14.0
_FAT_MM = 4.0

# Impedance MRayl, scatter (myocardium is 1), attenuation dB/cm/MHz.
_TISSUES: Mapping[str, tuple[float, float, float]] = {
    "lung": (0.38, 0.5, 20.0),
    "fat": (1.31, 1.4, 0.5),
    "wall": (1.69, 1.0, 0.6),
    "blood": (1.657, 0.055, 0.2),
}


def heart_field(folder: Path, spacing_mm: float = 1.2) -> tuple[AcousticField, dict[str, FloatArray]]:
    """Return the volume of the STL surfaces in `folder`, and each chamber's centroid (3,) mm in `ct`.

    Walls of 2 mm at least, 4 mm of fat, then lung; where chambers touch (valves) they are open. VTK is needed.
    """
    surfaces = {name: read_stl(folder / f"{name}.stl") for name in (*CHAMBERS, *_WALLS)}
    corners = np.concatenate([each.vertices_mm for each in surfaces.values()])
    low = corners.min(axis=0) - _MARGIN_MM
    counts = np.ceil((corners.max(axis=0) + _MARGIN_MM - low) / spacing_mm).astype(int) + 1
    matrix = np.diag([spacing_mm, spacing_mm, spacing_mm, 1.0])
    matrix[:3, 3] = low
    shape = (int(counts[2]), int(counts[1]), int(counts[0]))
    masks = {name: inside(each, shape, matrix) for name, each in surfaces.items()}
    blood = np.logical_or.reduce([masks[name] for name in CHAMBERS])
    near = ndimage.distance_transform_edt(~blood, sampling=spacing_mm) < 2.0
    heart = np.logical_or.reduce(list(masks.values())) | near
    fat = ndimage.distance_transform_edt(~heart, sampling=spacing_mm) < _FAT_MM
    tissue = np.where(blood, 3, np.where(heart, 2, np.where(fat, 1, 0)))
    values = np.array(list(_TISSUES.values()))
    values[:, 0] = np.log(values[:, 0] / 1.6569)
    fields = [ndimage.gaussian_filter(values[tissue, at], 0.7) for at in range(3)]
    centroids = {name: np.argwhere(masks[name]).mean(axis=0)[::-1] * spacing_mm + low for name in CHAMBERS}
    return AcousticField.from_properties(*fields, ct_from_voxel=matrix), centroids


def inside(surface: Surface, shape: tuple[int, int, int], ct_from_voxel: FloatArray) -> npt.NDArray[np.bool_]:
    """Return which voxels' centres (K, J, I) lie within a closed surface."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkImagingStencil import vtkImageStencilToImage, vtkPolyDataToImageStencil

    voxels = (surface.vertices_mm - ct_from_voxel[:3, 3]) / np.diag(ct_from_voxel)[:3]
    points, cells, poly = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(voxels), deep=True))
    threes = np.column_stack([np.full(len(surface.triangles), 3), surface.triangles]).astype(np.int64)
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(threes.ravel(), deep=True))
    poly.SetPoints(points)
    poly.SetPolys(cells)
    stencil, image = vtkPolyDataToImageStencil(), vtkImageStencilToImage()
    stencil.SetInputData(poly)
    stencil.SetOutputSpacing(1.0, 1.0, 1.0)
    stencil.SetOutputOrigin(0.0, 0.0, 0.0)
    stencil.SetOutputWholeExtent(0, shape[2] - 1, 0, shape[1] - 1, 0, shape[0] - 1)
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutsideValue(0)
    image.SetOutputScalarTypeToUnsignedChar()
    image.Update()
    flat = vtk_to_numpy(image.GetOutput().GetPointData().GetScalars())
    return np.asarray(flat.reshape(shape) != 0)


def looking(
    at_mm: FloatArray, towards_mm: FloatArray, axis: FloatArray | tuple[float, ...] = (0.0, 0.0, 1.0)
) -> FloatArray:
    """Return the pose of a transducer whose catheter runs along `axis` and whose beam looks towards a point."""
    z = np.asarray(axis, float) / np.linalg.norm(axis)
    x = towards_mm - at_mm
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    pose[:3, 3] = at_mm
    return pose
