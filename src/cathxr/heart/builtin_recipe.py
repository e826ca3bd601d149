"""What the built-in heart is made of: labels, walls and openings from the STL surfaces of `heart_rodero01`."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from cathxr.core import DataError, FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.boxes import Box, Mask
from cathxr.heart.facing import bridged, common_box, cropped
from cathxr.heart.lumen import lumen
from cathxr.heart.model import HeartSource, Opening
from cathxr.heart.openings import Places, find_places
from cathxr.heart.rasterise import inside, upright_grid
from cathxr.heart.surface import IndexArray, Surface, open_at, read_stl, rim_edges
from cathxr.heart.tubes import carried_on, end_of
from cathxr.heart.volume import Grid, LabelVolume, Progress, silent

NAME = "Built-in heart: a healthy adult, four chambers, end diastole"
SPACING_MM = 0.7
BUDGET = 40_000
ACOUSTIC_SIZE = 112
SOURCE = HeartSource(
    title="rodero_01_fullheart_1.5mm.vtu, distributed with ansys-health-heart 0.16.2",
    authors="Rodero et al., Linking statistical shape models and simulated function in the healthy adult human heart, "
    "PLoS Computational Biology 2021; mesh preparation: ANSYS, Inc. and affiliates",
    url="https://doi.org/10.5281/zenodo.4590294",
    licence="CC BY 4.0 (cohort), MIT (ansys-health-heart)",
    licence_url="https://creativecommons.org/licenses/by/4.0/",
    changes="Closed blood pools and the great vessels' lumens made into voxels of 0.7 mm; atria and ventricles grown "
    "towards each other until they meet in the mitral and the tricuspid plane (less than 1 % of each volume), where "
    "the source leaves a gap of 1 to 5 mm; the venae cavae's rims, which are bent in the source, made flat, and both "
    "veins carried on from there as straight tubes of 35 and 20 mm, which the source does not have; surfaces taken "
    "from the voxels, smoothed, simplified, coloured, converted to glTF; acoustic volume made from the pools and the "
    "source's walls.",
)

_MARGIN_MM = 3.0
_GAP_MM = 5.0
_SLACK_MM = 2.0
_SKIRT_VOXELS = 2.3
_LEVELLED = ("superior_vena_cava", "inferior_vena_cava")
_TUBES_MM = {"inferior_vena_cava": 35.0, "superior_vena_cava": 20.0}
"""How far the caval veins are carried on: the source ends at their mouths, and a catheter comes through them."""
_LEVEL_MM, _LEVEL_OVER, _LEVEL_UNDER = 5.0, 0.75, 0.47
"""How far from its plane a mouth is made flat, and how far from its centre, in diameters, above and below the plane."""
_CHAMBERS = {
    "left_ventricle": "lv_cavity.stl",
    "right_ventricle": "rv_cavity.stl",
    "left_atrium": "la_cavity.stl",
    "right_atrium": "ra_cavity.stl",
}
_WALLS = ("lv_myocardium.stl", "rv_myocardium.stl", "la_wall.stl", "ra_wall.stl", "septum.stl")
_VALVES = (("left_ventricle", "left_atrium"), ("right_ventricle", "right_atrium"))
_MOUTHS = {
    "aortic_valve": ("left_ventricle", "aortic-valve"),
    "pulmonary_valve": ("right_ventricle", "pulmonary-valve"),
    "right_superior_pulmonary_vein": ("left_atrium", "right-superior-pulmonary-vein"),
    "right_inferior_pulmonary_vein": ("left_atrium", "right-inferior-pulmonary-vein"),
    "left_superior_pulmonary_vein": ("left_atrium", "left-superior-pulmonary-vein"),
    "left_inferior_pulmonary_vein": ("left_atrium", "left-inferior-pulmonary-vein"),
    "left_atrial_appendage": ("left_atrium", "left-atrium-appendage"),
    "superior_vena_cava": ("right_atrium", "superior-vena-cava"),
    "inferior_vena_cava": ("right_atrium", "inferior-vena-cava"),
}
"""Opening → structure, and its name in caps.json. The atrioventricular valves are where the grown pools meet."""


@dataclass(frozen=True)
class _Vessel:
    """How a vessel's lumen is found in its wall, see `lumen`. valve: the opening that it begins at."""

    stl: str
    valve: str
    straight_mm: float
    rings: int


_VESSELS = {
    "aorta": _Vessel("aorta_wall.stl", "aortic_valve", 33.0, 16),
    "pulmonary_artery": _Vessel("pulmonary_artery_wall.stl", "pulmonary_valve", 8.0, 8),
}


@dataclass(frozen=True, eq=False)
class Ingredients:
    """What the pipeline makes the built-in heart of. labels: blood. walled: the same, and the walls as myocardium."""

    labels: LabelVolume
    walled: LabelVolume
    places: Places


