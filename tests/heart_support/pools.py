"""A contrast CT of the real heart's closed pools, as they are or bent out of shape: its volumes are known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial.transform import Rotation

from cathxr.core import FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.segmentation.model_heart import labelled_heart
from cathxr.heart.volume import Grid, LabelVolume, Technical, Volume

from .shapes import box, ellipsoid, tube

_RIGHT = ("right_ventricle", "right_atrium", "pulmonary_artery", "superior_vena_cava", "inferior_vena_cava")
_TISSUE = CATALOGUE["myocardium"].label
_WARP_LENGTH_MM = 35.0


@dataclass(frozen=True)
class PoolsLook:
    """What the scan shows. HU, noise (standard deviation) and blur (full width at half maximum) as for HeartLook.

    stretch: lengths' relative change along three random axes, at most; warp_mm: of a smooth displacement, at most.
    wall_mm: the least between two pools. open_valves: mitral and tricuspid gaps show blood.
    """

    left_hu: float = 400.0
    right_hu: float = 320.0
    tissue_hu: float = 100.0
    noise_hu: float = 22.0
    blur_mm: float = 0.9
    stretch: float = 0.0
    turn_deg: float = 0.0
    warp_mm: float = 0.0
    wall_mm: float = 1.5
    open_valves: bool = False


def from_pools(
    stl_folder: Path,
    spacing_mm: float = 0.75,
    *,
    look: PoolsLook | None = None,
    seed: int = 0,
    source: LabelVolume | None = None,
) -> tuple[Volume, LabelVolume]:
    """Return the scan and the truth. source: `labelled_heart` of the same walls and valves, made once for several."""
    look = look or PoolsLook()
    if source is None:
        source = labelled_heart(stl_folder, spacing_mm * 0.8, wall_mm=look.wall_mm, open_valves=look.open_valves)
    rng = np.random.default_rng([seed, 0x9001])
    low, high = source.grid.to_ct(np.zeros(3)), source.grid.to_ct(np.asarray(source.grid.shape[::-1]) - 1.0)
    hu = _painted(source, look)
    ndimage.gaussian_filter(hu, look.blur_mm / 2.3548 / source.grid.spacing_mm[::-1], output=hu)
    counts = np.floor((high - low) / spacing_mm).astype(int) + 1
    matrix = np.diag([spacing_mm, spacing_mm, spacing_mm, 1.0])
    matrix[:3, 3] = low
    grid = Grid((int(counts[2]), int(counts[1]), int(counts[0])), matrix)
    linear = _linear(look, rng)
    coarse = _displacement(grid, look, rng)
    out = np.empty(grid.shape, np.int16)
    labels = np.empty(grid.shape, np.uint8)
    blood = np.where(source.labels == _TISSUE, 0, source.labels).astype(np.uint8)
    middle = (low + high) / 2.0
    for k in range(grid.shape[0]):
        at = _source_voxels(grid, k, linear, middle, coarse, source.grid)
        sampled = ndimage.map_coordinates(hu, at, order=1, mode="nearest")
        out[k] = np.clip(sampled + rng.normal(0.0, look.noise_hu, sampled.shape), -1024, 3071)
        labels[k] = ndimage.map_coordinates(blood, at, order=0, mode="nearest")
    names = {each.label: each.key for each in CATALOGUE.values()}
    return Volume(out, grid, Technical("CT", contrast=True)), LabelVolume(labels, grid, names)


def _painted(source: LabelVolume, look: PoolsLook) -> npt.NDArray[np.float32]:
    """Return the HU of the heart's labels, in a chest: fat, lungs, liver, spine, breastbone, descending aorta."""
    grid = source.grid
    some = slice(None, None, 2)
    outside = ndimage.distance_transform_edt(source.labels[some, some, some] == 0, sampling=2.0 * grid.spacing_mm[::-1])
    outside = outside.astype(np.float32).repeat(2, 0).repeat(2, 1).repeat(2, 2)
    outside = outside[: grid.shape[0], : grid.shape[1], : grid.shape[2]]
    hu = np.full(grid.shape, -820.0, np.float32)
    hu[outside < 5.0] = -90.0
    shapes = (
        (ellipsoid((60.0, 60.0, -85.0), (140.0, 110.0, 84.0)), 110.0),
        (box((60.0, -40.0, 60.0), (200.0, 18.0, 200.0)), 40.0),
        (box((60.0, -32.0, 60.0), (18.0, 6.0, 200.0)), 480.0),
        (tube([(55.0, 152.0, -100.0), (55.0, 152.0, 250.0)], 17.0), 600.0),
        (tube([(55.0, 152.0, -100.0), (55.0, 152.0, 250.0)], 15.0), 190.0),
        (tube([(102.0, 146.0, -100.0), (102.0, 146.0, 250.0)], 13.0), 60.0),
        (tube([(102.0, 146.0, -100.0), (102.0, 146.0, 250.0)], 11.5), look.left_hu),
    )
    j, i = np.meshgrid(np.arange(grid.shape[1]), np.arange(grid.shape[2]), indexing="ij")
    free = (source.labels == 0) & (outside > 1.5)
    for k in range(grid.shape[0]):
        points = grid.to_ct(np.stack([i, j, np.full_like(i, k)], axis=-1)).reshape(-1, 3).astype(np.float32)
        for shape, value in shapes:
            hu[k][(shape(points).reshape(i.shape) < 0.0) & free[k]] = value
    hu[source.labels == _TISSUE] = look.tissue_hu
    right = [CATALOGUE[key].label for key in _RIGHT]
    blood = (source.labels > 0) & (source.labels != _TISSUE)
    hu[blood] = np.where(np.isin(source.labels[blood], right), look.right_hu, look.left_hu)
    return hu


