"""An atrium told from the veins that open into it: by where it gets narrow, named by the atlas."""

from collections.abc import Mapping, Sequence
from typing import Any

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
SPRING_FROM: Mapping[str, str] = {
    **{key: key for key in ("left_ventricle", "right_ventricle", "left_atrium", "right_atrium")},
    "aorta": "left_ventricle",
    "pulmonary_artery": "right_ventricle",
}
"""The chamber that each group is, or springs from."""
SPRINGS: Mapping[int, int] = {
    number: list(GROUPS).index(SPRING_FROM[key]) for number, key in enumerate(GROUPS) if SPRING_FROM[key] != key
}
"""The same for the great arteries, by the groups' numbers."""
_SCALES_MM: Mapping[str, Sequence[float]] = {
    "left_atrium": (12.0, 10.5, 9.0, 8.0, 7.0, 6.0, 5.0, 4.0),
    "right_atrium": (14.0, 12.5, 11.0, 9.5, 8.0, 6.5, 5.0),
}
"""Radii of the balls that feel out the body and then what leads away from it, wide before narrow."""
_WIDE_MM: Mapping[str, float] = {"left_atrium": 10.0, "right_atrium": 11.0}
"""What a ball of this radius reaches is no vein."""
_OUTFLOW_MM, _OUTFLOW_REACH_MM = 3.0, 12.0
_CAP, _CAP_DEPTH_MM = 1.35, -1.0
_STREAK_MM = 3.0
_SHELL_MM = 1.6
_LEAST_ML = 0.3
_LONG, _LONG_BEYOND, _BEYOND_MM = 1.2, 0.5, 2.0
"""How far a vessel sticks out, over the ball's radius; less is enough well beyond the atlas's body."""