def ingredients(source: Path, *, spacing_mm: float = SPACING_MM, progress: Progress = silent) -> Ingredients:
    """Return labels, walls and openings made from the folder of STL surfaces and caps.json.

    Raises:
        DataError: a file is missing or damaged.
    """
    caps = _caps(source)
    pools = {key: read_stl(source / stl) for key, stl in _CHAMBERS.items()}
    mouths = {key: _mouth(key, structure, pools[structure], caps, cap) for key, (structure, cap) in _MOUTHS.items()}
    tubes = {key: _tube(source, vessel, mouths[vessel.valve]) for key, vessel in _VESSELS.items()}
    walls = [read_stl(source / stl) for stl in _WALLS]
    veins = _caval_ends(mouths)
    corners = np.concatenate(
        [each.vertices_mm for each in (*walls, *tubes.values())] + [_around(each) for each in veins]
    )
    grid = upright_grid(corners.min(axis=0) - _MARGIN_MM, corners.max(axis=0) + _MARGIN_MM, spacing_mm)
    progress("Making voxels of the surfaces", 0.0)
    masks = {key: inside(pool, grid) for key, pool in pools.items()}
    for key in _LEVELLED:
        _level(masks[mouths[key].structure], mouths[key], grid)
    for one, other in _VALVES:
        _meet(masks, one, other, grid)
    chambers = np.logical_or.reduce(list(masks.values()))
    masks |= {key: inside(_closed(tube), grid) & ~chambers for key, tube in tubes.items()}
    for key, vessel in _VESSELS.items():
        _reach(masks, key, mouths[vessel.valve].structure, grid)
    for end in veins:
        mouth = mouths[end.structure]
        tube = carried_on(mouth, _direction(mouth, end), _TUBES_MM[end.structure], grid)
        masks[end.structure] = tube & ~np.logical_or.reduce(list(masks.values()))
    labels = _labelled(masks, grid)
    wall = np.logical_or.reduce([inside(each, grid) for each in walls])
    walled = _labelled(masks | {"myocardium": wall & (labels.labels == 0)}, grid)
    progress("Looking for valves and vessels' mouths", 0.6)
    found = find_places(walled)
    ends = {f"{key}_end": _end(key, tube) for key, tube in tubes.items()} | {each.key: each for each in veins}
    openings = {key: each for key, each in found.openings.items() if key in ("mitral_valve", "tricuspid_valve")}
    return Ingredients(labels, walled, Places(openings | mouths | ends, dict(found.landmarks), found.findings))


def _caps(source: Path) -> dict[str, dict[str, object]]:
    """Return caps.json: for each opening its centroid, area and equivalent diameter."""
    path = source / "caps.json"
    try:
        content: dict[str, dict[str, object]] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror}); give the folder of STL surfaces.") from error
    except ValueError as error:
        raise DataError(f"{path} is not JSON ({error}); copy it again.") from error
    return content


def _mouth(key: str, structure: str, pool: Surface, caps: Mapping[str, Mapping[str, object]], cap: str) -> Opening:
    """Return a mouth from its entry in caps.json; its normal is that of the triangles that close it."""
    if cap not in caps:
        raise DataError(f"caps.json has no opening {cap!r}; copy it again.")
    centre = np.array(caps[cap]["centroid_mm"], dtype=np.float64)
    normal = open_at(pool, centre)[1]
    return Opening(
        key, key.replace("_", " ").capitalize(), structure, centre, normal, float(str(caps[cap]["eq_diameter_mm"]))
    )


def _tube(source: Path, vessel: _Vessel, valve: Opening) -> Surface:
    """Return a vessel's lumen, open at both ends; the last ring of vertices is the far one."""
    return lumen(
        read_stl(source / vessel.stl),
        valve.centroid_mm,
        valve.normal,
        straight_mm=vessel.straight_mm,
        rings=vessel.rings,
    )


def _rims(tube: Surface) -> tuple[IndexArray, IndexArray]:
    """Return the edges (E, 2) of a tube's first and last ring, as indices."""
    edges = rim_edges(tube)
    first = edges[:, 0] < len(tube.vertices_mm) // 2
    return edges[first], edges[~first]


def _closed(tube: Surface) -> Surface:
    """Return the tube closed at both ends by fans."""
    vertices, triangles = [tube.vertices_mm], [tube.triangles]
    for number, rim in enumerate(_rims(tube)):
        vertices.append(tube.vertices_mm[np.unique(rim)].mean(axis=0)[None])
        hub = np.full(len(rim), len(tube.vertices_mm) + number)
        triangles.append(np.stack([rim[:, 1], rim[:, 0], hub], axis=1))
    return Surface(np.concatenate(vertices), np.concatenate(triangles).astype(np.int64))


