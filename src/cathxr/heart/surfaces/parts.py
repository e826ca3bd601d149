"""From labels to the surfaces of a heart: smooth, closed, light, with their volumes kept, and checked."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from cathxr.core import DataError, FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.jobs import Together, one_after_another
from cathxr.heart.model import Opening
from cathxr.heart.simplify import simplified
from cathxr.heart.surface import Surface, edge_keys
from cathxr.heart.surfaces.caps import CapValue, cap_value, divided
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
    """A structure's surface before decimation. labels_ml: of its voxels; bend: see `_bending`; contact: its caps."""

    key: str
    surface: Surface
    labels_ml: float
    dropped_ml: float
    bend: float
    contact: CapValue


def surfaces_of(
    labels: LabelVolume,
    *,
    openings: Sequence[Opening] = (),
    budget: int = 150_000,
    together: Together = one_after_another,
    progress: Progress = silent,
) -> list[PartSurface]:
    """Return the surface of every structure that has at least `FEWEST_VOXELS` voxels, in the catalogue's order.

    openings: those of the heart; where nothing else tells it, they say which end of a structure is a cap.
    budget: how many triangles all have together, about. together: how the structures are worked on.

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
    fields = Fields(labels, keys, together=together)
    progress("Making the surfaces", 0.2)
    # Those with the most voxels first: what is left at the end is short work for every thread.
    by_size = sorted(keys, key=lambda key: -labels.voxels(key))
    made = together([partial(_full, key, fields) for key in by_size])
    full = sorted(made, key=lambda each: keys.index(each.key))
    targets = dict(
        zip(keys, _targets([each.surface for each in full], [each.bend for each in full], budget), strict=True)
    )
    voxel_mm = fields.voxel_mm
    del fields
    progress("Simplifying the surfaces", 0.5)
    # Not together: the library keeps the surface that it works on in one place for all threads.
    light = [simplified(each.surface, targets[each.key]) for each in made]
    progress("Finishing and checking the surfaces", 0.6)
    parts = together(
        [partial(_finished, each, lean, voxel_mm, openings) for each, lean in zip(made, light, strict=True)]
    )
    progress("The surfaces are ready", 1.0)
    return sorted(parts, key=lambda part: keys.index(part.key))


def _drawable(labels: LabelVolume) -> tuple[str, ...]:
    """Return the structures that have a shape, in the catalogue's order."""
    voxels = {key: labels.voxels(key) for key in labels.names.values()}
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
    contact = cap_value(level_set, fields.grid)
    smooth = at_volume(low_passed(found, fields.voxel_mm, contact), kept_ml, fields.voxel_mm)
    return _Full(key, smooth, level_set.volume_ml, dropped_ml, _bending(smooth), contact)


def _finished(full: _Full, lean: Surface, voxel_mm: float, openings: Sequence[Opening]) -> PartSurface:
    """Return one part of its decimated surface: cut, repaired, at its volume, checked against its full surface."""
    kept_ml, contact = full.labels_ml - full.dropped_ml, full.contact
    light = at_volume(untangled(lean), kept_ml, voxel_mm)
    near = [(each, each.structure == full.key) for each in openings if full.key in (each.structure, _beyond(each))]
    cut = divided(light, with_mouths(contact, mouths_of(light, near, contact)))
    repaired = untangled(cut.surface)
    final = Surface(np.round(repaired.vertices_mm, ROUND_MM), repaired.triangles)
    forth = distances_mm(sampled(full.surface), final)
    back = distances_mm(sampled(final), full.surface)
    checks = SurfaceChecks(
        topology=topology(final),
        labels_ml=full.labels_ml,
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


def _targets(surfaces: list[Surface], bends: list[float], budget: int) -> list[int]:
    """Return how many triangles each surface may have: by its area and by how much it bends."""
    area = np.array([np.linalg.norm(each.area_vectors, axis=1).sum() for each in surfaces])
    bend = np.array(bends)
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
    order = np.argsort(edge_keys(directed), kind="stable")
    pairs = owner[order][: len(order) // 2 * 2].reshape(-1, 2)
    ends = directed[order][::2][: len(pairs)]
    length = np.linalg.norm(surface.vertices_mm[ends[:, 0]] - surface.vertices_mm[ends[:, 1]], axis=1)
    cosine: FloatArray = np.clip((normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(axis=1), -1.0, 1.0)
    return float((length * np.arccos(cosine)).sum())
