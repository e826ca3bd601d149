"""The four-chamber heart of the real surfaces as labelled voxels, its vessels carried on: what the atlas is made of."""

import json
import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import DataError, FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.rasterise import inside, upright_grid
from cathxr.heart.surface import Surface, open_at, read_stl
from cathxr.heart.volume import Grid, LabelVolume

_CAVITIES = {
    "left_ventricle": "lv_cavity",
    "right_ventricle": "rv_cavity",
    "left_atrium": "la_cavity",
    "right_atrium": "ra_cavity",
}
_WALLS = ("lv_myocardium", "septum", "rv_myocardium", "la_wall", "ra_wall", "aorta_wall", "pulmonary_artery_wall")
_STUBS = {"aorta": "aorta_wall", "pulmonary_artery": "pulmonary_artery_wall"}
# Opening: structure that goes on from it, chamber that it belongs to, bearing (x, y, z) mixed into its normal, length.
_CARRIED_ON: Mapping[str, tuple[str, str, tuple[float, float, float], float]] = {
    "superior-vena-cava": ("superior_vena_cava", "right_atrium", (0.0, 0.1, 2.0), 55.0),
    "inferior-vena-cava": ("inferior_vena_cava", "right_atrium", (0.0, 0.3, -2.0), 45.0),
    "right-superior-pulmonary-vein": ("pulmonary_veins", "left_atrium", (0.0, 0.0, 0.0), 30.0),
    "right-inferior-pulmonary-vein": ("pulmonary_veins", "left_atrium", (0.0, 0.0, 0.0), 30.0),
    "left-superior-pulmonary-vein": ("pulmonary_veins", "left_atrium", (0.0, 0.0, 0.0), 30.0),
    "left-inferior-pulmonary-vein": ("pulmonary_veins", "left_atrium", (0.0, 0.0, 0.0), 30.0),
    "left-atrium-appendage": ("left_atrial_appendage", "left_atrium", (0.5, -1.0, 0.0), 25.0),
}
_TRUNK_MM = {"aorta": 30.0, "pulmonary_artery": 14.0}
_BRANCH_MM, _BRANCH_RADIUS_MM = 45.0, 8.5
_MARGIN_MM = 42.0
_VESSEL_WALL_MM = 1.5
_GAP_MM = 2.5


def labelled_heart(folder: Path, spacing_mm: float, *, wall_mm: float = 1.5, open_valves: bool = False) -> LabelVolume:
    """Return the blood and walls of the STL surfaces in `folder` on an upright grid of `spacing_mm`.

    Vessels are carried on beyond the surfaces' short stubs as straight tubes. wall_mm: what at least lies between two
    pools, taken off the atria and vessels; with `open_valves` the mitral and tricuspid gaps hold blood instead.

    Raises:
        DataError: a surface or caps.json is missing or damaged.
    """
    surfaces = {name: read_stl(folder / f"{name}.stl") for name in (*_CAVITIES.values(), *_WALLS)}
    caps = _caps(folder / "caps.json")
    corners = np.concatenate([surface.vertices_mm for surface in surfaces.values()])
    grid = upright_grid(corners.min(axis=0) - _MARGIN_MM, corners.max(axis=0) + _MARGIN_MM, spacing_mm)
    pools = {key: inside(surfaces[name], grid) for key, name in _CAVITIES.items()}
    walls = np.logical_or.reduce([inside(surfaces[name], grid) for name in _WALLS])
    labels = np.zeros(grid.shape, np.uint8)
    for key, mask in pools.items():
        labels[mask] = CATALOGUE[key].label
    valves = {"aorta": "aortic-valve", "pulmonary_artery": "pulmonary-valve"}
    for key, name in _STUBS.items():
        hollow = inside(_hull(surfaces[name].vertices_mm), grid) & ~walls & (labels == 0)
        labels[hollow] = CATALOGUE[key].label
        _carry_on_trunk(labels, grid, key, surfaces[name].vertices_mm, caps[valves[key]])
    for cap, (key, chamber, bearing, length) in _CARRIED_ON.items():
        _, normal = open_at(surfaces[_CAVITIES[chamber]], caps[cap][0])
        start, radius = caps[cap]
        towards = normal + np.asarray(bearing)
        end = start + length * towards / np.linalg.norm(towards)
        _lay_tube(labels, grid, CATALOGUE[key].label, (start - 2.0 * normal, start + 5.0 * normal, end), radius)
    _keep_apart(labels, grid, wall_mm)
    if open_valves:
        _open_valves(labels, grid)
    tissue = (walls | _between(labels > 0, walls, spacing_mm)) & (labels == 0)
    labels[tissue] = CATALOGUE["myocardium"].label
    names = {each.label: each.key for each in CATALOGUE.values()}
    return LabelVolume(labels, grid, names)


def _caps(path: Path) -> dict[str, tuple[FloatArray, float]]:
    """Return each opening's centre (3,) mm and radius, mm."""
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
        return {
            name: (np.asarray(each["centroid_mm"], float), float(each["eq_diameter_mm"]) / 2.0)
            for name, each in entries.items()
        }
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"{path} does not name the openings; give the folder that holds it.") from error