def _end(key: str, tube: Surface) -> Opening:
    """Return the far end of a vessel's stub: the fan over its last ring."""
    rim = _rims(tube)[1]
    centre = tube.vertices_mm[np.unique(rim)].mean(axis=0)
    arms = tube.vertices_mm[rim] - centre
    area = np.cross(arms[:, 1], arms[:, 0]).sum(axis=0) / 2.0
    size = float(np.linalg.norm(area))
    diameter = round(float(np.sqrt(4.0 * size / np.pi)), 1)
    return Opening(
        f"{key}_end", f"{CATALOGUE[key].name}, end of the stub", key, np.round(centre, 2), area / size, diameter
    )


def _caval_ends(mouths: Mapping[str, Opening]) -> list[Opening]:
    """Return the far ends of the caval veins, which go on along the line through both mouths, as the catheter does."""
    below, above = (mouths[key] for key in _TUBES_MM)
    axis = (above.centroid_mm - below.centroid_mm) / np.linalg.norm(above.centroid_mm - below.centroid_mm)
    return [
        end_of(mouth, mouth.key, mouth.name, way * axis, _TUBES_MM[mouth.key])
        for mouth, way in ((below, -1.0), (above, 1.0))
    ]


def _direction(mouth: Opening, end: Opening) -> FloatArray:
    away = end.centroid_mm - mouth.centroid_mm
    return np.asarray(away / np.linalg.norm(away))


def _around(opening: Opening) -> FloatArray:
    """Return the corners (2, 3) mm of a block that holds an opening."""
    reach = 0.5 * opening.diameter_mm
    return np.asarray(opening.centroid_mm + np.array([[-reach] * 3, [reach] * 3]))


def _meet(masks: dict[str, Mask], one: str, other: str, grid: Grid) -> None:
    """Grow two pools towards each other, through voxels of nothing, until they meet in their valve's plane."""
    box, grown = _grown(masks, one, other, grid)
    for key, mask in zip((one, other), grown, strict=True):
        masks[key][box] = mask


def _level(mask: Mask, mouth: Opening, grid: Grid) -> None:
    """Make a mouth flat: take away what stands out of its plane, and fill what is missing below it, inside its rim."""
    reach = 1.3 * mouth.diameter_mm
    corners = np.round(grid.to_voxel(mouth.centroid_mm + np.array([[-reach] * 3, [reach] * 3]))).astype(int)
    low, high = np.maximum(corners[0], 0), np.minimum(corners[1] + 1, grid.shape[::-1])
    i, j, k = np.meshgrid(*(np.arange(one, two) for one, two in zip(low, high, strict=True)), indexing="ij")
    away = grid.to_ct(np.stack([i, j, k], axis=-1)) - mouth.centroid_mm
    height = away @ mouth.normal
    beside = np.linalg.norm(away - height[..., None] * mouth.normal, axis=-1)
    over = (height > 0.0) & (height < _LEVEL_MM) & (beside < _LEVEL_OVER * mouth.diameter_mm)
    under = (height <= 0.0) & (height > -_LEVEL_MM) & (beside < _LEVEL_UNDER * mouth.diameter_mm)
    mask[k[over], j[over], i[over]] = False
    mask[k[under], j[under], i[under]] = True


def _reach(masks: dict[str, Mask], vessel: str, ventricle: str, grid: Grid) -> None:
    """Grow a vessel towards its ventricle, which stays as it is, until they meet; thin skirts around it are cut off."""
    box, grown = _grown(masks, vessel, ventricle, grid)
    masks[vessel][box] = (grown[0] | grown[1]) & ~masks[ventricle][box]
    # With the ventricle, or else the opening would also round off the vessel where it meets it.
    both = masks[vessel] | masks[ventricle]
    ball = np.linalg.norm(np.indices((5, 5, 5)) - 2.0, axis=0) <= _SKIRT_VOXELS
    masks[vessel] &= ndimage.binary_opening(both, ball)
    parts, _ = ndimage.label(masks[vessel])
    masks[vessel] = np.asarray(parts == np.bincount(parts.ravel())[1:].argmax() + 1)


def _grown(masks: dict[str, Mask], one: str, other: str, grid: Grid) -> tuple[Box, tuple[Mask, Mask]]:
    """Return the box where two pools are near each other, and both of them there, grown until they meet."""
    box = common_box(masks[one], masks[other], grid, _GAP_MM)
    if box is None:
        raise DataError(f"The surfaces of {one} and {other} lie far apart; they are not of one heart.")
    free = ~np.logical_or.reduce([mask[box] for mask in masks.values()])
    return box, bridged(
        masks[one][box], masks[other][box], free, cropped(grid, box), reach_mm=_GAP_MM, slack_mm=_SLACK_MM
    )


def _labelled(masks: Mapping[str, Mask], grid: Grid) -> LabelVolume:
    """Return the labels of masks that do not overlap, with the catalogue's values."""
    labels = np.zeros(grid.shape, dtype=np.uint8)
    for key, mask in masks.items():
        labels[mask] = CATALOGUE[key].label
    return LabelVolume(labels, grid, {CATALOGUE[key].label: key for key in masks})
