"""Which of a chamber's mouths is which vessel's: venae cavae by height, pulmonary veins by side and height."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.away import away_from
from cathxr.heart.boxes import Mask, box_around
from cathxr.heart.facing import Patch, boundary_patches, bridged, common_box, cropped, facing_patches
from cathxr.heart.mouths import Mouth, bare_patches, tubes
from cathxr.heart.volume import Grid, LabelVolume, Volume

_CAVAL_MM = (8.0, 45.0)
_VEIN_MM = (5.0, 32.0)
_RISE = 0.35
"""A vena cava's mouth looks up or down: the z of its normal is at least this."""
_LEAST_COVER = 0.6
_LEAST_BARE_MM2 = 40.0
_LEAST_CONTACT_MM2 = 15.0
_VALVE_RING_MM = 8.0
_ANTERIOR = 0.5
_BEFORE_MM = 8.0
"""The venae cavae enter at the back of the atrium: at most this far before its middle. The auricle lies farther."""
_TOWARDS_SIDE = 0.2
"""A vein's mouth looks to its own side or backwards: the larger of the two components is at least this."""
_DOWN = 0.7
_BLOOD_SHARE = 0.6
_BEYOND_MM = 12.0

Found = dict[str, tuple[str, Mouth]]
"""By the opening's key: the structure that it is a hole of, and the mouth."""


def caval_mouths(
    labels: LabelVolume, masks: Mapping[str, Mask], *, known: set[str], volume: Volume | None = None
) -> Found:
    """Return the mouths of the venae cavae in the right atrium that have no label of their own and are not `known`.

    The superior one is the highest mouth that looks up, the inferior one the lowest that looks down.
    """
    atrium = masks.get("right_atrium")
    if atrium is None:
        return {}
    wanted = {
        key: rise
        for key, rise in (("superior_vena_cava", 1.0), ("inferior_vena_cava", -1.0))
        if key not in masks and key not in known
    }
    middle = _middle(atrium, labels)
    sources: Sequence[Callable[[], list[Mouth]]] = (
        lambda: [Mouth(each) for each in boundary_patches(atrium, labels.grid, least_mm2=_LEAST_BARE_MM2)],
        lambda: _bare(labels, masks, "right_atrium", "right_ventricle"),
        lambda: _bright(labels, atrium, volume),
        lambda: tubes(atrium, labels.grid),
    )
    found: Found = {}
    for source in sources:
        if len(found) == len(wanted):
            break
        mouths = [each for each in source() if _CAVAL_MM[0] <= each.end.diameter_mm <= _CAVAL_MM[1]]
        for key, rise in wanted.items():
            facing = [
                each
                for each in mouths
                if each.end.normal[2] * rise >= _RISE
                and (each.end.centroid_mm[2] - middle[2]) * rise > 0.0
                and _root(each)[1] > middle[1] - _BEFORE_MM
            ]
            if key not in found and facing:
                found[key] = ("right_atrium", max(facing, key=lambda each: float(each.end.centroid_mm[2]) * rise))
    return found


def pulmonary_mouths(
    labels: LabelVolume, masks: Mapping[str, Mask], *, known: set[str], volume: Volume | None = None
) -> Found:
    """Return the mouths of the pulmonary veins, and of the left atrial appendage where it is not `known`."""
    atrium = masks.get("left_atrium")
    if atrium is None:
        return {}
    if "pulmonary_veins" in masks:
        mouths = _contacts(labels, atrium, masks["pulmonary_veins"])
    else:
        mouths = _bare(labels, masks, "left_atrium", "left_ventricle")
        if len(mouths) < 2:
            mouths = tubes(atrium, labels.grid)
    mouths = [each for each in mouths if _VEIN_MM[0] <= each.end.diameter_mm <= _VEIN_MM[1]]
    middle = _middle(atrium, labels)
    left = [each for each in mouths if _root(each)[0] > middle[0] and _looks_out(each, 1.0)]
    right = [each for each in mouths if _root(each)[0] <= middle[0] and _looks_out(each, -1.0)]
    found: Found = {}
    if "left_atrial_appendage" not in known and "pulmonary_veins" not in masks:
        appendage = _appendage(left, volume)
        if appendage is not None:
            left.remove(appendage)
            found["left_atrial_appendage"] = ("left_atrium", appendage)
    for side, group in (("left", left), ("right", right)):
        found |= {key: ("left_atrium", mouth) for key, mouth in _by_height(side, group).items()}
    return found


def _by_height(side: str, mouths: list[Mouth]) -> dict[str, Mouth]:
    """Return one side's mouths by key: the largest three at most, named from above."""
    largest = sorted(mouths, key=lambda each: -each.end.area_mm2)[:3]
    ordered = sorted(largest, key=lambda each: -float(_root(each)[2]))
    names = {1: ("",), 2: ("superior_", "inferior_"), 3: ("superior_", "middle_", "inferior_")}.get(len(ordered), ())
    return {f"{side}_{name}pulmonary_vein": mouth for name, mouth in zip(names, ordered, strict=True)}


