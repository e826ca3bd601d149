"""What of a segmentation cannot be believed, said in sentences, and labelled as not separated."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.volume import Grid

_POOR_FIT = 0.16
_LEAST_ML: Mapping[str, float] = {
    "left_ventricle": 25.0,
    "right_ventricle": 25.0,
    "left_atrium": 12.0,
    "right_atrium": 15.0,
}
_WALLS = (("left_ventricle", "right_ventricle"), ("left_atrium", "right_atrium"), ("left_ventricle", "right_atrium"))
_VALVES = (
    ("left_atrium", "left_ventricle", "left_heart", 20.0),
    ("right_atrium", "right_ventricle", "right_heart", 30.0),
)
"""Atrium, ventricle, what both are together, and the area cm² that no annulus exceeds."""
_THROUGH_WALL_CM2 = 3.0
_NO_SEPTUM_CM2 = 12.0
"""The muscle between the ventricles is the thickest wall; where so much of it is missing, nothing can be believed."""
_OPEN_CM2 = 0.5
_SEEDS = "correct it with seeds (cathxr heart seeds)"


def judged(
    labels: npt.NDArray[np.uint8], grid: Grid, difference: float, seeded: Sequence[str] = ()
) -> tuple[npt.NDArray[np.uint8], tuple[str, ...]]:
    """Return the labels (K, J, I) with what could not be separated taken together, and the sentences that say so.

    difference: of the atlas and the scan's blood (0 to 1). seeded: structures that a person has seeded.
    """
    out = labels.copy()
    chambers = [key for key in _LEAST_ML if key not in seeded]
    areas = contacts(out, grid)
    unlike = difference > _POOR_FIT or _between(areas, "left_ventricle", "right_ventricle") > _NO_SEPTUM_CM2
    if unlike and len(chambers) == len(_LEAST_ML):
        heart = (out > 0) & (out <= CATALOGUE["left_atrial_appendage"].label)
        out[heart] = CATALOGUE["blood_pool"].label
        return out, (
            "The chambers could not be told apart: the scan's blood is not shaped like a heart that is known; "
            "give one seed for each chamber (cathxr heart seeds).",
        )
    findings = [*_separated(out, areas, seeded), *_valves(areas), *_missing(out, grid)]
    return out, tuple(findings)


def contacts(labels: npt.NDArray[np.uint8], grid: Grid) -> dict[tuple[int, int], float]:
    """Return the area cm² over which two labels (lower, higher) touch: voxel faces, two thirds of them for their slant.

    Faces of a slanting plane overstate its area by 1 to 1.73; on average over all directions by 1.5.
    """
    spacing = grid.spacing_mm[::-1]
    areas: dict[tuple[int, int], float] = {}
    for axis in range(3):
        low = labels[tuple(slice(None, -1) if each == axis else slice(None) for each in range(3))]
        high = labels[tuple(slice(1, None) if each == axis else slice(None) for each in range(3))]
        differ = (low != high) & (low > 0) & (high > 0)
        first, second = low[differ].astype(np.int64), high[differ].astype(np.int64)
        counts = np.bincount(np.minimum(first, second) * 256 + np.maximum(first, second), minlength=1)
        face = float(np.prod(np.delete(spacing, axis))) / 100.0 / 1.5
        for code in np.flatnonzero(counts):
            pair = (int(code) // 256, int(code) % 256)
            areas[pair] = areas.get(pair, 0.0) + float(counts[code]) * face
    return areas


def _separated(out: npt.NDArray[np.uint8], areas: Mapping[tuple[int, int], float], seeded: Sequence[str]) -> list[str]:
    """Take together, in place, chambers whose border cannot be right, and return the sentences."""
    sentences = []
    for first, second in _WALLS:
        touching = _between(areas, first, second)
        if touching > _THROUGH_WALL_CM2:
            sentences.append(
                f"Between {_name(first)} and {_name(second)} {touching:.0f} cm² show no wall; their border there is "
                f"where it is likely, not where it is seen: {_SEEDS}."
            )
    for atrium, ventricle, together, limit in _VALVES:
        touching = _between(areas, atrium, ventricle)
        if touching > limit and not {atrium, ventricle} & set(seeded):
            for key in (atrium, ventricle):
                out[out == CATALOGUE[key].label] = CATALOGUE[together].label
            sentences.append(
                f"{_name(atrium).capitalize()} and {_name(ventricle)} could not be separated: they touch over "
                f"{touching:.0f} cm², more than any valve; give a seed for each (cathxr heart seeds)."
            )
    return sentences


def _valves(areas: Mapping[tuple[int, int], float]) -> list[str]:
    """Return the sentence on valves whose leaflets the scan does not show."""
    unseen = [
        f"{name} ({_between(areas, first, second):.1f} cm²)"
        for name, first, second in (
            ("mitral", "left_atrium", "left_ventricle"),
            ("tricuspid", "right_atrium", "right_ventricle"),
            ("aortic", "aorta", "left_ventricle"),
            ("pulmonary", "pulmonary_artery", "right_ventricle"),
        )
        if _between(areas, first, second) > _OPEN_CM2
    ]
    if not unseen:
        return []
    return [
        f"No leaflets part the blood at these valves: {', '.join(unseen)}. The border there is laid where the blood is "
        "narrow near where a valve is expected; it is good to some millimetres, and the two volumes with it."
    ]


def _missing(out: npt.NDArray[np.uint8], grid: Grid) -> list[str]:
    """Return the sentences on structures that were not found, or only in part."""
    sizes = np.bincount(out.ravel(), minlength=256) * grid.voxel_ml
    together = {
        "left_ventricle": "left_heart", "left_atrium": "left_heart",
        "right_ventricle": "right_heart", "right_atrium": "right_heart",
    }  # fmt: skip
    small = [
        key
        for key, least in _LEAST_ML.items()
        if sizes[CATALOGUE[key].label] < least and not sizes[CATALOGUE[together[key]].label]
    ]
    sentences = [
        f"The {_name(key)} holds only {sizes[CATALOGUE[key].label]:.0f} mL of contrast-filled blood: the contrast has "
        f"not filled it, or it was taken for something else; {_SEEDS}, or use another phase."
        for key in small
    ]
    others = [key for key in CATALOGUE if key not in _LEAST_ML and CATALOGUE[key].label <= 10]
    if absent := [_name(key) for key in others if sizes[CATALOGUE[key].label] < 0.3]:
        sentences.append(f"Not found, for want of contrast or of extent: {', '.join(absent)}.")
    return sentences


def _between(areas: Mapping[tuple[int, int], float], first: str, second: str) -> float:
    """Return the area cm² over which two structures touch."""
    one, other = CATALOGUE[first].label, CATALOGUE[second].label
    return areas.get((min(one, other), max(one, other)), 0.0)


def _name(key: str) -> str:
    """Return the structure's name in the middle of a sentence."""
    return CATALOGUE[key].name.lower()
