"""An atrium told from the veins that open into it: by where it gets narrow, named by the atlas."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.segmentation.atlas import STRUCTURES
from cathxr.heart.segmentation.cutting import least_cut
from cathxr.heart.segmentation.distances import closed, distance_to, distance_within
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
PARENTS: Mapping[str, str] = {
    "aorta": "left_ventricle",
    "pulmonary_artery": "right_ventricle",
    **{member: members[0] for members in GROUPS.values() for member in members[1:]},
}
"""The chamber that each vessel opens to."""
SPRINGS: Mapping[int, int] = {
    number: list(GROUPS).index(SPRING_FROM[key]) for number, key in enumerate(GROUPS) if SPRING_FROM[key] != key
}
"""The same for the great arteries, by the groups' numbers."""
_THICK_MM: Mapping[str, float] = {"left_atrium": 8.0, "right_atrium": 11.0}
"""Radius of the balls that reach the atrium's body, and its veins hardly."""
_BY_ATLAS, _BY_THICKNESS = {"left_atrium": (0.05, 0.02), "right_atrium": (0.03, 0.03)}, 4.0
"""How strongly (per mm of area and mm) the atlas's body and thickness draw; how far thickness counts, mm."""
_INSET_MM: Mapping[str, float] = {"left_atrium": 2.0, "right_atrium": 0.0}
"""How far within the atlas's body the veins' mouths are expected: its atria end where its veins are cut open."""
_REACH_MM = 8.0
_FEELERS_MM = 1.0
_OUTFLOW_MM, _BY_OUTFLOW = 3.0, 0.02
_WALL_STEEPNESS, _LEAST_DEAR = 30.0, 0.02
_STREAK_MM = 3.0
_APPENDAGE = 0.05
_LEAST_ML = {"left_atrium": 0.3, "right_atrium": 1.0}


def grouped(per_structure: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the distances (G, …) mm to the groups from those to each of STRUCTURES (S, …)."""
    return np.stack([per_structure[[STRUCTURES.index(key) for key in keys]].min(axis=0) for keys in GROUPS.values()])


def outflows(
    likely: npt.NDArray[np.float32],
    owner: npt.NDArray[np.integer[Any]],
    distances: npt.NDArray[np.float32],
    share: npt.NDArray[np.float32],
    grid: Grid,
) -> npt.NDArray[np.float32]:
    """Return the probabilities (G + 1, K, J, I) with what leads far out of a ventricle given to its great artery.

    owner (K, J, I): each voxel's group; share: of blood, darker in walls. Where a valve stands open, nothing but the
    atlas says where the ventricle ends: there it is cut where the cut is small. What bulges out widely stays.
    """
    out = likely.copy()
    keys = list(GROUPS)
    for artery, ventricle in (("aorta", "left_ventricle"), ("pulmonary_artery", "right_ventricle")):
        mine, its = keys.index(ventricle), keys.index(artery)
        both = (owner == mine) | (owner == its)
        if not (owner == mine).any():
            continue
        box = box_of(both)
        beyond = np.clip(distances[STRUCTURES.index(ventricle)][box] - _OUTFLOW_MM, -_REACH_MM, _REACH_MM)
        against = np.float32(_BY_OUTFLOW) * np.where(owner[box] == its, np.float32(_REACH_MM), beyond)
        dip = 1.0 - np.clip(ndimage.minimum_filter(share[box], size=2, origin=-1), 0.0, 1.0)
        dear = np.asarray(np.exp(-_WALL_STEEPNESS * dip**2) + _LEAST_DEAR, np.float32)
        kept = least_cut(both[box], against.astype(np.float32), float(grid.spacing_mm[0]), dear=dear)
        far = np.zeros_like(both)
        far[box] = both[box] & ~kept & (owner[box] == mine)
        out[its][far] = np.maximum(out[its][far], out[mine][far])
        out[mine][far] = 0.0
    return out


def split(
    group: npt.NDArray[np.bool_], key: str, distances: npt.NDArray[np.float32], grid: Grid
) -> dict[str, npt.NDArray[np.bool_]]:
    """Return the parts (K, J, I) of a group by structure.

    distances (S, K, J, I): of the fitted atlas's STRUCTURES. An atrium is parted from its veins by cuts of least area,
    drawn to where the fitted atlas has the mouths and to where it gets narrow. Veins and appendage are told apart in
    the same way; caval veins by going up or down.
    """
    members = GROUPS[key]
    parts = {member: np.zeros(group.shape, bool) for member in members}
    if len(members) == 1 or not group.any():
        parts[key] = group
        return parts
    margin = 3
    box = box_of(group)
    mask = np.pad(group[box], margin)
    near = [np.pad(distances[STRUCTURES.index(member)][box], margin, mode="edge") for member in members]
    spacing = float(grid.spacing_mm[0])
    body = _body(mask, key, near[0], spacing)
    vessels = _large(mask & ~body, _LEAST_ML[key] / grid.voxel_ml)
    if key == "left_atrium":
        drawn = _APPENDAGE * np.clip(near[2] - near[1], -_REACH_MM, _REACH_MM)
        second = _largest(least_cut(vessels, drawn, spacing)) if vessels.any() else vessels
    else:
        second = _below(vessels, body)
    inner = tuple(slice(margin, -margin) for _ in range(3))
    for member, part in zip(members, (mask & ~vessels, vessels & ~second, second), strict=True):
        parts[member][box] = part[inner]
    return parts


def _body(
    mask: npt.NDArray[np.bool_], key: str, outside: npt.NDArray[np.float32], spacing_mm: float
) -> npt.NDArray[np.bool_]:
    """Return the atrium without its veins. outside: distance mm to the atlas's, negative within it."""
    # Contrast that has not mixed yet leaves dark streaks in the right atrium: what is thick is judged without them.
    whole = mask | closed(mask, _STREAK_MM, spacing_mm) if key == "right_atrium" else mask
    middle = _THICK_MM[key]
    thickness = np.full(mask.shape, middle - _BY_THICKNESS, np.float32)
    depth = distance_within(whole, spacing_mm)
    for radius in np.arange(middle - _BY_THICKNESS + _FEELERS_MM, middle + _BY_THICKNESS + 0.5, _FEELERS_MM):
        centres = depth >= radius
        if centres.any():
            thickness[distance_to(centres, spacing_mm) < radius] = radius
    by_atlas, by_thickness = _BY_ATLAS[key]
    against = by_atlas * np.clip(outside + _INSET_MM[key], -_REACH_MM, _REACH_MM) + by_thickness * (middle - thickness)
    return _largest(least_cut(mask, against.astype(np.float32), spacing_mm))


def _below(vessels: npt.NDArray[np.bool_], body: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which of the caval veins' pieces lie lower than the body's middle."""
    pieces, count = ndimage.label(vessels)
    if not count or not body.any():
        return np.zeros_like(vessels)
    middle = np.nonzero(body)[0].mean()
    heights = np.arange(body.shape[0], dtype=np.float32)[:, None, None]
    means = ndimage.mean(np.broadcast_to(heights, body.shape), pieces, np.arange(1, count + 1))
    return np.isin(pieces, 1 + np.flatnonzero(means < middle))


def _large(mask: npt.NDArray[np.bool_], voxels: float) -> npt.NDArray[np.bool_]:
    """Return the mask's pieces of at least so many voxels."""
    pieces, _ = ndimage.label(mask)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.asarray(sizes[pieces] >= voxels) & mask


def _largest(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return the mask's largest piece."""
    pieces, count = ndimage.label(mask)
    if count < 2:
        return mask
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.asarray(pieces == sizes.argmax())
