"""The checks of a made heart: what was required, what was measured, whether it is met."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cathxr.core import FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.boxes import box_around
from cathxr.heart.facing import cropped
from cathxr.heart.made import Made
from cathxr.heart.surfaces import PartSurface
from cathxr.heart.surfaces.distance import distances_mm, sampled
from cathxr.heart.surfaces.fields import touching
from cathxr.heart.volume import LabelVolume

VOLUME_SHARE = 0.01
DISTANCE_MM = 0.5
GAP_MM = 0.5
_GAP_VOXELS = 1.0
"""Of each of two neighbours, the voxels tell the border to half a voxel."""
_POINTS = 2000
_FAR_MM = 3.0
"""What is farther from every neighbour counts as this far: searching farther takes long and changes no verdict."""
_CRUMB_MM = 3.0
"""A voxel that is farther than this from its structure's surface belonged to a crumb."""
_LEAST_MM2 = 20.0
"""Two that touch over less than this have no common opening."""
IN_ONE_PIECE = ("left_ventricle", "right_ventricle", "left_atrium", "right_atrium", "aorta", "myocardium")


@dataclass(frozen=True)
class Check:
    """One requirement. met: None where it is information, not a requirement. measured: figures in words."""

    what: str
    required: str
    measured: str
    met: bool | None


@dataclass(frozen=True)
class Gap:
    """How far apart two neighbours are where they touch: of points on the caps of one from the other's surface."""

    one: str
    other: str
    p95_mm: float


def checks_of(made: Made) -> list[Check]:
    """Return the checks of all parts together, worst figure first named."""
    parts = made.parts
    total = sum(len(part.caps) for part in parts)
    found = [
        Check(
            "Triangles of all surfaces",
            f"at most {1.05 * made.budget:,.0f} (a budget of {made.budget:,})",
            _lightened(total, sum(part.checks.full_triangles for part in parts)),
            total <= 1.05 * made.budget,
        ),
        _none("Watertight (walls and caps together)", "every edge has two triangles", parts, _open),
        _none("Does not go through itself", "no two triangles", parts, _tangles),
        _worst_volume(parts),
        _worst_distance(parts),
    ]
    gaps = gaps_of(parts, made.labels)
    limit = max(GAP_MM, _GAP_VOXELS * float(made.labels.grid.spacing_mm.prod() ** (1 / 3)))
    if gaps:
        worst = max(gaps, key=lambda gap: gap.p95_mm)
        found.append(
            Check(
                "Neighbours fit where they touch",
                f"95 % within {limit:.2g} mm",
                f"largest {worst.p95_mm:.2f} mm, {_name(worst.one)} to {_name(worst.other)}",
                worst.p95_mm <= limit,
            )
        )
    found += [_pieces(part) for part in parts if part.checks.topology.pieces != 1 or part.checks.topology.cavities]
    if handles := [part for part in parts if part.checks.topology.handles]:
        told = ", ".join(f"{_name(part.key)} {part.checks.topology.handles}" for part in handles)
        found.append(Check("Handles (tunnels) of a surface", "stated; none is the simplest shape", told, None))
    return found


def gaps_of(parts: Sequence[PartSurface], labels: LabelVolume) -> list[Gap]:
    """Return how well neighbours fit, for each part and each neighbour whose voxels touch its own."""
    near_mm = float(labels.grid.spacing_mm.max())
    far_mm = max(_FAR_MM, 2.0 * near_mm)
    faces = _faces(labels, parts)
    gaps = []
    for part in parts:
        touched = [each for each in parts if len(faces.get(frozenset((part.key, each.key)), ())) and each is not part]
        touched = [each for each in touched if CATALOGUE[each.key].blood]
        if not part.caps.any() or not touched:
            continue
        caps = part.surface.keep(part.caps)
        points = sampled(caps, _POINTS)
        mm2_per_point = float(np.linalg.norm(caps.area_vectors, axis=1).sum()) / _POINTS
        # Where a part has been cut for other reasons, by the volume's end or at a mouth, no neighbour is due.
        face = cKDTree(np.concatenate([faces[frozenset((part.key, each.key))] for each in touched]))
        due = points[np.isfinite(face.query(points, distance_upper_bound=near_mm)[0])]
        away = np.stack([distances_mm(due, each.surface, within_mm=far_mm) for each in touched])
        away = np.minimum(away, far_mm)
        # A point fits to one of its neighbours: the nearest.
        nearest = away.argmin(axis=0)
        for number, other in enumerate(touched):
            to_this = away[number][nearest == number]
            if len(to_this) * mm2_per_point >= _LEAST_MM2:
                gaps.append(Gap(part.key, other.key, float(np.percentile(to_this, 95))))
    return gaps