def grouped(per_structure: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the distances (G, …) mm to the groups from those to each of STRUCTURES (S, …)."""
    return np.stack([per_structure[[STRUCTURES.index(key) for key in keys]].min(axis=0) for keys in GROUPS.values()])


def outflows(
    likely: npt.NDArray[np.float32], owner: npt.NDArray[np.integer[Any]], distances: npt.NDArray[np.float32], grid: Grid
) -> npt.NDArray[np.float32]:
    """Return the probabilities (G + 1, K, J, I) with what leads far out of a ventricle given to its great artery.

    owner (K, J, I): each voxel's group. Where a valve stands open, nothing but the atlas says where the ventricle ends.
    """
    out = likely.copy()
    keys = list(GROUPS)
    for artery, ventricle in (("aorta", "left_ventricle"), ("pulmonary_artery", "right_ventricle")):
        mine, its = keys.index(ventricle), keys.index(artery)
        outside = distances[STRUCTURES.index(ventricle)]
        pieces, count = ndimage.label((owner == mine) & (outside > _OUTFLOW_MM))
        if not count:
            continue
        reach = ndimage.maximum(outside, pieces, np.arange(1, count + 1))
        far = np.isin(pieces, 1 + np.flatnonzero(reach > _OUTFLOW_REACH_MM))
        out[its][far] = np.maximum(out[its][far], out[mine][far])
        out[mine][far] = 0.0
    return out


def split(
    group: npt.NDArray[np.bool_], key: str, distances: npt.NDArray[np.float32], grid: Grid
) -> dict[str, npt.NDArray[np.bool_]]:
    """Return the parts (K, J, I) of a group by structure.

    distances (S, K, J, I): of the fitted atlas's STRUCTURES. The body is what a large ball reaches. Smaller and smaller
    balls then reach more: what sticks out further than it is wide, most of it outside the atlas's body, is a vessel,
    and the rest joins the body. Vessels are named after the nearest of the atlas, caval veins by going up or down.
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
    if key == "right_atrium":
        # Contrast that has not mixed yet leaves dark streaks there: what is thick is judged without them.
        mask |= _closed(mask, _STREAK_MM, grid.spacing_mm[0])
    indices = [STRUCTURES.index(member) for member in members]
    far = np.stack([np.pad(distances[index][box], margin, mode="edge") for index in indices])
    owner = np.zeros(mask.shape, np.uint8)
    whole = tuple(slice(0, size) for size in mask.shape)
    thickest = float(ndimage.distance_transform_edt(mask, sampling=grid.spacing_mm[::-1]).max())
    scales = [min(scales[0], 0.8 * thickest), *(radius for radius in scales[1:] if radius < 0.75 * thickest)]
    body = _largest(_opened(mask, scales[0], grid.spacing_mm[0]))
    joined_at = np.full(mask.shape, scales[0], np.float32)
    for radius in (*scales[1:], 0.0) if body.any() else ():
        free = mask & (owner == 0)
        believed = key != "left_atrium" or radius >= _WIDE_MM[key]
        reached = body | (_opened(free, radius, grid.spacing_mm[0]) if radius else free)
        for branch in _branches(body, reached, far[0], radius or scales[-1], grid, believed):
            branch |= _cap(branch, body & (joined_at < _CAP * radius) & (far[0] > _CAP_DEPTH_MM), radius, grid)
            owner[branch] = _member(branch, whole, far, body, key)
        joined_at[reached & ~body] = radius
        body = reached & (owner == 0)
    if body.any():
        stubs = body & ~_opened(mask, _WIDE_MM[key], grid.spacing_mm[0]) & (far[0] > _BEYOND_MM)
        _name_stubs(stubs, owner, far, body, key, grid)
    inner = tuple(slice(margin, -margin) for _ in range(3))
    for number, member in enumerate(members):
        parts[member][box] = (owner == number)[inner] & group[box]
    return parts


def _cap(
    branch: npt.NDArray[np.bool_], narrow: npt.NDArray[np.bool_], radius_mm: float, grid: Grid
) -> npt.NDArray[np.bool_]:
    """Return what of the body's narrow parts belongs to a vessel's mouth: a ball hardly wider bulges into it."""
    box = box_of(branch, round(radius_mm / grid.spacing_mm[0]) + 2)
    near = ndimage.distance_transform_edt(~branch[box], sampling=grid.spacing_mm[::-1]) <= radius_mm
    pieces, _ = ndimage.label(branch[box] | (narrow[box] & near))
    cap = np.zeros_like(branch)
    cap[box] = np.isin(pieces, np.unique(pieces[branch[box]])) & narrow[box]
    return cap


def _name_stubs(
    stubs: npt.NDArray[np.bool_],
    owner: npt.NDArray[np.uint8],
    far: npt.NDArray[np.float32],
    body: npt.NDArray[np.bool_],
    key: str,
    grid: Grid,
) -> None:
    """Put into `owner`, in place, the veins' wide ends: what is narrow and well beyond the atlas's body."""
    pieces, _ = ndimage.label(stubs)
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        voxels = pieces[box] == number
        if voxels.sum() * grid.voxel_ml > _LEAST_ML:
            owner[box][voxels] = _member(voxels, box, far, body, key)


def _member(
    voxels: npt.NDArray[np.bool_],
    box: tuple[slice, ...],
    far: npt.NDArray[np.float32],
    body: npt.NDArray[np.bool_],
    key: str,
) -> int:
    """Return the number among the group's members of a vessel, whose voxels are given within a box."""
    if key == "right_atrium":
        height = np.argwhere(voxels)[:, 0].mean() + box[0].start
        return 1 if height > np.argwhere(body)[:, 0].mean() else 2
    return 1 + int(np.argmin([each[box][voxels].mean() for each in far[1:]]))


def _branches(
    body: npt.NDArray[np.bool_],
    reached: npt.NDArray[np.bool_],
    outside: npt.NDArray[np.float32],
    radius_mm: float,
    grid: Grid,
    believed: bool,
) -> list[npt.NDArray[np.bool_]]:
    """Return what of `reached` leads away from the body as vessels, each to where it leaves the body.

    outside: distance mm to the atlas's body, negative within it; believed: whether what lies within is no vessel.
    """
    sampling = grid.spacing_mm[::-1]
    away = ndimage.distance_transform_edt(~body, sampling=sampling)
    pieces, count = ndimage.label(reached & (away > _SHELL_MM))
    found = []
    reach = ndimage.maximum(away, pieces, np.arange(1, count + 1)) if count else []
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        voxels = pieces[box] == number
        beyond = outside[box][voxels]
        needed = (_LONG if beyond.mean() < _BEYOND_MM else _LONG_BEYOND) * radius_mm + 2.0
        small = voxels.sum() * grid.voxel_ml < _LEAST_ML
        if small or reach[number - 1] < needed or (believed and (beyond < 0.0).mean() > 0.5):
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


def _closed(mask: npt.NDArray[np.bool_], radius_mm: float, spacing_mm: float) -> npt.NDArray[np.bool_]:
    """Return the mask with what is narrower than twice the radius filled."""
    near = ndimage.distance_transform_edt(~mask, sampling=spacing_mm) <= radius_mm
    return np.asarray(ndimage.distance_transform_edt(near, sampling=spacing_mm) > radius_mm)


def _largest(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return the mask's largest piece."""
    pieces, count = ndimage.label(mask)
    if count < 2:
        return mask
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.asarray(pieces == sizes.argmax())
