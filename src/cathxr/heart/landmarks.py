"""Landmarks that labels of blood pools give: the ventricles' apices and the middles of the septa.

Not given, because blood pools do not show them: the fossa ovalis (the septum's thinnest part, which needs its wall) and
the coronary sinus's ostium.
"""

from collections.abc import Mapping

import numpy as np
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.boxes import Mask
from cathxr.heart.facing import bridged, common_box, cropped, facing_patches, where
from cathxr.heart.model import Landmark, Opening
from cathxr.heart.volume import LabelVolume

_ROUND_MM = 2
_APICES = (
    ("left_ventricle_apex", "Apex of the left ventricle", "left_ventricle", "mitral_valve"),
    ("right_ventricle_apex", "Apex of the right ventricle", "right_ventricle", "tricuspid_valve"),
)
_SEPTA = (
    (
        "interventricular_septum",
        "Middle of the interventricular septum",
        "left_ventricle",
        "right_ventricle",
        18.0,
        4.0,
    ),
    ("interatrial_septum", "Middle of the interatrial septum", "left_atrium", "right_atrium", 8.0, 2.0),
)
"""Key, name, the two sides, and how thick the septum may be, at most and beyond its thinnest part, mm."""
_LEAST_SEPTUM_MM = 8.0


def apices(labels: LabelVolume, masks: Mapping[str, Mask], openings: Mapping[str, Opening]) -> dict[str, Landmark]:
    """Return each ventricle's endocardial point that is farthest from its atrioventricular valve's centre."""
    found = {}
    for key, name, structure, valve in _APICES:
        if structure in masks and valve in openings:
            found[key] = Landmark(key, name, _farthest(masks[structure], labels, openings[valve].centroid_mm))
    return found


def septum_points(labels: LabelVolume, masks: Mapping[str, Mask]) -> dict[str, Landmark]:
    """Return the middle of each septum: the centre of the sheet halfway between the two pools that it parts."""
    found = {}
    for key, name, one, other, reach_mm, slack_mm in _SEPTA:
        if one not in masks or other not in masks:
            continue
        box = common_box(masks[one], masks[other], labels.grid, reach_mm)
        if box is None:
            continue
        grid, inner, outer = cropped(labels.grid, box), masks[one][box], masks[other][box]
        blood = [masks[each][box] for each in masks if each not in ("myocardium", one, other)]
        free = ~(inner | outer | np.logical_or.reduce([np.zeros_like(inner), *blood]))
        sides = bridged(inner, outer, free, grid, reach_mm=reach_mm, slack_mm=slack_mm)
        patches = facing_patches(*sides, grid)
        if patches and patches[0].diameter_mm >= _LEAST_SEPTUM_MM:
            # The sheet is bent, so that its centroid lies beside it: the sheet's own voxel nearest to that is taken.
            sheet = grid.to_ct(where(sides[0] & ndimage.binary_dilation(sides[1]))[:, ::-1])
            away = np.linalg.norm(sheet - patches[0].centroid_mm, axis=1)
            found[key] = Landmark(key, name, np.round(sheet[int(away.argmin())], _ROUND_MM))
    return found


def _farthest(mask: Mask, labels: LabelVolume, point_mm: FloatArray) -> FloatArray:
    """Return the mask's voxel centre (3,) that is farthest from a point, mm in `ct`."""
    voxels = where(mask & ~_inside(mask))[:, ::-1]
    points = labels.grid.to_ct(voxels)
    return np.asarray(np.round(points[int(np.linalg.norm(points - point_mm, axis=1).argmax())], _ROUND_MM))


def _inside(mask: Mask) -> Mask:
    """Return the mask's voxels (K, J, I) with all six neighbours in it."""
    inside = np.zeros_like(mask)
    core = mask[1:-1, 1:-1, 1:-1].copy()
    for axis in range(3):
        for at in (slice(None, -2), slice(2, None)):
            beside = [slice(1, -1)] * 3
            beside[axis] = at
            core &= mask[tuple(beside)]
    inside[1:-1, 1:-1, 1:-1] = core
    return inside
