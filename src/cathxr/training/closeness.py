"""How near a catheter is to a target: distances and angles of one tip pose."""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.training.placing import PlacedTarget


@dataclass(frozen=True)
class Closeness:
    """distance_mm: to the target, of the beam, or off its plane; angle_deg: see `PlacedTarget`, None where it has none.

    up_deg: between the beams ("plane" only). range_mm: from the tip to the target's point. inside: within every limit.
    """

    distance_mm: float
    angle_deg: float | None
    up_deg: float | None
    range_mm: float
    inside: bool


def closeness(target: PlacedTarget, tip_box: FloatArray, rotation: FloatArray) -> Closeness:
    """Return how near the tip pose is to the target. tip_box (3,) mm; rotation (3, 3): box_from_tip's."""
    offset = target.point_box - tip_box
    away = float(np.linalg.norm(offset))
    up: float | None = None
    angle: float | None = None
    if target.kind == "tip":
        distance = away
        if target.direction_box is not None:
            angle = angle_deg(rotation[:, 2], target.direction_box)
    elif target.kind == "beam":
        distance = ray_distance(offset, rotation[:, 0])
        angle = angle_deg(rotation[:, 0], offset) if away > 0.0 else 0.0
    else:
        assert target.direction_box is not None
        assert target.up_box is not None
        distance = abs(float(offset @ rotation[:, 1]))
        angle = angle_deg(rotation[:, 1], target.direction_box)
        up = angle_deg(rotation[:, 0], target.up_box)
    inside = (
        distance <= target.distance_mm
        and (target.angle_deg is None or (angle is not None and angle <= target.angle_deg))
        and (target.up_deg is None or (up is not None and up <= target.up_deg))
        and (target.range_mm is None or away <= target.range_mm)
    )
    return Closeness(distance, angle, up, away, inside)


def ray_distance(offset: FloatArray, direction: FloatArray) -> float:
    """Return the distance, mm, of the point at `offset` (3,) from a ray from 0 along the unit `direction` (3,)."""
    along = max(float(offset @ direction), 0.0)
    return float(np.linalg.norm(offset - along * direction))


def angle_deg(first: FloatArray, second: FloatArray) -> float:
    """Return the angle between two directions (3,) of any length, 0 to 180 degrees, exact for small ones too."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second)))
