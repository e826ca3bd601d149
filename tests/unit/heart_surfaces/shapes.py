"""Label volumes of shapes whose volumes and surfaces are known."""

import numpy as np

from cathxr.heart.volume import Grid, LabelVolume


def grid_of(shape: tuple[int, int, int], spacing_mm: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Grid:
    """An oblique grid, so that nothing can take voxel axes for those of `ct`."""
    angle = np.radians(20.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * spacing_mm
    matrix[:3, 3] = (-40.0, 25.0, 110.0)
    return Grid(shape, matrix)


def points_of(grid: Grid) -> np.ndarray:
    """Every voxel's centre (K, J, I, 3) in mm along the grid's own axes, from the middle of the grid."""
    k, j, i = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in grid.shape), indexing="ij")
    return np.stack([i, j, k], axis=-1) * grid.spacing_mm


def two_halves(radius_mm: float = 18.0, size: int = 48) -> LabelVolume:
    """A ball cut by a plane into a ventricle (below) and an atrium (above), which touch in that plane."""
    grid = grid_of((size, size, size))
    at = points_of(grid)
    ball = np.linalg.norm(at, axis=-1) <= radius_mm
    labels = np.zeros(grid.shape, np.uint8)
    labels[ball & (at[..., 2] <= 0.0)] = 1
    labels[ball & (at[..., 2] > 0.0)] = 2
    return LabelVolume(labels, grid, {1: "left_ventricle", 2: "left_atrium"})


def tube(radius_mm: float = 8.0, spacing_mm: tuple[float, float, float] = (1.0, 1.0, 1.5)) -> LabelVolume:
    """A vessel along k that both ends of the volume cut."""
    grid = grid_of((30, 40, 40), spacing_mm)
    at = points_of(grid)
    inside = np.linalg.norm(at[..., :2], axis=-1) <= radius_mm
    return LabelVolume(inside.astype(np.uint8) * 5, grid, {5: "aorta"})
