"""A synthetic contrast CT of a chest: four chambers and their vessels, lungs, bones, noise; its volumes are known.

Nothing of it is taken from a real heart: ellipsoids and tubes where anatomy says that the chambers are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial.transform import Rotation

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.segmentation.sampling import sampled
from cathxr.heart.volume import Grid, LabelVolume, Technical, Volume

from .pools import from_pools
from .shapes import Distances, Points, Shape, any_of, box, ellipsoid, ring, tube

__all__ = ["HeartLook", "four_chambers", "from_pools", "grid_about"]

HEART_CENTRE_MM = (60.0, 60.0, 62.0)
_CHAMBERS = ("left_ventricle", "right_ventricle", "left_atrium", "right_atrium")
_SLICES_AT_ONCE = 8
_FINE_MM = 1.6
_OPENINGS = (("left_atrium", "left_ventricle"), ("right_atrium", "right_ventricle"))
_VALVES = {"mitral": ((80.0, 72.0, 62.0), (70.0, 82.0, 74.0)), "tricuspid": ((36.0, 52.0, 52.0), (52.0, 44.0, 49.0))}

# A stent graft's struts about the descending aorta.
_STRUTS = tuple(ring((80.5, 121.0, -10.0 + 9.0 * n), (12.0, 12.0), 0.8, 0.0) for n in range(12))


@dataclass(frozen=True)
class HeartLook:
    """What the scan shows. HU of the contents; noise: HU, standard deviation; blur_mm: full width at half maximum.

    size: of the heart's lengths. open_valves: whether mitral and tricuspid orifices show no leaflets at all.
    """

    left_hu: float = 400.0
    right_hu: float = 320.0
    tissue_hu: float = 100.0
    noise_hu: float = 20.0
    blur_mm: float = 0.9
    size: float = 1.0
    open_valves: bool = False
    stent: bool = False
    bones: bool = True
    overrides: Mapping[str, float] = field(default_factory=dict)


def grid_about(
    shape: Sequence[int], spacing_mm: Sequence[float], *, oblique_deg: Sequence[float] = (0.0, 0.0, 0.0)
) -> Grid:
    """Return the grid (K, J, I) with spacing (i, j, k) whose middle is the heart's, turned about x, y and z."""
    turn = Rotation.from_euler("xyz", oblique_deg, degrees=True).as_matrix()
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.asarray(spacing_mm, float)
    middle = (np.asarray(shape[::-1], float) - 1.0) / 2.0
    matrix[:3, 3] = np.asarray(HEART_CENTRE_MM) - matrix[:3, :3] @ middle
    return Grid((int(shape[0]), int(shape[1]), int(shape[2])), matrix)


def four_chambers(
    shape: Sequence[int] = (128, 128, 128),
    spacing_mm: Sequence[float] = (1.25, 1.25, 1.25),
    *,
    oblique_deg: Sequence[float] = (0.0, 0.0, 0.0),
    look: HeartLook | None = None,
    seed: int = 0,
) -> tuple[Volume, LabelVolume]:
    """Return the scan and the truth. shape (K, J, I); spacing along i, j, k; the field of view may cut the chest."""
    look = look or HeartLook()
    grid = grid_about(shape, spacing_mm, oblique_deg=oblique_deg)
    hu = np.empty(grid.shape, np.float32)
    labels = np.zeros(grid.shape, np.uint8)
    parts = _chest(look)
    step = 2 if grid.spacing_mm.max() < _FINE_MM else 1
    for start in range(0, grid.shape[0], _SLICES_AT_ONCE):
        slab = slice(start, min(start + _SLICES_AT_ONCE, grid.shape[0]))
        hu[slab], labels[slab] = _painted(_fields(grid, slab, parts, look, step), parts, look, grid)
    sigma = look.blur_mm / 2.3548 / grid.spacing_mm[::-1]
    hu = ndimage.gaussian_filter(hu, sigma, output=np.float32)
    rng = np.random.default_rng([seed, 0xC7])
    for each in hu:  # slice by slice: the noise of a large volume needs no second copy of it
        each += rng.normal(0.0, look.noise_hu, each.shape).astype(np.float32)
    technical = Technical("CT", contrast=True)
    names = {CATALOGUE[key].label: key for key in _raw_blood()}
    return Volume(np.clip(hu, -1024, 3071).astype(np.int16), grid, technical), LabelVolume(labels, grid, names)


