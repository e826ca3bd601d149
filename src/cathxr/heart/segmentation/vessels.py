"""An atrium told from the veins that open into it: by where it gets narrow, named by the atlas."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.segmentation.atlas import STRUCTURES
from cathxr.heart.segmentation.images import box_of
from cathxr.heart.volume import Grid

GROUPS: Mapping[str, Sequence[str]] = {
    "left_ventricle": ("left_ventricle",),
    "right_ventricle": ("right_ventricle",),
    "left_atrium": ("left_atrium", "pulmonary_veins", "left_atrial_appendage"),
    "right_atrium": ("right_atrium", "superior_vena_cava", "inferior_vena_cava"),
    "aorta": ("aorta",),
    "pulmonary_artery": ("pulmonary_artery",),
}
"""What is told apart first, and the structures of the atlas that each takes in: the first is its body."""
_SCALES_MM: Mapping[str, Sequence[float]] = {
    "left_atrium": (12.0, 10.5, 9.0, 8.0, 7.0, 6.0, 5.0, 4.0),
    "right_atrium": (14.0, 12.5, 11.0, 9.5, 8.0, 6.5, 5.0),
}
"""Radii of the balls that feel out the body and then what leads away from it, wide before narrow."""
_SHELL_MM = 1.6
_LEAST_ML = 0.3
_LONG = 1.2


def grouped(per_structure: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the distances (G, …) mm to the groups from those to each of STRUCTURES (S, …)."""
    return np.stack([per_structure[[STRUCTURES.index(key) for key in keys]].min(axis=0) for keys in GROUPS.values()])


def split(
    group: npt.NDArray[np.bool_], key: str, distances: npt.NDArray[np.float32], grid: Grid
) -> dict[str, npt.NDArray[np.bool_]]:
    """Return the parts (K, J, I) of a group by structure.

    distances (S, K, J, I): of the fitted atlas's STRUCTURES. The body is what a large ball reaches. Smaller and smaller
    balls then reach more: what sticks out further than it is wide, most of it outside the atlas's body, is a vessel, and
    the rest joins the body. Vessels are named after the atlas's nearest; caval veins by whether they lead up or down.
    """
    members = GROUPS[key]
    parts = {member: np.zeros(group.shape, bool) for member in members}
    if len(members) == 1 or not group.any():
        parts[key] = group
        return parts
    scales = _SCALES_MM[key]
    margin = round(scales[0] / grid.spacing_mm[0]) + 2
    box = box_of(group)
    mask = np.pad(group[box], margin)
    indices = [STRUCTURES.index(member) for member in members]
    far = np.stack([np.pad(distances[(index, *box)], margin, mode="edge") for index in indices])
    owner = np.zeros(mask.shape, np.uint8)
    body = _largest(_opened(mask, scales[0], grid.spacing_mm[0]))
    for radius in (*scales[1:], 0.0) if body.any() else ():
        free = mask & (owner == 0)
        reached = body | (_opened(free, radius, grid.spacing_mm[0]) if radius else free)
        for branch in _branches(body, reached, far[0], radius or scales[-1], grid):
            upwards = np.argwhere(branch)[:, 0].mean() > np.argwhere(body)[:, 0].mean()
            nearest = 1 + int(np.argmin([each[branch].mean() for each in far[1:]]))
            owner[branch] = (1 if upwards else 2) if key == "right_atrium" else nearest
        body = reached & (owner == 0)
    inner = tuple(slice(margin, -margin) for _ in range(3))
    for number, member in enumerate(members):
        parts[member][box] = (mask & (owner == number))[inner]
    return parts


def _branches(
    body: npt.NDArray[np.bool_],
    reached: npt.NDArray[np.bool_],
    outside: npt.NDArray[np.float32],
    radius_mm: float,
    grid: Grid,
) -> list[npt.NDArray[np.bool_]]:
    """Return what of `reached` leads away from the body as vessels, each to where it leaves the body.

    outside: distance mm to the atlas's body, negative within it.
    """
    sampling = grid.spacing_mm[::-1]
    away = ndimage.distance_transform_edt(~body, sampling=sampling)
    pieces, count = ndimage.label(reached & (away > _SHELL_MM))
    found = []
    reach = ndimage.maximum(away, pieces, np.arange(1, count + 1)) if count else []
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        voxels = pieces[box] == number
        long = reach[number - 1] > _LONG * radius_mm + 2.0 and voxels.sum() * grid.voxel_ml > _LEAST_ML
        if not long or (outside[box][voxels] < 0.0).mean() > 0.5:
            continue
        wide = tuple(slice(max(each.start - 3, 0), each.stop + 3) for each in box)
        own = pieces[wide] == number
        # The thin shell about the body that was left out above goes with the vessel that leaves from it.
        near = ndimage.distance_transform_edt(~own, sampling=sampling) <= _SHELL_MM + grid.spacing_mm[0]
        branch = np.zeros_like(body)
        branch[wide] = own | (near & reached[wide] & ~body[wide])
        found.append(branch)
    return found


def _opened(mask: npt.NDArray[np.bool_], radius_mm: float, spacing_mm: float) -> npt.NDArray[np.bool_]:
    """Return what a ball of this radius reaches within the mask."""
    centres = ndimage.distance_transform_edt(mask, sampling=spacing_mm) >= radius_mm
    if not centres.any():
        return np.zeros_like(mask)
    return np.asarray(mask & (ndimage.distance_transform_edt(~centres, sampling=spacing_mm) < radius_mm))


def _largest(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return the mask's largest piece."""
    pieces, count = ndimage.label(mask)
    if count < 2:
        return mask
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.asarray(pieces == sizes.argmax())
