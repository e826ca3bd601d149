"""What lies around the pools where there is no CT: walls of usual thickness, fat in the grooves, pericardium, lung."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.special import ndtr

from cathxr.core import FloatArray
from cathxr.heart.acoustic_codes import codes_of
from cathxr.heart.model import Opening
from cathxr.heart.resample import Float32
from cathxr.heart.tissues import properties
from cathxr.heart.volume import Grid

STUB_MM = 40.0
"""How far a vessel goes on beyond its opening."""
_GROOVE_MM = 10.0
"""A gap between walls that a ball of this radius cannot enter is full of fat."""
_PERICARDIUM_MM = 2.0


@dataclass(frozen=True)
class Wall:
    """The wall around a pool of blood: its thickness and its tissue."""

    thickness_mm: float
    tissue: str


_MUSCLE = "myocardium"
_WALLS = {
    "left_ventricle": Wall(9.0, _MUSCLE),
    "left_heart": Wall(6.0, _MUSCLE),
    "right_ventricle": Wall(3.5, _MUSCLE),
    "right_heart": Wall(3.0, _MUSCLE),
    "blood_pool": Wall(3.0, _MUSCLE),
    "left_atrium": Wall(2.0, _MUSCLE),
    "right_atrium": Wall(2.0, _MUSCLE),
    "left_atrial_appendage": Wall(2.0, _MUSCLE),
}
_VESSEL = Wall(1.8, "vessel_wall")


def wall_of(key: str) -> Wall:
    """Return the usual wall of a structure. End-diastolic thickness of healthy adults; vessels have about 2 mm.

    Left ventricle 6 to 10 mm (Lang et al., J Am Soc Echocardiogr 2015, table 6), right 1 to 5 mm (the same, table 8),
    atria about 2 mm (Whiteman et al., Clin Anat 2019, a review).
    """
    return _WALLS.get(key, _VESSEL)


@dataclass(frozen=True, eq=False)
class Pool:
    """A pool of blood on the texture's grid. distance_mm (K, J, I): inside positive, exact near the boundary."""

    wall: Wall
    distance_mm: Float32


def stub_distance(opening: Opening, grid: Grid) -> Float32:
    """Return the signed distance (K, J, I) mm from a tube that goes on from an opening along its normal."""
    kji = np.indices(grid.shape, dtype=np.float32)
    points = grid.to_ct(np.stack([kji[2], kji[1], kji[0]], axis=-1)) - opening.centroid_mm
    along = points @ opening.normal
    across = np.sqrt(np.maximum((points**2).sum(axis=-1) - along**2, 0.0))
    sideways = opening.diameter_mm / 2.0 - across
    # It begins a little inside, so that no seam is left at the opening.
    return np.asarray(np.minimum(np.minimum(sideways, along + 2.0), STUB_MM - along), dtype=np.float32)


def shell_codes(pools: list[Pool], muscle: Float32 | None, grid: Grid, *, edge_mm: float) -> list[Float32]:
    """Return four fields (K, J, I; see `codes_of`) of what surrounds the pools, as if the blood were not there.

    muscle: signed distance from the labelled myocardium, where there is a label.
    """
    step = float(grid.spacing_mm[0])
    beyond_muscle = np.full(grid.shape, np.inf, dtype=np.float32)
    beyond_vessel = beyond_muscle.copy()
    for wall in sorted({each.wall for each in pools}, key=lambda each: (each.tissue, each.thickness_mm)):
        inside = np.max([each.distance_mm for each in pools if each.wall == wall], axis=0)
        outside = _outside(inside, step) - np.float32(wall.thickness_mm)
        into = beyond_muscle if wall.tissue == _MUSCLE else beyond_vessel
        np.minimum(into, outside, out=into)
    if muscle is not None:
        np.minimum(beyond_muscle, -muscle, out=beyond_muscle)
    beyond_wall = np.minimum(beyond_muscle, beyond_vessel)
    beyond_heart = np.minimum(_closed(beyond_wall, step), beyond_wall)
    shares = [
        ("myocardium", _below(beyond_muscle, edge_mm)),
        ("vessel_wall", _below(beyond_vessel, edge_mm)),
        ("fat", _below(beyond_heart, edge_mm)),
        ("pericardium", _below(beyond_heart - np.float32(_PERICARDIUM_MM), edge_mm)),
    ]
    return _layered(shares, "lung", grid)


def _layered(shares: list[tuple[str, Float32]], rest: str, grid: Grid) -> list[Float32]:
    """Return the fields of layers, the first one on top; what no layer covers is `rest`."""
    codes = codes_of(properties([*(key for key, _ in shares), rest])).astype(np.float32)
    fields = [np.full(grid.shape, codes[-1, at], dtype=np.float32) for at in range(4)]
    for (_, share), code in reversed(list(zip(shares, codes[:-1], strict=True))):
        for at in range(4):
            fields[at] += share * (code[at] - fields[at])
    return fields


def _outside(inside_mm: Float32, step: float) -> Float32:
    """Return the distance (K, J, I) mm from where `inside_mm` is positive, 0 there, finer than the voxels.

    From the nearest inside voxel, less how deep that one lies; then smoothed, which leaves a plane's distance be.
    """
    inside = inside_mm > 0.0
    if not inside.any():
        return np.full(inside_mm.shape, 1e3, dtype=np.float32)
    away, nearest = ndimage.distance_transform_edt(~inside, sampling=step, return_indices=True)
    depth = np.minimum(inside_mm[tuple(nearest)], np.float32(step))
    rough: FloatArray = np.where(inside, -np.minimum(inside_mm, np.float32(2.0 * step)), away - depth)
    return np.asarray(ndimage.gaussian_filter(rough.astype(np.float32), 1.0, mode="nearest"))


def _closed(beyond_mm: Float32, step: float) -> Float32:
    """Return the distance (K, J, I) mm beyond the closed shape: what a ball of `_GROOVE_MM` cannot enter is inside."""
    # The ball must have room beyond the texture, or else every wall near its border would be closed up to it.
    room = int(np.ceil(_GROOVE_MM / step)) + 2
    far = _outside(np.pad(-beyond_mm, room, mode="edge"), step) > _GROOVE_MM
    back = ndimage.distance_transform_edt(~far, sampling=step).astype(np.float32)
    closed = ndimage.gaussian_filter(np.float32(_GROOVE_MM) - back, 1.0, mode="nearest")
    return np.asarray(closed[room:-room, room:-room, room:-room])


def _below(distance_mm: Float32, edge_mm: float) -> Float32:
    """Return the share (K, J, I) of what lies where a distance is negative, with an edge of the wanted width."""
    return np.asarray(ndtr(-distance_mm / np.float32(edge_mm)), dtype=np.float32)
