"""From labels to the surfaces of a heart: smooth, closed, light, with their volumes kept, and checked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cathxr.core import DataError, FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.model import Opening
from cathxr.heart.simplify import simplified
from cathxr.heart.surface import Surface
from cathxr.heart.surfaces.caps import cap_value, divided
from cathxr.heart.surfaces.checks import Topology, piece_volumes, topology
from cathxr.heart.surfaces.contour import contoured
from cathxr.heart.surfaces.distance import distances_mm, sampled
from cathxr.heart.surfaces.fields import Fields
from cathxr.heart.surfaces.mouths import mouths_of, with_mouths
from cathxr.heart.surfaces.repair import at_volume, untangled, without_crumbs
from cathxr.heart.surfaces.smoothing import low_passed
from cathxr.heart.volume import LabelVolume, Progress, silent

FEWEST_VOXELS = 8
"""A structure with fewer voxels has no shape that could be drawn."""
_FEWEST_TRIANGLES = 300
_RIM_SHARE = 0.04
"""The part of the budget that is left for the cuts between walls and caps."""
ROUND_MM = 4


@dataclass(frozen=True)
class SurfaceChecks:
    """The measured figures of one surface.

    labels_ml: the structure's voxels; surface_ml: what the final surface encloses; full_triangles: before decimation.
    distance_p95_mm, distance_max_mm: of points spread over the full surface from the final one, and the other way
    round, the larger of both. dropped_ml: crumbs that were left out.
    """

    topology: Topology
    labels_ml: float
    surface_ml: float
    full_triangles: int
    distance_p95_mm: float
    distance_max_mm: float
    dropped_ml: float

    @property
    def volume_change(self) -> float:
        """By what share the surface encloses more (or, below zero, less) than the voxels."""
        return self.surface_ml / self.labels_ml - 1.0


@dataclass(frozen=True, eq=False)
class PartSurface:
    """One structure's closed surface in `ct`; caps (M,): its triangles that are no wall; checks: what was measured."""

    key: str
    surface: Surface
    caps: npt.NDArray[np.bool_]
    checks: SurfaceChecks


@dataclass(frozen=True, eq=False)
class _Full:
    key: str
    surface: Surface
    dropped_ml: float


def surfaces_of(
    labels: LabelVolume,
    *,
    openings: Sequence[Opening] = (),
    budget: int = 150_000,
    progress: Progress = silent,
) -> list[PartSurface]:
    """Return the surface of every structure that has at least `FEWEST_VOXELS` voxels, in the catalogue's order.

    openings: those of the heart; where nothing else tells it, they say which end of a structure is a cap.
    budget: how many triangles all have together, about.

    Raises:
        DataError: there is no such structure, or the budget is too small for so many.
    """
    keys = _drawable(labels)
    if budget < 2 * _FEWEST_TRIANGLES * len(keys):
        raise DataError(
            f"A budget of {budget} triangles is too small for {len(keys)} structures; "
            f"give at least {2 * _FEWEST_TRIANGLES * len(keys)}."
        )
    progress("Smoothing the structures' borders", 0.0)
    fields = Fields(labels, keys)
    full: list[_Full] = []
    for number, key in enumerate(keys):
        progress(f"Making the surface: {CATALOGUE[key].name}", 0.2 + 0.3 * number / len(keys))
        full.append(_full(key, fields))
    targets = _targets([each.surface for each in full], budget)
    parts: list[PartSurface] = []
    for number, (each, target) in enumerate(zip(full, targets, strict=True)):
        progress(f"Simplifying and checking: {CATALOGUE[each.key].name}", 0.5 + 0.5 * number / len(keys))
        parts.append(_finished(each, target, fields, openings))
    progress("Surfaces are ready", 1.0)
    return parts


def _drawable(labels: LabelVolume) -> tuple[str, ...]:
    """Return the structures that have a shape, in the catalogue's order."""
    counts = np.bincount(labels.labels.ravel(), minlength=256)
    voxels: dict[str, int] = {}
    for value, key in labels.names.items():
        voxels[key] = voxels.get(key, 0) + int(counts[value])
    if unknown := [key for key in voxels if key not in CATALOGUE]:
        raise DataError(
            f"The labels name a structure {unknown[0]!r} that is not in the catalogue; it has {', '.join(CATALOGUE)}."
        )
    keys = tuple(key for key in CATALOGUE if voxels.get(key, 0) >= FEWEST_VOXELS)
    if not keys:
        raise DataError(
            f"The labels hold no structure of at least {FEWEST_VOXELS} voxels, so there is no surface to make; "
            "give labels in which structures are marked."
        )
    return keys


