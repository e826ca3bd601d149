"""The openings and landmarks of a label volume: valves and vessels' mouths, as far as the labels give them.

A valve is where two pools of blood touch, or face each other across a thin gap. A vessel's mouth is, in this order:
where it touches its chamber; where the volume's boundary cuts it; where the chamber's wall leaves it bare; or the end
of a tube that sticks out of the chamber. The coronary sinus's ostium and the fossa ovalis are not given: labels of
blood say nothing about either.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from cathxr.core import FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.boxes import Mask, box_around
from cathxr.heart.facing import (
    Patch,
    boundary_patches,
    bridged,
    common_box,
    cropped,
    facing_patches,
)
from cathxr.heart.landmarks import apices, septum_points
from cathxr.heart.model import Landmark, Opening
from cathxr.heart.mouths import Mouth
from cathxr.heart.vessel_mouths import caval_mouths, pulmonary_mouths
from cathxr.heart.volume import Grid, LabelVolume, Volume

REACH_MM = 6.0
"""Across how wide a gap two pools still share a valve: leaflets are not blood, and drawn rims lie inside the ring."""
SLACK_MM = 2.5
_LEAST_FLATNESS = 0.45
_CUT_MM2 = 20.0
_JUNCTION_RATIO = 1.6
_ROUND_MM = 2
_FINEST_MM = 1.0


@dataclass(frozen=True)
class Kind:
    """One opening: its name, the structure that it is a hole of, what is beyond, and diameters that make sense."""

    key: str
    name: str
    structure: str
    beyond: str
    least_mm: float
    most_mm: float


KINDS = (
    Kind("mitral_valve", "Mitral valve", "left_ventricle", "left_atrium", 12.0, 60.0),
    Kind("tricuspid_valve", "Tricuspid valve", "right_ventricle", "right_atrium", 12.0, 65.0),
    Kind("aortic_valve", "Aortic valve", "left_ventricle", "aorta", 8.0, 45.0),
    Kind("pulmonary_valve", "Pulmonary valve", "right_ventricle", "pulmonary_artery", 8.0, 50.0),
    Kind("superior_vena_cava", "Superior vena cava", "right_atrium", "superior_vena_cava", 6.0, 45.0),
    Kind("inferior_vena_cava", "Inferior vena cava", "right_atrium", "inferior_vena_cava", 6.0, 50.0),
    Kind("left_atrial_appendage", "Left atrial appendage", "left_atrium", "left_atrial_appendage", 4.0, 40.0),
)
"""What is found by two labels that meet. Diameters are generous: they tell a valve from a spot or a whole wall."""

VESSELS = ("aorta", "pulmonary_artery", "superior_vena_cava", "inferior_vena_cava", "pulmonary_veins")


@dataclass(frozen=True, eq=False)
class Places:
    """What was found. findings: a sentence for each opening that was looked for and not found, or is doubtful."""

    openings: dict[str, Opening] = field(default_factory=dict)
    landmarks: dict[str, Landmark] = field(default_factory=dict)
    findings: tuple[str, ...] = ()


def find_openings(
    labels: LabelVolume, *, volume: Volume | None = None
) -> tuple[dict[str, Opening], dict[str, Landmark]]:
    """Return the openings and the landmarks by key, `find_places` without its findings."""
    places = find_places(labels, volume=volume)
    return places.openings, places.landmarks


def find_places(labels: LabelVolume, *, volume: Volume | None = None) -> Places:
    """Return the openings, the landmarks, and what could not be found, mm in `ct`.

    The same labels give the same places. volume: the CT that the labels were made from, if there is one: it tells a
    vein, which goes on, from an appendage, which ends.
    """
    labels = _worked_on(labels)
    masks = {key: labels.mask(key) for key in sorted(set(labels.names.values()))}
    masks = {key: mask for key, mask in masks.items() if mask.any()}
    found: dict[str, Opening] = {}
    findings: list[str] = []
    for kind in KINDS:
        if kind.structure in masks and kind.beyond in masks:
            patch = _meeting(masks[kind.structure], masks[kind.beyond], labels)
            _take(kind, patch, found, findings)
    mouths = caval_mouths(labels, masks, known=set(found), volume=volume)
    mouths |= pulmonary_mouths(labels, masks, known=set(found), volume=volume)
    for key, (structure, mouth) in mouths.items():
        found[key] = _opening(key, key.replace("_", " ").capitalize(), structure, mouth.end)
    findings += _missing(masks, found) + _guessed(mouths)
    ends, cut_findings = _cuts(labels, masks, found)
    found |= ends
    landmarks = apices(labels, masks, found) | septum_points(labels, masks) | _junctions(mouths)
    return Places(found, {key: each for key, each in landmarks.items() if key not in found}, (*findings, *cut_findings))


def _worked_on(labels: LabelVolume) -> LabelVolume:
    """Return the labels' part of the volume, thinned out to voxels of 1 mm at most: a mouth needs no finer ones.

    Some empty voxels are kept around it, but where a label reaches the volume's boundary, so does the part.
    """
    steps = [max(int(_FINEST_MM / each), 1) for each in labels.grid.spacing_mm[::-1]]
    box = box_around(labels.labels, max(steps))
    if box is None:
        return labels
    near = cropped(labels.grid, box)
    thin = labels.labels[box][:: steps[0], :: steps[1], :: steps[2]]
    matrix = near.ct_from_voxel.copy()
    matrix[:3, :3] *= np.array(steps[::-1])
    grid = Grid((thin.shape[0], thin.shape[1], thin.shape[2]), matrix)
    return LabelVolume(np.ascontiguousarray(thin), grid, labels.names)


def _meeting(inner: Mask, outer: Mask, labels: LabelVolume) -> Patch | None:
    """Return the largest patch where two masks touch, or where they face each other across a gap."""
    box = common_box(inner, outer, labels.grid, REACH_MM)
    if box is None:
        return None
    grid, inner, outer = cropped(labels.grid, box), inner[box], outer[box]
    touching = facing_patches(inner, outer, grid)
    # A few voxels that touch beside a gap are no valve: the patch has to be as large as the smallest one.
    if touching and touching[0].diameter_mm >= 8.0:
        return touching[0]
    free = labels.labels[box] == 0
    across = facing_patches(*bridged(inner, outer, free, grid, reach_mm=REACH_MM, slack_mm=SLACK_MM), grid)
    return next(iter(across), None)


def _take(kind: Kind, patch: Patch | None, found: dict[str, Opening], findings: list[str]) -> None:
    """Put the opening among the found ones where it is one; else say why not."""
    between = f"between {CATALOGUE[kind.structure].name.lower()} and {CATALOGUE[kind.beyond].name.lower()}"
    if patch is None:
        findings.append(f"{kind.name}: nothing was found {between}; they lie more than {REACH_MM:.0f} mm apart.")
    elif not kind.least_mm <= patch.diameter_mm <= kind.most_mm:
        findings.append(
            f"{kind.name}: the contact {between} measures {patch.diameter_mm:.1f} mm across, which no such opening "
            f"does ({kind.least_mm:.0f} to {kind.most_mm:.0f} mm); it was left out. Correct the labels there."
        )
    else:
        found[kind.key] = _opening(kind.key, kind.name, kind.structure, patch)
        if patch.flatness < _LEAST_FLATNESS:
            findings.append(f"{kind.name}: the contact {between} is far from flat; take its centre with care.")


def _opening(key: str, name: str, structure: str, patch: Patch) -> Opening:
    """Return the opening that a patch is."""
    centre = np.round(patch.centroid_mm, _ROUND_MM)
    return Opening(key, name, structure, centre, patch.normal, round(patch.diameter_mm, 1))


def _missing(masks: dict[str, Mask], found: Iterable[str]) -> list[str]:
    """Return a sentence for each vessel's mouth that a chamber must have and that was not found."""
    lines = []
    for key, chamber in (
        ("superior_vena_cava", "right_atrium"),
        ("inferior_vena_cava", "right_atrium"),
    ):
        if chamber in masks and key not in masks and key not in found:
            lines.append(
                f"{CATALOGUE[key].name}: it has no label, and no tube or cut end of the right atrium shows where it "
                "is; give a seed or a label for it."
            )
    veins = sum("pulmonary_vein" in key for key in found)
    if "left_atrium" in masks and veins < 4:
        lines.append(f"Pulmonary veins: {veins} of the usual 4 mouths were found at the left atrium.")
    return lines