def _fields(
    grid: Grid, slab: slice, parts: Sequence[tuple[Shape, float]], look: HeartLook, step: int
) -> npt.NDArray[np.float32]:
    """Return the signed distances (F, k, j, i) of a slab to the chest's parts, then to the blood, stent and valves.

    Each step-th voxel is worked out along each axis, and what lies between is interpolated: truth and picture alike.
    """
    sizes = (slab.stop - slab.start, *grid.shape[1:])
    coarse = [step * np.arange((size + step - 2) // step + 1) for size in sizes]
    k, j, i = np.meshgrid(coarse[0] + slab.start, coarse[1], coarse[2], indexing="ij")
    points = grid.to_ct(np.stack([i, j, k], axis=-1).reshape(-1, 3)).astype(np.float32)
    shapes = [shape for shape, _ in parts]
    fields = [shape(points) for shape in shapes] + list(_blood(points, look.size).values())
    fields += [any_of(*_STRUTS)(points)] * look.stent
    fields += [tube(_VALVES[valve], 9.0)(points) for valve in _VALVES if look.open_valves]
    stacked = np.stack(fields).reshape(-1, *k.shape)
    if step == 1:
        return stacked
    index = np.stack(np.meshgrid(*(np.arange(size) / step for size in sizes), indexing="ij"))
    return sampled(stacked, index)


def _painted(
    fields: npt.NDArray[np.float32], parts: Sequence[tuple[Shape, float]], look: HeartLook, grid: Grid
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """Return the HU and labels of a slab: each part is laid over those before it, by how much it covers."""
    edge = np.float32(grid.spacing_mm.mean())
    hu = np.full(fields.shape[1:], -1000.0, np.float32)

    def lay(distance: Distances, value: float) -> None:
        cover = np.clip(np.float32(0.5) - distance / edge, 0.0, 1.0)
        np.multiply(cover, np.float32(value) - hu, out=cover)
        np.add(hu, cover, out=hu)

    for distance, (_, value) in zip(fields, parts, strict=False):
        lay(distance, value)
    keys = list(_raw_blood())
    blood = dict(zip(keys, fields[len(parts) :], strict=False))
    further = list(fields[len(parts) + len(keys) :])
    labels = np.zeros(hu.shape, np.uint8)
    heart = np.minimum.reduce([blood[key] for key in _CHAMBERS])
    lay(heart - np.float32(6.0), -90.0)  # fat
    lay(np.minimum.reduce([blood[key] for key in blood if key not in _CHAMBERS]) - np.float32(1.5), 60.0)
    lay(np.minimum(heart - np.float32(2.5), blood["left_ventricle"] - np.float32(9.0)), look.tissue_hu)
    if look.stent:
        lay(further.pop(0), 2500.0)
    # The catalogue's order puts chambers first; where a vessel runs into its chamber the chamber's label stays.
    for key in sorted(blood, key=lambda key: CATALOGUE[key].label, reverse=True):
        lay(blood[key], _hu(key, look))
        labels[blood[key] < 0.0] = CATALOGUE[key].label
    for (atrium, ventricle), valve in zip(_OPENINGS, further, strict=False):
        # The orifice is filled with blood; each half of it belongs to the nearer chamber.
        through = (valve < 0.0) & (labels == 0)
        atrial = blood[atrium][through] < blood[ventricle][through]
        labels[through] = np.where(atrial, CATALOGUE[atrium].label, CATALOGUE[ventricle].label)
        hu[through] = _hu(atrium, look)
    return hu, labels


def _hu(key: str, look: HeartLook) -> float:
    """Return the HU of a structure's blood."""
    left = key in ("left_ventricle", "left_atrium", "aorta", "pulmonary_veins", "left_atrial_appendage")
    return look.overrides.get(key, look.left_hu if left else look.right_hu)


def _raw_blood() -> dict[str, Shape]:
    """Return each structure's shape before what is taken off for walls."""
    rv_body = ellipsoid((64.0, 34.0, 46.0), (27.0, 33.0, 44.0), (46.0, -39.0, -50.0))
    return {
        "left_ventricle": ellipsoid((92.0, 58.0, 45.0), (25.0, 25.0, 43.0), (46.0, -39.0, -50.0)),
        "right_ventricle": any_of(rv_body, tube([(66.0, 32.0, 72.0), (73.0, 40.0, 98.0)], 13.0)),
        "left_atrium": ellipsoid((52.0, 88.0, 86.0), (27.0, 17.0, 25.0)),
        "right_atrium": ellipsoid((26.0, 60.0, 60.0), (22.0, 27.0, 31.0)),
        "aorta": tube(
            [(68.0, 62.0, 80.0), (52.0, 54.0, 106.0), (50.0, 56.0, 140.0), (62.0, 78.0, 156.0), (82.0, 106.0, 146.0),
             (84.0, 120.0, 120.0), (78.0, 122.0, -120.0)],
            12.0,
        ),
        "superior_vena_cava": tube([(18.0, 60.0, 84.0), (20.0, 62.0, 110.0), (22.0, 60.0, 170.0)], 8.5),
        "inferior_vena_cava": tube([(20.0, 64.0, 36.0), (18.0, 68.0, 12.0), (20.0, 72.0, -40.0)], 9.5),
        "pulmonary_artery": any_of(
            tube([(73.0, 41.0, 112.0), (76.0, 62.0, 126.0)], 12.0),
            tube([(76.0, 62.0, 126.0), (46.0, 80.0, 128.0), (-8.0, 84.0, 126.0)], 8.0),
            tube([(76.0, 62.0, 126.0), (92.0, 92.0, 126.0), (112.0, 96.0, 122.0)], 8.5),
        ),
        "pulmonary_veins": any_of(
            tube([(30.0, 88.0, 98.0), (-8.0, 84.0, 106.0)], 6.0),
            tube([(30.0, 94.0, 80.0), (-8.0, 104.0, 74.0)], 5.5),
            tube([(74.0, 92.0, 96.0), (108.0, 98.0, 108.0)], 6.0),
            tube([(74.0, 96.0, 82.0), (106.0, 112.0, 76.0)], 5.5),
        ),
        "left_atrial_appendage": tube([(72.0, 84.0, 96.0), (88.0, 72.0, 102.0), (94.0, 60.0, 98.0)], 6.5),
    }  # fmt: skip


# What each structure keeps its distance from, mm: septum 9, atrial septum 2.5, atrioventricular planes 2.2.
_WALLS_MM: Mapping[str, Mapping[str, float]] = {
    "right_ventricle": {"left_ventricle": 9.0},
    "left_atrium": {"left_ventricle": 2.2},
    "right_atrium": {"right_ventricle": 2.2, "left_atrium": 2.5},
    "aorta": {"left_ventricle": 1.6, "right_ventricle": 2.0, "left_atrium": 2.0, "right_atrium": 2.0},
    "superior_vena_cava": {"aorta": 2.0, "left_atrium": 2.0},
    "inferior_vena_cava": {"left_ventricle": 2.0, "right_ventricle": 2.0, "left_atrium": 2.0},
    "pulmonary_artery": {"right_ventricle": 1.6, "aorta": 2.5, "left_atrium": 2.5, "superior_vena_cava": 2.0},
    "pulmonary_veins": {
        "aorta": 2.0, "pulmonary_artery": 2.0, "left_ventricle": 2.5, "right_atrium": 2.5, "superior_vena_cava": 2.5,
    },
    "left_atrial_appendage": {
        "pulmonary_artery": 2.5, "left_ventricle": 2.5, "right_ventricle": 2.5, "aorta": 2.5, "pulmonary_veins": 2.5,
    },
}  # fmt: skip


def _blood(points: Points, size: float) -> dict[str, Distances]:
    """Return each structure's signed distances (N,) at the points, walls taken off."""
    centre = np.asarray(HEART_CENTRE_MM, np.float32)
    at = ((points - centre) / np.float32(size) + centre).astype(np.float32)
    distances: dict[str, Distances] = {}
    for key, shape in _raw_blood().items():
        distance = shape(at) * np.float32(size)
        for other, wall in _WALLS_MM.get(key, {}).items():
            np.maximum(distance, np.float32(wall) - distances[other], out=distance)
        distances[key] = distance
    return distances


def _chest(look: HeartLook) -> list[tuple[Shape, float]]:
    """Return the chest without its heart: parts and their HU, in the order in which they are laid."""
    parts: list[tuple[Shape, float]] = [
        (ellipsoid((58.0, 62.0, 60.0), (170.0, 118.0, 600.0)), 40.0),
        (ellipsoid((58.0, 66.0, 60.0), (158.0, 106.0, 560.0)), -90.0),
        (ellipsoid((-24.0, 66.0, 92.0), (70.0, 84.0, 120.0)), -820.0),
        (ellipsoid((142.0, 66.0, 92.0), (66.0, 84.0, 120.0)), -820.0),
        (ellipsoid((-20.0, 60.0, -62.0), (110.0, 90.0, 70.0)), 110.0),  # the liver
    ]
    lung_vessels = [
        tube([(-10.0 - 9.0 * n, 70.0 + 6.0 * (n % 4), 60.0 + 14.0 * n), (-60.0, 50.0 + 13.0 * n, 40.0 + 20.0 * n)], 2.2)
        for n in range(5)
    ] + [
        tube([(122.0 + 5.0 * n, 80.0 + 7.0 * (n % 3), 66.0 + 13.0 * n), (170.0, 50.0 + 13.0 * n, 50.0 + 20.0 * n)], 2.2)
        for n in range(5)
    ]
    parts.append((any_of(*lung_vessels), look.right_hu))
    if look.bones:
        spine = tube([(56.0, 142.0, -400.0), (56.0, 142.0, 500.0)], 18.0)
        parts += [(spine, 650.0), (_grown(spine, -2.0), 190.0)]
        parts += [(tube([(56.0, 164.0, -400.0), (56.0, 164.0, 500.0)], 7.0), 30.0)]
        sternum = box((56.0, -30.0, 100.0), (17.0, 6.0, 90.0))
        parts += [(sternum, 500.0), (_grown(sternum, -1.5), 150.0)]
        ribs = any_of(*(ring((58.0, 62.0, -60.0 + 30.0 * n), (162.0, 108.0), 4.5, 0.35) for n in range(9)))
        parts += [(ribs, 600.0), (_grown(ribs, -1.5), 200.0)]
    return parts


def _grown(shape: Shape, by_mm: float) -> Shape:
    """Return the shape with `by_mm` more all round."""
    return lambda points: shape(points) - np.float32(by_mm)