def _full(key: str, fields: Fields) -> _Full:
    """Return a structure's surface before decimation: smooth, at its volume."""
    level_set = fields.level_set(key)
    found, dropped_ml = without_crumbs(contoured(level_set, fields.grid))
    kept_ml = level_set.volume_ml - dropped_ml
    smooth = low_passed(found, fields.voxel_mm, cap_value(level_set, fields.grid))
    return _Full(key, at_volume(smooth, kept_ml, fields.voxel_mm), dropped_ml)


def _finished(full: _Full, target: int, fields: Fields, openings: Sequence[Opening]) -> PartSurface:
    """Return one part: decimated, cut, repaired, at its volume, checked against its full surface."""
    level_set = fields.level_set(full.key)
    kept_ml = level_set.volume_ml - full.dropped_ml
    light = at_volume(untangled(simplified(full.surface, target)), kept_ml, fields.voxel_mm)
    contact = cap_value(level_set, fields.grid)
    near = [(each, each.structure == full.key) for each in openings if full.key in (each.structure, _beyond(each))]
    cut = divided(light, with_mouths(contact, mouths_of(light, near, contact)))
    repaired = untangled(cut.surface)
    final = Surface(np.round(repaired.vertices_mm, ROUND_MM), repaired.triangles)
    forth = distances_mm(sampled(full.surface), final)
    back = distances_mm(sampled(final), full.surface)
    checks = SurfaceChecks(
        topology=topology(final),
        labels_ml=level_set.volume_ml,
        surface_ml=float(piece_volumes(final)[1].sum()),
        full_triangles=len(full.surface.triangles),
        distance_p95_mm=float(max(np.percentile(forth, 95), np.percentile(back, 95))),
        distance_max_mm=float(max(forth.max(), back.max())),
        dropped_ml=full.dropped_ml,
    )
    return PartSurface(full.key, final, cut.caps, checks)


def _beyond(opening: Opening) -> str:
    """Return the structure on an opening's other side, where the opening's key tells it."""
    known = {"mitral_valve": "left_atrium", "tricuspid_valve": "right_atrium"}
    known |= {"aortic_valve": "aorta", "pulmonary_valve": "pulmonary_artery"}
    return known.get(opening.key, "pulmonary_veins" if "pulmonary_vein" in opening.key else opening.key)


def _targets(surfaces: list[Surface], budget: int) -> list[int]:
    """Return how many triangles each surface may have: by its area and by how much it bends."""
    area = np.array([np.linalg.norm(each.area_vectors, axis=1).sum() for each in surfaces])
    bend = np.array([_bending(each) for each in surfaces])
    weight = area / area.sum() + bend / max(float(bend.sum()), 1e-9)
    had = np.array([len(each.triangles) for each in surfaces], float)
    free = float(budget) * (1.0 - _RIM_SHARE)
    targets = np.zeros(len(surfaces))
    # Those that need no decimation leave their share to the others.
    open_ = np.ones(len(surfaces), bool)
    while open_.any():
        share = np.maximum(free * weight / weight[open_].sum(), _FEWEST_TRIANGLES)
        done = open_ & (had <= share)
        if not done.any():
            targets[open_] = share[open_]
            break
        targets[done] = had[done]
        free -= float(had[done].sum())
        open_ &= ~done
    return [int(each) for each in targets]


def _bending(surface: Surface) -> float:
    """Return the sum over all edges of their length times the angle between their two triangles: mm."""
    normals = surface.area_vectors
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    triangles = surface.triangles
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    owner = np.tile(np.arange(len(triangles)), 3)
    low, high = np.sort(directed, axis=1).T
    order = np.lexsort((high, low))
    pairs = owner[order][: len(order) // 2 * 2].reshape(-1, 2)
    ends = directed[order][::2][: len(pairs)]
    length = np.linalg.norm(surface.vertices_mm[ends[:, 0]] - surface.vertices_mm[ends[:, 1]], axis=1)
    cosine: FloatArray = np.clip((normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(axis=1), -1.0, 1.0)
    return float((length * np.arccos(cosine)).sum())
