"""Where an opening that no other blood touches lies on a structure's surface: a plane that cuts its closed end off."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.heart.model import Opening
from cathxr.heart.surface import Surface, vertex_normals
from cathxr.heart.surfaces.caps import CapValue

_REACH_MM = 8.0
_FACING = 0.5
_INNER, _OUTER = 0.4, 0.7
"""Shares of the opening's diameter: within the first its end is looked for, within the second it is cut."""
_FEWEST = 5
_DEPTH_MM = 0.75
"""How far inside of the end's middle the cut is made: what is rounded there belongs to the end."""


@dataclass(frozen=True, eq=False)
class Mouth:
    """An end of one structure. centre (3,) mm on its surface, normal (3,) out of it, radius_mm of what is cut."""

    centre_mm: FloatArray
    normal: FloatArray
    radius_mm: float


def mouths_of(surface: Surface, openings: Sequence[tuple[Opening, bool]], contact: CapValue) -> tuple[Mouth, ...]:
    """Return the ends of a surface at openings where `contact` finds no cap yet.

    openings: each with whether it is an opening of this structure (else of the one on its other side).
    """
    normals = vertex_normals(surface)
    found: list[Mouth] = []
    for opening, is_own in openings:
        outward = opening.normal if is_own else -opening.normal
        away = surface.vertices_mm - opening.centroid_mm
        height = away @ outward
        beside = np.linalg.norm(away - height[:, None] * outward, axis=1)
        end = (beside < _INNER * opening.diameter_mm) & (np.abs(height) < _REACH_MM) & (normals @ outward > _FACING)
        if np.count_nonzero(end) < _FEWEST or (contact(surface.vertices_mm[end]) > 0.0).mean() > 0.3:
            continue
        centre = opening.centroid_mm + float(np.median(height[end])) * outward
        found.append(Mouth(centre, outward, _OUTER * opening.diameter_mm))
    return tuple(found)


def with_mouths(contact: CapValue, mouths: Sequence[Mouth]) -> CapValue:
    """Return the value that is above zero where `contact` is, and at the mouths."""

    def value(points_mm: FloatArray) -> FloatArray:
        found = contact(points_mm)
        for mouth in mouths:
            away = points_mm - mouth.centre_mm
            height = away @ mouth.normal
            beside = np.linalg.norm(away - height[:, None] * mouth.normal, axis=1)
            at_mouth = np.minimum(np.minimum(height + _DEPTH_MM, _REACH_MM - height), mouth.radius_mm - beside)
            found = np.maximum(found, at_mouth)
        return np.asarray(found)

    return value
