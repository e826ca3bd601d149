"""The catalogue's keys by the many names that people and programs give to the parts of a heart."""

import re
from collections.abc import Mapping
from types import MappingProxyType

from cathxr.heart.anatomy import CATALOGUE

_SIDES = {"left": "l", "right": "r"}
_PARTS = {"ventricle": "v", "atrium": "a"}

_OTHERS = {
    "aorta": "ao aortic ascending_aorta thoracic_aorta aorta_ascendens aortic_root aorta_and_root",
    "pulmonary_artery": "pa pulmonary_arteries pulmonary_trunk main_pulmonary_artery truncus_pulmonalis mpa",
    "superior_vena_cava": "svc vena_cava_superior",
    "inferior_vena_cava": "ivc vena_cava_inferior",
    "pulmonary_veins": "pv pvs pulmonary_vein pulmonary_venous_system veins_pulmonary",
    "left_atrial_appendage": "laa atrial_appendage_left left_auricle left_auricular_appendage atrial_appendage",
    "myocardium": "myo lv_myocardium rv_myocardium left_ventricular_myocardium left_ventricle_myocardium septum "
    "lv_wall rv_wall la_wall ra_wall left_atrium_wall right_atrium_wall left_ventricle_wall right_ventricle_wall "
    "myocardium_left myocardium_lv lvm",
    "coronary_arteries": "coronaries coronary coronary_artery lca rca",
    "blood_pool": "bloodpool blood pool",
    "right_heart": "right_heart_blood_pool rh",
    "left_heart": "left_heart_blood_pool lh",
}
_CHAMBER_WORDS = "cavity blood blood_pool bloodpool bp endo endocardium lumen chamber"

_CODES = {
    "left_ventricle": "87878005 T-32600", "right_ventricle": "53085002 T-32500",
    "left_atrium": "82471001 T-32300", "right_atrium": "73829009 T-32200",
    "aorta": "15825003 T-42000", "pulmonary_artery": "81040000 T-44000",
    "superior_vena_cava": "48345005 T-48610", "inferior_vena_cava": "64131007 T-48710",
    "pulmonary_veins": "122972007", "left_atrial_appendage": "33626005",
    "myocardium": "74281007", "coronary_arteries": "41801008",
}  # fmt: skip


def _synonyms() -> dict[str, str]:
    table = {key: key for key in CATALOGUE}
    for side, side_letter in _SIDES.items():
        for part, part_letter in _PARTS.items():
            key, adjective = f"{side}_{part}", f"{side}_{'ventricular' if part == 'ventricle' else 'atrial'}"
            short = side_letter + part_letter
            stems = (key, adjective, short, f"{part}_{side}")
            table |= dict.fromkeys((short, f"{part}_{side}"), key)
            table |= {f"{stem}_{word}": key for stem in stems for word in _CHAMBER_WORDS.split()}
            table |= {f"{word}_{stem}": key for stem in stems for word in _CHAMBER_WORDS.split()}
    for key, words in _OTHERS.items():
        table |= dict.fromkeys(words.split(), key)
    return table


SYNONYMS: Mapping[str, str] = MappingProxyType(_synonyms())
CODES: Mapping[str, str] = MappingProxyType({code: key for key, codes in _CODES.items() for code in codes.split()})
"""SNOMED CT and SNOMED RT codes of structures."""

_WALL = re.compile(r"(.+)_wall")
_ENDINGS = re.compile(r"(\.nii|\.gz|\.nrrd|\.seg|\.stl|\.mha|\.ply)+$")
_AROUND = re.compile(
    r"^(\d+_)?(heart_|label_|segment_|seg_)?(.*?)(_mask|_label|_seg|_segmentation|_surface|_mesh|_\d+)?$"
)


def key_of(name: str) -> str | None:
    """Return the catalogue's key that a name means ("heart_ventricle_left.nii.gz", "LV cavity"), or None."""
    plain = _plain(name)
    if plain in SYNONYMS:
        return SYNONYMS[plain]
    match = _AROUND.match(plain)
    return SYNONYMS.get(match[3]) if match else None


def vessel_of_wall(name: str) -> str | None:
    """Return the vessel whose wall a name means ("aorta_wall"), whose inside is the vessel; None for anything else."""
    match = _WALL.fullmatch(_plain(name))
    key = key_of(match[1]) if match and key_of(name) is None else None
    return key if key in ("aorta", "pulmonary_artery", "superior_vena_cava", "inferior_vena_cava") else None


def _plain(name: str) -> str:
    """Return a name in lower case, without a file's ending, its words joined by _."""
    bare = _ENDINGS.sub("", name.strip().lower())
    return re.sub(r"[^a-z0-9]+", "_", bare).strip("_")