def _hull(points: FloatArray) -> Surface:
    """Return the convex hull's surface, triangles facing outwards."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int64)
    first, second, third = (points[triangles[:, corner]] for corner in range(3))
    normals = np.cross(second - first, third - first)
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return Surface(points, triangles)


def _carry_on_trunk(
    labels: npt.NDArray[np.uint8], grid: Grid, key: str, wall: FloatArray, valve: tuple[FloatArray, float]
) -> None:
    """Carry the aorta's or the pulmonary artery's stub on, in place: along the line from its valve to its far end."""
    along = (wall - valve[0]) @ (wall.mean(axis=0) - valve[0])
    far = wall[along > np.quantile(along, 0.85)]
    direction = wall.mean(axis=0) - valve[0]
    direction = direction / np.linalg.norm(direction)
    end = far.mean(axis=0)
    radius = 13.0 if key == "aorta" else 11.5
    # The aorta rises, a little to the left; the pulmonary trunk goes backwards to where it forks below the arch.
    towards = np.array([0.2, 0.0, 1.0]) if key == "aorta" else direction + np.array([-0.1, 1.2, 0.2])
    tip = end + _TRUNK_MM[key] * towards / np.linalg.norm(towards)
    _lay_tube(labels, grid, CATALOGUE[key].label, (valve[0] + 6.0 * direction, end, tip), radius)
    if key == "pulmonary_artery":
        for bearing in ((-1.0, 0.55, 0.0), (0.75, 0.7, 0.05)):
            branch = tip + _BRANCH_MM * np.asarray(bearing) / np.linalg.norm(bearing)
            _lay_tube(labels, grid, CATALOGUE[key].label, (tip, branch), _BRANCH_RADIUS_MM)


def _lay_tube(
    labels: npt.NDArray[np.uint8], grid: Grid, label: int, path: tuple[FloatArray, ...], radius_mm: float
) -> None:
    """Label, in place, the free voxels of a tube along `path`, a wall's width away from everything else."""
    corners = np.stack(path)
    margin = radius_mm + 4.0
    low = np.maximum(np.floor(grid.to_voxel(corners.min(axis=0) - margin)).astype(int), 0)
    high = np.minimum(np.ceil(grid.to_voxel(corners.max(axis=0) + margin)).astype(int) + 1, grid.shape[::-1])
    box = tuple(slice(low[axis], high[axis]) for axis in (2, 1, 0))
    k, j, i = np.meshgrid(*(np.arange(each.start, each.stop) for each in box), indexing="ij")
    points = grid.to_ct(np.stack([i, j, k], axis=-1))
    nearest = np.full(points.shape[:3], np.inf)
    for start, end in pairwise(path):
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - start - share[..., None] * along, axis=-1))
    window = labels[box]
    joined = {label, *(CATALOGUE[chamber].label for _, chamber, *_ in _CARRIED_ON.values())}
    strangers = (window > 0) & ~np.isin(window, list(joined))
    free = window == 0
    if strangers.any():
        free &= ndimage.distance_transform_edt(~strangers, sampling=grid.spacing_mm[::-1]) > _VESSEL_WALL_MM
    window[(nearest < radius_mm) & free] = label


def _keep_apart(labels: npt.NDArray[np.uint8], grid: Grid, wall_mm: float) -> None:
    """Take off, in place, what of the atria and vessels is closer than `wall_mm` to a pool that they do not open to."""
    joined = {
        "left_atrium": ("pulmonary_veins", "left_atrial_appendage"),
        "right_atrium": ("superior_vena_cava", "inferior_vena_cava"),
        "aorta": (),
        "pulmonary_artery": (),
        "superior_vena_cava": ("right_atrium",),
        "inferior_vena_cava": ("right_atrium",),
        "pulmonary_veins": ("left_atrium",),
        "left_atrial_appendage": ("left_atrium",),
    }
    for key, friends in joined.items():
        own = [CATALOGUE[each].label for each in (key, *friends)]
        box = _box_of(labels == own[0], math.ceil(wall_mm / grid.spacing_mm[0]) + 1)
        window = labels[box]
        others = (window > 0) & ~np.isin(window, own)
        if others.any():
            near = ndimage.distance_transform_edt(~others, sampling=grid.spacing_mm[::-1]) < wall_mm
            window[(window == own[0]) & near] = 0


def _box_of(mask: npt.NDArray[np.bool_], margin: int) -> tuple[slice, ...]:
    """Return the box about what is in the mask, `margin` voxels wider on every side."""
    (found,) = ndimage.find_objects(mask.astype(np.uint8))
    return tuple(
        slice(max(each.start - margin, 0), min(each.stop + margin, size))
        for each, size in zip(found, mask.shape, strict=True)
    )


def _open_valves(labels: npt.NDArray[np.uint8], grid: Grid) -> None:
    """Fill the gap between each atrium and its ventricle, in place: half and half."""
    for atrium, ventricle in (("left_atrium", "left_ventricle"), ("right_atrium", "right_ventricle")):
        reach = [
            ndimage.distance_transform_edt(labels != CATALOGUE[key].label, sampling=grid.spacing_mm[::-1])
            for key in (atrium, ventricle)
        ]
        gap = (labels == 0) & (reach[0] + reach[1] < 4.0)
        labels[gap & (reach[0] < reach[1])] = CATALOGUE[atrium].label
        labels[gap & (reach[0] >= reach[1])] = CATALOGUE[ventricle].label


def _between(blood: npt.NDArray[np.bool_], walls: npt.NDArray[np.bool_], spacing_mm: float) -> npt.NDArray[np.bool_]:
    """Return the narrow gaps between pools and walls, and the walls of the vessels that were carried on."""
    box = _box_of(blood | walls, math.ceil(2.0 * _GAP_MM / spacing_mm) + 1)
    between = np.zeros_like(blood)
    near = ndimage.distance_transform_edt(~(blood | walls)[box], sampling=spacing_mm) <= _GAP_MM
    between[box] = ndimage.distance_transform_edt(near, sampling=spacing_mm) > _GAP_MM
    between[box] |= ndimage.distance_transform_edt(~blood[box], sampling=spacing_mm) <= _VESSEL_WALL_MM
    return between