def _guessed(mouths: dict[str, tuple[str, Mouth]]) -> list[str]:
    """Return a sentence for each vena cava's mouth that only the right atrium's shape tells."""
    return [
        f"{CATALOGUE[key].name}: it has no label of its own; its mouth was taken where the right atrium {way} in a "
        "tube. Check it, or give a seed or a label for the vein: a placement without landmarks rests on it."
        for key, way in (("superior_vena_cava", "ends upwards"), ("inferior_vena_cava", "ends downwards"))
        if key in mouths and mouths[key][1].length_mm > 0.0
    ]


def _cuts(
    labels: LabelVolume, masks: dict[str, Mask], found: dict[str, Opening]
) -> tuple[dict[str, Opening], list[str]]:
    """Return the ends of vessels that the volume's boundary cuts, and a sentence for each chamber that it cuts."""
    ends: dict[str, Opening] = {}
    findings = []
    for key, mask in masks.items():
        anatomy = CATALOGUE.get(key)
        if anatomy is None or not anatomy.blood:
            continue
        patches = boundary_patches(mask, labels.grid, least_mm2=_CUT_MM2)
        if key in VESSELS:
            for number, patch in enumerate(sorted(patches, key=lambda each: -float(each.centroid_mm[2])), start=1):
                suffix = f"_end_{number}" if len(patches) > 1 else "_end"
                name = f"{anatomy.name}, cut by the volume's boundary" + (f" ({number})" if len(patches) > 1 else "")
                ends[key + suffix] = _opening(key + suffix, name, key, patch)
        elif patches and not _explained(patches, key, found):
            findings.append(f"{anatomy.name}: the volume's boundary cuts through it, so that its volume is too small.")
    return ends, findings


def _explained(patches: list[Patch], structure: str, found: dict[str, Opening]) -> bool:
    """Return whether every patch is one of the structure's openings already."""
    centres: list[FloatArray] = [each.centroid_mm for each in found.values() if each.structure == structure]
    return all(any(np.linalg.norm(each.centroid_mm - centre) < 2.0 for centre in centres) for each in patches)


def _junctions(mouths: dict[str, tuple[str, Mouth]]) -> dict[str, Landmark]:
    """Return where each vessel that is part of a chamber's label leaves the chamber's body."""
    landmarks = {}
    for key, (_, mouth) in mouths.items():
        # Where the body's rind came along with the tube, the junction's place says nothing.
        if mouth.junction is not None and mouth.junction.diameter_mm < _JUNCTION_RATIO * mouth.end.diameter_mm:
            name = f"{key.replace('_', ' ').capitalize()}, junction"
            landmarks[f"{key}_junction"] = Landmark(
                f"{key}_junction", name, np.round(mouth.junction.centroid_mm, _ROUND_MM)
            )
    return landmarks
