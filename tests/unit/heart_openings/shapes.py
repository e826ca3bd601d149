"""Analytic label volumes: balls, tubes and plates, as voxels whose centres lie inside them."""

import numpy as np

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.volume import Grid, LabelVolume


def oblique_grid(shape: tuple[int, int, int], spacing: float = 0.8) -> Grid:
    """A grid whose axes are turned against those of `ct`, by angles that share no simple ratio."""
    a, b = 0.31, -0.23
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_z @ about_x * spacing
    matrix[:3, 3] = [-40.0, 12.0, -33.0]
    return Grid(shape, matrix)


def points(grid: Grid) -> np.ndarray:
    """Every voxel's centre (K, J, I, 3), mm in `ct`."""
    k, j, i = np.indices(grid.shape)
    return grid.to_ct(np.stack([i, j, k], axis=-1).astype(float))


def middle(grid: Grid) -> np.ndarray:
    return grid.to_ct((np.array(grid.shape[::-1]) - 1) / 2.0)


def ball(grid: Grid, centre: np.ndarray, radius: float) -> np.ndarray:
    return ((points(grid) - centre) ** 2).sum(axis=-1) <= radius**2


def tube(grid: Grid, start: np.ndarray, direction: np.ndarray, length: float, radius: float) -> np.ndarray:
    """A round tube with flat ends."""
    offset = points(grid) - start
    unit = direction / np.linalg.norm(direction)
    along = offset @ unit
    across = np.sqrt(np.maximum((offset**2).sum(axis=-1) - along**2, 0.0))
    return (along >= 0.0) & (along <= length) & (across <= radius)


def labelled(grid: Grid, **masks: np.ndarray) -> LabelVolume:
    """Labels of masks by the structure's key; a later mask does not overwrite an earlier one."""
    labels = np.zeros(grid.shape, dtype=np.uint8)
    for key, mask in masks.items():
        labels[mask & (labels == 0)] = CATALOGUE[key].label
    return LabelVolume(labels, grid, {CATALOGUE[key].label: key for key in masks})


def angle_deg(one: np.ndarray, other: np.ndarray) -> float:
    cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
