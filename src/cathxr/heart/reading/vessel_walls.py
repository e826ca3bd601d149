"""The inside of a vessel whose wall alone is given: a tube, open at its ends."""

import itertools

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.volume import Grid

_STEP_MM = 1.0

Mask = npt.NDArray[np.bool_]


def enclosed_by_wall(wall: Mask, grid: Grid) -> Mask:
    """Return what a tube's wall (K, J, I) goes all round of, in planes of any of 16 directions; its largest piece.

    A bent vessel is cut squarely by other planes at one end than at the other, so that all of them are joined. The
    directions are those of a voxel's neighbours, and the wall's own principal axes: a short ring needs the one across.
    """
    out = np.zeros_like(wall)
    if not wall.any():
        return out
    box = ndimage.find_objects(wall.astype(np.uint8))[0]
    centres = grid.to_ct(np.argwhere(wall[box])[:, ::-1] + [each.start for each in reversed(box)])
    middle, reach = centres.mean(axis=0), float(np.linalg.norm(np.ptp(centres, axis=0))) / 2.0 + 2.0 * _STEP_MM
    cut = wall[box].astype(np.float32)
    found = np.zeros(cut.shape, np.float32)
    principal = np.linalg.svd(centres - middle, full_matrices=False)[2]
    for direction in (*_directions(), *principal):
        found = np.maximum(found, _filled(cut, direction, middle, reach, grid, box))
    inside = (found > 0.5) & ~wall[box]
    parts, count = ndimage.label(inside)
    if count:
        sizes = np.bincount(parts.ravel())
        out[box] = parts == int(np.argmax(sizes[1:])) + 1
    return out


def _directions() -> list[FloatArray]:
    """Return unit vectors (3,) of the 13 lines through a voxel's neighbours."""
    all_of = [np.array(each, float) for each in itertools.product((-1, 0, 1), repeat=3) if each > (0, 0, 0)]
    return [each / np.linalg.norm(each) for each in all_of]


def _filled(
    cut: npt.NDArray[np.float32],
    direction: FloatArray,
    middle: FloatArray,
    reach: float,
    grid: Grid,
    box: tuple[slice, ...],
) -> npt.NDArray[np.float32]:
    """Return the holes of the wall in planes across `direction`, on the voxels of the box again."""
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    across = np.cross(direction, helper)
    across = across / np.linalg.norm(across)
    turned = np.stack([direction, across, np.cross(direction, across)])  # rows: axes of the planes' own grid
    half = int(np.ceil(reach / _STEP_MM))
    steps = (np.indices((2 * half + 1,) * 3).reshape(3, -1).T - half) * _STEP_MM
    start = np.array([each.start for each in box])
    voxels = grid.to_voxel(middle + steps @ turned)[:, ::-1] - start
    planes = ndimage.map_coordinates(cut, voxels.T, order=1).reshape((2 * half + 1,) * 3) > 0.5
    holes = np.stack([ndimage.binary_fill_holes(each) & ~each for each in planes]).astype(np.float32)
    centres = grid.to_ct((np.indices(cut.shape).reshape(3, -1).T + start)[:, ::-1])
    back = (centres - middle) @ turned.T / _STEP_MM + half
    # Voxels between the planes' holes and the wall belong to the hole: rounding leaves a seam of one step.
    grown = ndimage.grey_dilation(holes, size=(1, 3, 3))
    return np.asarray(ndimage.map_coordinates(grown, back.T, order=1).reshape(cut.shape))
