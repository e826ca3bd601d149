"""What a person is asked to do: a Task with its Targets. Plain values, as a task file says them, not yet placed."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cathxr.core import FloatArray
from cathxr.core.arrays import checked

View = Literal["2d", "3d", "free"]
"""What the person sees: the cameras' or plane pictures only, the 3D scene, or whichever is chosen."""
Order = Literal["fixed", "random", "latin"]
VIEWS: tuple[View, ...] = ("2d", "3d", "free")
ORDERS: tuple[Order, ...] = ("fixed", "random", "latin")


@dataclass(frozen=True, eq=False)
class Place:
    """Where a target is: exactly one of: the mean of heart's landmarks, a point of `ct`, a point of `box`, mm (3,)."""

    landmarks: tuple[str, ...] = ()
    position_ct_mm: FloatArray | None = None
    position_box_mm: FloatArray | None = None

    def __post_init__(self) -> None:
        given = (bool(self.landmarks), self.position_ct_mm is not None, self.position_box_mm is not None)
        if sum(given) != 1:
            raise ValueError("place: expected exactly one of landmark, position_ct_mm and position_box_mm")
        for name in ("position_ct_mm", "position_box_mm"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, checked(name, value, (3,)))


@dataclass(frozen=True, eq=False)
class Reach:
    """Reached when near enough, for `dwell_s` without leaving.

    by "tip": the distance is that from the tip to the target, and the angle that between the tip's axis (distally) and
    `direction_box` (3,), which an angle_deg needs. by "beam": the distance is the target's shortest distance from the
    beam, a ray from the tip along the tip frame's x, and the angle that between the beam and the line from the tip to
    the target; a target more than range_mm from the tip is not seen (None: no limit).
    """

    by: Literal["tip", "beam"]
    radius_mm: float
    angle_deg: float | None = None
    dwell_s: float = 0.0
    direction_box: FloatArray | None = None
    range_mm: float | None = None

    def __post_init__(self) -> None:
        _positive("radius_mm", self.radius_mm)
        _limits(self.angle_deg, self.dwell_s, self.range_mm)
        if self.by == "tip" and (self.angle_deg is None) != (self.direction_box is None):
            raise ValueError("reach: expected angle_deg and direction_box together, or neither, with by = 'tip'")
        if self.by == "tip" and self.range_mm is not None:
            raise ValueError("reach: range_mm is for by = 'beam'; with by = 'tip' the radius says it")
        if self.by == "beam" and self.direction_box is not None:
            raise ValueError("reach: direction_box is for by = 'tip'; with by = 'beam' the line to the target says it")
        if self.direction_box is not None:
            object.__setattr__(self, "direction_box", unit("direction_box", self.direction_box))


@dataclass(frozen=True, eq=False)
class Plane:
    """An imaging plane to be met. It holds the target's place; how it lies is said in one of two ways.

    axis: two landmarks. The plane holds the line from the first to the second too: the catheter lies along it, the beam
    (`up`) points from the line to the place, the normal is axis × up. Or normal_box, up_box (3,), directions in `box`.
    The image plane is that of the tip frame's z (catheter) and x (beam); its normal is the frame's y, and directed: a
    picture mirrored left to right is another view. offset_mm: the place's distance from the image plane; angle_deg:
    between the normals; up_deg: between the beam and `up`; range_mm: from the tip to the place (None: any).
    """

    offset_mm: float
    angle_deg: float
    dwell_s: float = 0.0
    up_deg: float = 30.0
    axis: tuple[str, str] | None = None
    normal_box: FloatArray | None = None
    up_box: FloatArray | None = None
    range_mm: float | None = None

    def __post_init__(self) -> None:
        _positive("offset_mm", self.offset_mm)
        _limits(self.angle_deg, self.dwell_s, self.range_mm)
        _limits(self.up_deg, 0.0, None)
        explicit = self.normal_box is not None and self.up_box is not None
        if (self.axis is not None) == explicit or (self.normal_box is None) != (self.up_box is None):
            raise ValueError("plane: expected either axis, or normal_box and up_box")
        if self.normal_box is not None and self.up_box is not None:
            normal, up = unit("normal_box", self.normal_box), unit("up_box", self.up_box)
            if abs(float(normal @ up)) > 0.01:
                raise ValueError("plane: expected up_box in the plane, at right angles to normal_box")
            object.__setattr__(self, "normal_box", normal)
            object.__setattr__(self, "up_box", unit("up_box", up - (up @ normal) * normal))


