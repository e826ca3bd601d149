"""Closed surfaces (STL), one for each structure by its file's name, as voxels."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh

from cathxr.core import DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.rasterise import inside, upright_grid
from cathxr.heart.reading.painting import Canvas
from cathxr.heart.reading.structure_names import key_of, vessel_of_wall
from cathxr.heart.reading.vessel_walls import enclosed_by_wall
from cathxr.heart.surface import Surface
from cathxr.heart.volume import Grid, LabelVolume, Progress

_FINE_MM, _COARSE_MM = 0.6, 0.8
_MAX_VOXELS = 100_000_000
_MARGIN_MM = 5.0
_SMALLEST_MM = 5.0
_LARGEST_MM = 1500.0


def named_parts(paths: Sequence[Path]) -> list[tuple[str, bool, Path]]:
    """Return the surfaces whose names are structures': key, whether it is a vessel's wall, file."""
    found = []
    for each in paths:
        if vessel := vessel_of_wall(each.name):
            found.append((vessel, True, each))
        elif key := key_of(each.name):
            found.append((key, False, each))
    solid = {key for key, is_wall, _ in found if not is_wall}
    return [each for each in found if not (each[1] and each[0] in solid)]


def read_parts(
    parts: Sequence[tuple[str, bool, Path]], path: Path, *, like: Grid | None, progress: Progress
) -> LabelVolume:
    """Return the parts as labels, on the grid of `like`, or an upright one of 0.6 mm (0.8 mm for large ones).

    The surfaces are mm in `ct` (LPS). Of a vessel's wall it is the inside that counts.

    Raises:
        DataError: a surface cannot be read, is open, or is in another unit.
    """
    surfaces = [(key, is_wall, _surface(file, key, path)) for key, is_wall, file in parts]
    grid = like or _grid([surface for _, _, surface in surfaces])
    canvas = Canvas(grid)
    for number, (key, is_wall, surface) in enumerate(surfaces):
        progress(f"Filling the {CATALOGUE[key].name.lower()}", number / len(surfaces))
        mask = inside(surface, grid)
        canvas.paint(key, enclosed_by_wall(mask, grid) if is_wall else mask)
    labels = canvas.finished()
    if not labels.labels.any():
        raise DataError(f"{path}: the surfaces lie outside the scan; check that they are in its own millimetres.")
    return labels


def _surface(file: Path, key: str, path: Path) -> Surface:
    try:
        mesh = trimesh.load_mesh(file, process=True)
        vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    except (ValueError, OSError, LookupError, AttributeError, TypeError, EOFError):
        raise DataError(f"{path}: the surface of {key} cannot be read; export it again as STL.") from None
    if len(triangles) < 4 or not np.isfinite(vertices).all():
        raise DataError(f"{path}: the surface of {key} holds no usable triangles; export it again as STL.")
    size = float(np.ptp(vertices, axis=0).max())
    if not _SMALLEST_MM < size < _LARGEST_MM:
        raise DataError(f"{path}: the surface of {key} is {size:.3g} mm large; export it in millimetres.")
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    if (counts % 2).any():
        raise DataError(f"{path}: the surface of {key} is open at {int((counts % 2).sum())} edges; close its holes.")
    return Surface(vertices, triangles)


def _grid(surfaces: Sequence[Surface]) -> Grid:
    low = np.min([each.vertices_mm.min(axis=0) for each in surfaces], axis=0) - _MARGIN_MM
    high = np.max([each.vertices_mm.max(axis=0) for each in surfaces], axis=0) + _MARGIN_MM
    fine = float(np.prod((high - low) / _FINE_MM)) <= _MAX_VOXELS
    return upright_grid(low, high, _FINE_MM if fine else _COARSE_MM)
