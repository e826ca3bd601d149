"""How deep a point is in the virtual heart's wall: the signed distance from its blood, looked up between voxels."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import DataError, FloatArray
from cathxr.core.arrays import checked
from cathxr.heart.model import Opening
from cathxr.heart.volume import Grid, LabelVolume

_WALL = "myocardium"
_MARGIN_MM = 8.0
"""How far the field goes on beyond the labels; beyond that the distance to it is added."""
_BEGIN_MM = 3.0
_DISTANT_MM = 100.0
"""A vessel's continuation begins a little inside its opening, so that no seam is left, and goes on this far."""


@dataclass(frozen=True, eq=False)
class WallField:
    """The signed distance (K, J, I) mm from the blood's boundary on a grid: positive outside the blood."""

    depth_mm: npt.NDArray[np.float32]
    grid: Grid

    def __post_init__(self) -> None:
        if self.depth_mm.shape != self.grid.shape:
            raise ValueError(f"depth_mm: expected shape {self.grid.shape}, got {self.depth_mm.shape}")
        self.depth_mm.setflags(write=False)

    def depth_ct(self, points_ct: FloatArray) -> FloatArray:
        """Return how deep points (N, 3) mm in `ct` are in the wall: (N,) mm, trilinear; negative in the blood.

        Beyond the field, the distance to its nearest voxel is added to that voxel's: never too small.
        """
        voxel = self.grid.to_voxel(points_ct)
        inside = np.clip(voxel, 0.0, np.array(self.grid.shape[::-1]) - 1.0)
        looked_up = ndimage.map_coordinates(
            self.depth_mm, inside[:, ::-1].T, order=1, mode="nearest", output=np.float64
        )
        beyond = np.linalg.norm((voxel - inside) * self.grid.spacing_mm, axis=1)
        return np.asarray(looked_up + beyond)


@dataclass(frozen=True, eq=False)
class BoxDepth:
    """A `WallField` for points of `box`. ct_from_box (4, 4): the registration's matrix; lengths are those of `ct`."""

    field: WallField
    ct_from_box: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "ct_from_box", checked("ct_from_box", self.ct_from_box, (4, 4)))

    def __call__(self, points_box: FloatArray) -> FloatArray:
        """Return how deep points (N, 3) mm in `box` are in the wall: (N,) mm."""
        points = np.asarray(points_box, dtype=np.float64)
        return self.field.depth_ct(points @ self.ct_from_box[:3, :3].T + self.ct_from_box[:3, 3])


def wall_field(labels: LabelVolume, *, vessels: Iterable[Opening] = ()) -> WallField:
    """Return the field of a heart's labels: blood is every label but the myocardium's.

    vessels: openings that lead out of what is labelled (`acoustic.leads_out`), beyond which the blood goes on as a tube
    of the opening's diameter: a catheter that comes in through one is in no wall. Exact Euclidean distances between
    voxel centres; the boundary lies half a voxel beyond the last centre, so that it is off by up to half a voxel.

    Raises:
        DataError: nothing is labelled as blood.
    """
    blood = (labels.labels != 0) & ~labels.mask(_WALL)
    if not blood.any():
        raise DataError("The label volume holds no blood, so that there is no wall to go through.")
    spacing = labels.grid.spacing_mm
    pad = [int(np.ceil(_MARGIN_MM / each)) for each in spacing]
    blood = np.pad(blood, [(each, each) for each in pad[::-1]])
    matrix = np.array(labels.grid.ct_from_voxel)
    matrix[:3, 3] = labels.grid.to_ct(-np.array(pad, dtype=np.float64))
    k, j, i = blood.shape
    grid = Grid((k, j, i), matrix)
    for opening in vessels:
        _continue(blood, opening, grid)
    steps = tuple(float(each) for each in spacing[::-1])
    half = 0.5 * float(spacing.min())
    depth = ndimage.distance_transform_edt(~blood, sampling=steps).astype(np.float32)
    depth -= ndimage.distance_transform_edt(blood, sampling=steps).astype(np.float32)
    depth -= np.float32(half) * np.sign(depth)
    return WallField(depth, grid)


def _continue(blood: npt.NDArray[np.bool_], opening: Opening, grid: Grid) -> None:
    """Add the tube beyond an opening to the blood (K, J, I), in place.

    The grid's axes are orthogonal, so that the squared distance from the opening's centre, and the distance along its
    normal, are sums of one term for each axis.
    """
    centre = grid.to_voxel(opening.centroid_mm)
    normal = opening.normal @ (grid.ct_from_voxel[:3, :3] / grid.spacing_mm)
    squared = np.zeros((1, 1, 1), np.float32)
    along = np.zeros((1, 1, 1), np.float32)
    for axis, place in ((0, (1, 1, -1)), (1, (1, -1, 1)), (2, (-1, 1, 1))):
        count = grid.shape[2 - axis]
        offset = ((np.arange(count) - centre[axis]) * grid.spacing_mm[axis]).astype(np.float32).reshape(place)
        squared = squared + offset**2
        along = along + offset * np.float32(normal[axis])
    aside = squared - along**2
    blood |= (aside <= (opening.diameter_mm / 2.0) ** 2) & (along > -_BEGIN_MM) & (along < _DISTANT_MM)