@dataclass(frozen=True, eq=False)
class Target:
    """One thing to reach: a place and the rule by which it counts as reached."""

    key: str
    name: str
    place: Place
    rule: Reach | Plane


@dataclass(frozen=True)
class Practice:
    """Familiarisation to a criterion: targets are offered over and over until `in_a_row` were reached in a row.

    A target that is not reached within the task's target_limit_s breaks the row. limit_s: of active time; then it ends.
    """

    in_a_row: int
    limit_s: float

    def __post_init__(self) -> None:
        if self.in_a_row < 1:
            raise ValueError(f"practice: expected in_a_row of at least 1, got {self.in_a_row}")
        _positive("practice.limit_s", self.limit_s)


@dataclass(frozen=True, eq=False)
class Task:
    """A task. limit_s: of active time for the whole; target_limit_s: for one target, which is then skipped.

    draw: how many of the targets are offered, the first of their order (None: all). step: place in the progression from
    one manipulation at a time to timed random targets, 1 to 9, None outside it. practice: see `Practice`, whose limit
    is then the whole's.
    """

    key: str
    name: str
    text: str
    targets: tuple[Target, ...]
    limit_s: float
    view: View = "free"
    order: Order = "fixed"
    target_limit_s: float | None = None
    draw: int | None = None
    step: int | None = None
    practice: Practice | None = None

    def __post_init__(self) -> None:
        _positive("limit_s", self.limit_s)
        if self.target_limit_s is not None:
            _positive("target_limit_s", self.target_limit_s)
        if not self.targets:
            raise ValueError("targets: expected at least one")
        keys = [each.key for each in self.targets]
        if len(set(keys)) < len(keys):
            raise ValueError(f"targets: expected a key of its own for each, got {', '.join(keys)}")
        if self.draw is not None and not 1 <= self.draw <= len(keys):
            raise ValueError(f"draw: expected 1 to {len(keys)}, the number of targets, got {self.draw}")
        self._check_dwells()
        if self.practice is not None and self.draw is not None:
            raise ValueError("draw: a practice task offers its targets over and over, and draws none")
        if self.practice is not None and self.target_limit_s is None:
            raise ValueError(
                "target_limit_s: expected with [practice], for a target that is not reached breaks the row"
            )

    def _check_dwells(self) -> None:
        """Raise ValueError where a target asks to stay longer than there is time for it."""
        whole_s = self.limit_s if self.practice is None else self.practice.limit_s
        limit_s = min(whole_s, whole_s if self.target_limit_s is None else self.target_limit_s)
        for each in self.targets:
            if each.rule.dwell_s >= limit_s:
                raise ValueError(
                    f"target {each.key}: dwell_s: expected less than the limit of {limit_s:g} s, in which the target "
                    f"could never be reached, got {each.rule.dwell_s:g}"
                )


def unit(name: str, vector: FloatArray) -> FloatArray:
    """Return a direction (3,) as a read-only unit vector.

    Raises:
        ValueError: it has no length, or is not three finite numbers.
    """
    values = checked(name, vector, (3,))
    length = float(np.linalg.norm(values))
    if not length > 1e-9:
        raise ValueError(f"{name}: expected a direction, got a vector of length 0")
    return checked(name, values if abs(length - 1.0) < 1e-15 else values / length, (3,))


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name}: expected a positive number, got {value}")


def _limits(angle_deg: float | None, dwell_s: float, range_mm: float | None) -> None:
    if angle_deg is not None and not 0 < angle_deg <= 180:
        raise ValueError(f"angle: expected more than 0 and up to 180 degrees, got {angle_deg}")
    if not (math.isfinite(dwell_s) and dwell_s >= 0):
        raise ValueError(f"dwell_s: expected a number of at least 0, got {dwell_s}")
    if range_mm is not None:
        _positive("range_mm", range_mm)