def _faces(labels: LabelVolume, parts: Sequence[PartSurface]) -> dict[frozenset[str], FloatArray]:
    """Return the voxels, as points (N, 3) in `ct`, where two structures touch, by the keys of the two."""
    box = box_around(labels.labels)
    if box is None:
        return {}
    grid = cropped(labels.grid, box)
    points: dict[frozenset[str], list[FloatArray]] = {}
    for (one, other), cells in touching(labels.labels[box]).items():
        keys = frozenset((labels.names[one], labels.names[other]))
        points.setdefault(keys, []).append(grid.to_ct(cells[:, ::-1]))
    faces = {keys: np.concatenate(each) for keys, each in points.items()}
    # Where only a crumb touched that has no surface, there is nothing to fit.
    for part in parts:
        if part.checks.dropped_ml > 0.0:
            for keys in [each for each in faces if part.key in each]:
                kept = distances_mm(faces[keys], part.surface, within_mm=_CRUMB_MM)
                faces[keys] = faces[keys][np.isfinite(kept)]
    return faces


def _lightened(total: int, full: int) -> str:
    """Return how many triangles there are, and how many there were; cutting walls from caps adds some."""
    return f"{total:,} (before decimation {full:,})" if full > total else f"{total:,} (no decimation was needed)"


def _none(what: str, required: str, parts: Sequence[PartSurface], count: Callable[[PartSurface], int]) -> Check:
    """Return a check that every part meets with a count of zero."""
    bad = [(part, count(part)) for part in parts if count(part)]
    told = ", ".join(f"{_name(part.key)}: {found}" for part, found in bad)
    return Check(what, required, told or f"all {len(parts)} surfaces", not bad)


def _open(part: PartSurface) -> int:
    return part.checks.topology.open_edges + part.checks.topology.crowded_edges


def _tangles(part: PartSurface) -> int:
    return part.checks.topology.intersections


def _worst_volume(parts: Sequence[PartSurface]) -> Check:
    worst = max(parts, key=lambda part: abs(part.checks.volume_change))
    share = worst.checks.volume_change
    return Check(
        "Volume kept by smoothing and decimation",
        f"within {100 * VOLUME_SHARE:g} % of the labels'",
        f"largest change {100 * abs(share):.2f} %, {_name(worst.key)}",
        abs(share) <= VOLUME_SHARE,
    )


def _worst_distance(parts: Sequence[PartSurface]) -> Check:
    worst = max(parts, key=lambda part: part.checks.distance_p95_mm)
    return Check(
        "Distance of the light surface from the full one",
        f"95 % within {DISTANCE_MM:g} mm",
        f"largest {worst.checks.distance_p95_mm:.3f} mm, {_name(worst.key)} (farthest point of any surface "
        f"{max(part.checks.distance_max_mm for part in parts):.2f} mm)",
        worst.checks.distance_p95_mm <= DISTANCE_MM,
    )


def _pieces(part: PartSurface) -> Check:
    """Return how many pieces a part has."""
    figures = part.checks.topology
    told = _counted(figures.pieces, "piece", "pieces")
    if figures.cavities:
        told += f", {_counted(figures.cavities, 'closed cavity', 'closed cavities')} in it"
    one = part.key in IN_ONE_PIECE
    required = "one piece" if one else "stated"
    return Check(f"Pieces: {_name(part.key)}", required, told, figures.pieces == 1 if one else None)


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def _name(key: str) -> str:
    return CATALOGUE[key].name.lower()