def _linear(look: PoolsLook, rng: np.random.Generator) -> FloatArray:
    """Return the matrix (3, 3) from the scan to the heart: stretched along random axes and turned."""
    axes = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    stretch = 1.0 + rng.uniform(-look.stretch, look.stretch, 3)
    turn = Rotation.from_rotvec(np.deg2rad(rng.uniform(-look.turn_deg, look.turn_deg, 3))).as_matrix()
    return np.asarray(turn @ axes @ np.diag(1.0 / stretch) @ axes.T)


def _displacement(grid: Grid, look: PoolsLook, rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Return a smooth displacement (3, k, j, i) mm on every eighth voxel, `warp_mm` long where it is longest."""
    shape = tuple(size // 8 + 2 for size in grid.shape)
    noise = rng.normal(size=(3, *shape))
    smooth = ndimage.gaussian_filter(noise, (0.0, *(_WARP_LENGTH_MM / 8.0 / grid.spacing_mm[::-1])))
    longest = np.sqrt((smooth**2).sum(axis=0)).max()
    return (smooth * look.warp_mm / longest).astype(np.float32)


def _source_voxels(
    grid: Grid,
    k: int,
    linear: FloatArray,
    middle: FloatArray,
    coarse: npt.NDArray[np.float32],
    source: Grid,
) -> FloatArray:
    """Return where (3, J, I; in the order k, j, i) a slice's voxels lie in the source's grid."""
    j, i = np.meshgrid(np.arange(grid.shape[1]), np.arange(grid.shape[2]), indexing="ij")
    points = grid.to_ct(np.stack([i, j, np.full_like(i, k)], axis=-1))
    at = np.stack([np.full(i.shape, k / 8.0), j / 8.0, i / 8.0])
    shift = np.stack([ndimage.map_coordinates(each, at, order=1, mode="nearest") for each in coarse], axis=-1)
    moved = (points - middle) @ linear.T + middle + shift
    return np.moveaxis(source.to_voxel(moved), -1, 0)[::-1]
