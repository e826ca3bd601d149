"""The structures that a heart folder may name: key, name for people, label, colour."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Anatomy:
    """One structure of the catalogue. blood: whether it is blood that a catheter may be in, not tissue.

    label: its value in labels.nii.gz. colour: "#rrggbb", sRGB. opacity: how it is best shown from outside.
    """

    key: str
    name: str
    label: int
    colour: str
    opacity: float
    blood: bool = True


CATALOGUE: Mapping[str, Anatomy] = MappingProxyType(
    {
        each.key: each
        for each in (
            Anatomy("left_ventricle", "Left ventricle", 1, "#bf3a3a", 0.4),
            Anatomy("right_ventricle", "Right ventricle", 2, "#3f6fc4", 0.35),
            Anatomy("left_atrium", "Left atrium", 3, "#e8917c", 0.4),
            Anatomy("right_atrium", "Right atrium", 4, "#5fb0d0", 0.3),
            Anatomy("aorta", "Aorta", 5, "#e0564f", 0.5),
            Anatomy("pulmonary_artery", "Pulmonary artery", 6, "#7f86d9", 0.5),
            Anatomy("superior_vena_cava", "Superior vena cava", 7, "#4a8fbf", 0.4),
            Anatomy("inferior_vena_cava", "Inferior vena cava", 8, "#3c7fae", 0.4),
            Anatomy("pulmonary_veins", "Pulmonary veins", 9, "#f0a898", 0.4),
            Anatomy("left_atrial_appendage", "Left atrial appendage", 10, "#d97b6c", 0.4),
            Anatomy("myocardium", "Myocardium", 11, "#a8645a", 0.25, blood=False),
            Anatomy("coronary_arteries", "Coronary arteries", 12, "#f2c14e", 0.8),
            Anatomy("blood_pool", "Blood pool, not separated", 13, "#c05a6a", 0.35),
            Anatomy("right_heart", "Right heart, not separated", 14, "#4f88c8", 0.35),
            Anatomy("left_heart", "Left heart, not separated", 15, "#cf5f55", 0.35),
        )
    }
)
"""Every structure by its key."""