def _appendage(left: list[Mouth], volume: Volume | None) -> Mouth | None:
    """Return which of the left mouths is the appendage's, if any.

    The appendage lies before and beside the left veins: it is the most anterior and leftmost of three mouths or more,
    or one that looks clearly forwards. A CT settles doubts: beyond a vein's end there is blood, not so beyond its.
    """
    if not left:
        return None
    first = max(left, key=lambda each: float(_root(each)[0] - _root(each)[1]))
    forwards = float(-first.end.normal[1]) > _ANTERIOR
    if volume is not None and first.junction is not None and _goes_on(first.end, volume):
        return None
    return first if len(left) >= 3 or forwards else None


def _goes_on(end: Patch, volume: Volume) -> bool:
    """Return whether the CT shows blood as bright beyond an end as before it."""
    steps = np.array([-6.0, -4.0, 2.0, 4.0, 6.0])
    points = volume.grid.to_voxel(end.centroid_mm + steps[:, None] * end.normal)
    hu = ndimage.map_coordinates(volume.hu, points[:, ::-1].T, order=1, mode="nearest", output=np.float64)
    return float(np.median(hu[2:])) > _BLOOD_SHARE * float(np.mean(hu[:2]))


def _contacts(labels: LabelVolume, chamber: Mask, vessel: Mask) -> list[Mouth]:
    """Return every patch where the chamber and a vessel's label meet; across a thin gap where they touch nowhere."""
    box = common_box(chamber, vessel, labels.grid, 3.0)
    if box is None:
        return []
    grid, inner, outer = cropped(labels.grid, box), chamber[box], vessel[box]
    patches = facing_patches(inner, outer, grid, least_mm2=_LEAST_CONTACT_MM2)
    if not patches:
        free = labels.labels[box] == 0
        inner, outer = bridged(inner, outer, free, grid, reach_mm=3.0, slack_mm=1.5)
        patches = facing_patches(inner, outer, grid, least_mm2=_LEAST_CONTACT_MM2)
    return [Mouth(each) for each in patches]


def _bare(labels: LabelVolume, masks: Mapping[str, Mask], chamber: str, ventricle: str) -> list[Mouth]:
    """Return the mouths that the wall of a chamber leaves bare, away from its valve; none if the wall is unknown."""
    wall = masks.get("myocardium")
    if wall is None:
        return []
    covered = labels.labels != 0
    covered &= ~masks[chamber]
    below = masks.get(ventricle)
    if below is not None:
        box = common_box(masks[chamber], below, labels.grid, _VALVE_RING_MM)
        if box is not None:
            away = away_from(below[box], labels.grid.spacing_mm[::-1])
            covered[box] |= (away <= _VALVE_RING_MM) & ~masks[chamber][box]
    patches = bare_patches(masks[chamber], covered, labels.grid, least_mm2=_LEAST_BARE_MM2, least_cover=_LEAST_COVER)
    return [Mouth(each) for each in patches]


def _looks_out(mouth: Mouth, side: float) -> bool:
    """Return whether a mouth may be a vein's: it looks to its side (1: left, -1: right) or backwards, and not down."""
    normal = mouth.end.normal
    return bool(max(side * normal[0], normal[1]) >= _TOWARDS_SIDE and normal[2] > -_DOWN)


def _bright(labels: LabelVolume, chamber: Mask, volume: Volume | None) -> list[Mouth]:
    """Return where a chamber's label ends though the CT shows blood that goes on, as wide as a vessel."""
    box = box_around(chamber, round(_BEYOND_MM / float(labels.grid.spacing_mm.min())))
    if volume is None or box is None:
        return []
    grid, inner = cropped(labels.grid, box), chamber[box]
    hu = hu_on(volume, grid)
    level = _BLOOD_SHARE * float(np.median(hu[inner]))
    bright = (hu > level) & (labels.labels[box] == 0)
    # Only where a ball of the least vessel's size fits in: partial volumes make every pool's rim a little bright.
    room = away_from(~(bright | inner), grid.spacing_mm[::-1]) > _CAVAL_MM[0] / 2.0
    wide = away_from(room & bright, grid.spacing_mm[::-1]) <= _CAVAL_MM[0] / 2.0
    return [Mouth(each) for each in facing_patches(inner, bright & wide, grid, least_mm2=_LEAST_BARE_MM2)]


def hu_on(volume: Volume, grid: Grid) -> npt.NDArray[np.int16]:
    """Return the CT numbers (K, J, I) at the voxels of a grid that is a part of the volume's, thinned out or not."""
    first = volume.grid.to_voxel(grid.to_ct([0.0, 0.0, 0.0]))
    steps = grid.spacing_mm / volume.grid.spacing_mm
    i, j, k = (
        np.clip(np.round(first[at] + steps[at] * np.arange(grid.shape[2 - at])), 0, volume.grid.shape[2 - at] - 1)
        for at in range(3)
    )
    return np.asarray(volume.hu[np.ix_(k.astype(int), j.astype(int), i.astype(int))])


def _root(mouth: Mouth) -> FloatArray:
    """Return where the mouth is at the chamber (3,), mm: its junction, or the hole itself."""
    return mouth.end.centroid_mm if mouth.junction is None else mouth.junction.centroid_mm


def _middle(mask: Mask, labels: LabelVolume) -> FloatArray:
    """Return the centroid (3,) of a mask, mm in `ct`."""
    weights = [np.count_nonzero(mask, axis=tuple(each for each in range(3) if each != axis)) for axis in (2, 1, 0)]
    ijk = [float((each * np.arange(len(each))).sum() / each.sum()) for each in weights]
    return labels.grid.to_ct(ijk)
