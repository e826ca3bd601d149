"""A Task put into the box: every target as numbers in `box`, mm, and as a mapping for recordings."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from cathxr.core import ConfigError, FloatArray, Roi
from cathxr.core.arrays import checked
from cathxr.training.task import Plane, Reach, Target, Task, unit

_LEAST_ASIDE_MM = 1.0


@dataclass(frozen=True, eq=False)
class PlacedTarget:
    """A target in `box`. kind "tip" or "beam": see `Reach`; "plane": see `Plane`. A limit that is None does not limit.

    point_box (3,) mm; direction_box (3,): the wanted axis of the tip ("tip") or the plane's normal ("plane");
    up_box (3,): the wanted beam ("plane"). distance_mm: the greatest distance (radius or offset).
    """

    key: str
    name: str
    kind: Literal["tip", "beam", "plane"]
    point_box: FloatArray
    distance_mm: float
    angle_deg: float | None = None
    up_deg: float | None = None
    range_mm: float | None = None
    dwell_s: float = 0.0
    direction_box: FloatArray | None = None
    up_box: FloatArray | None = None

    def __post_init__(self) -> None:
        for name in ("point_box", "direction_box", "up_box"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, checked(name, value, (3,)))


@dataclass(frozen=True, eq=False)
class PlacedTask:
    """A task whose targets are placed. sha256: of what the task said (`task_sha256`), "" where unknown."""

    key: str
    name: str
    view: str
    limit_s: float
    targets: tuple[PlacedTarget, ...]
    target_limit_s: float | None = None
    in_a_row: int | None = None
    sha256: str = ""

    def target(self, key: str) -> PlacedTarget:
        """Return the target of that key. Raises ValueError where there is none."""
        for each in self.targets:
            if each.key == key:
                return each
        raise ValueError(f"{key}: expected one of {', '.join(each.key for each in self.targets)}")


def place_task(
    task: Task,
    *,
    ct_from_box: FloatArray,
    points_ct: Mapping[str, FloatArray],
    roi: Roi,
    sha256: str = "",
) -> PlacedTask:
    """Return the task with its targets in `box`.

    ct_from_box (4, 4): the registration's matrix, scale and stretch included. points_ct: the heart's named points (3,)
    mm in `ct`. A target to be touched by the tip must lie in the ROI; one that is only looked at may lie outside.

    Raises:
        ConfigError: an unknown landmark, a target for the tip outside the ROI, or a plane without a direction.
    """
    box_from_ct = np.asarray(np.linalg.inv(checked("ct_from_box", ct_from_box, (4, 4))), dtype=np.float64)
    places = _Places(task, box_from_ct, points_ct)
    targets = tuple(places.placed(each) for each in task.targets)
    for each in targets:
        inside = bool((each.point_box >= roi.min_mm).all() and (each.point_box <= roi.max_mm).all())
        if each.kind == "tip" and not inside:
            x, y, z = each.point_box
            raise ConfigError(
                f"Task {task.key}: target {each.key} lies at ({x:.1f}, {y:.1f}, {z:.1f}) mm in the box, outside the "
                "region of interest, where the tip cannot be seen; choose another place or another registration."
            )
    practice = task.practice
    return PlacedTask(
        key=task.key,
        name=task.name,
        view=task.view,
        limit_s=task.limit_s if practice is None else practice.limit_s,
        targets=targets,
        target_limit_s=task.target_limit_s,
        in_a_row=None if practice is None else practice.in_a_row,
        sha256=sha256,
    )


class _Places:
    """Puts the targets of one task into the box."""

    def __init__(self, task: Task, box_from_ct: FloatArray, points_ct: Mapping[str, FloatArray]) -> None:
        self._task, self._box_from_ct, self._points_ct = task, box_from_ct, points_ct

    def placed(self, target: Target) -> PlacedTarget:
        """Return the target in `box`."""
        place, rule = target.place, target.rule
        if place.position_box_mm is not None:
            point = place.position_box_mm
        elif place.position_ct_mm is not None:
            point = self._box(place.position_ct_mm)
        else:
            point = np.mean([self._landmark(target, key) for key in place.landmarks], axis=0)
        if isinstance(rule, Reach):
            return PlacedTarget(
                target.key,
                target.name,
                rule.by,
                point,
                rule.radius_mm,
                angle_deg=rule.angle_deg,
                range_mm=rule.range_mm,
                dwell_s=rule.dwell_s,
                direction_box=rule.direction_box,
            )
        normal, up = self._plane(target, rule, point)
        return PlacedTarget(
            target.key,
            target.name,
            "plane",
            point,
            rule.offset_mm,
            angle_deg=rule.angle_deg,
            up_deg=rule.up_deg,
            range_mm=rule.range_mm,
            dwell_s=rule.dwell_s,
            direction_box=normal,
            up_box=up,
        )

    def _plane(self, target: Target, rule: Plane, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the plane's normal and the beam's direction, both (3,) in `box`."""
        if rule.axis is None:
            assert rule.normal_box is not None
            assert rule.up_box is not None
            return rule.normal_box, rule.up_box
        first, second = (self._landmark(target, key) for key in rule.axis)
        if np.linalg.norm(second - first) < _LEAST_ASIDE_MM:
            raise ConfigError(f"Task {self._task.key}: target {target.key}: the two landmarks of its axis coincide.")
        axis = unit("axis", second - first)
        aside = point - first - ((point - first) @ axis) * axis
        if np.linalg.norm(aside) < _LEAST_ASIDE_MM:
            raise ConfigError(
                f"Task {self._task.key}: target {target.key} lies on the axis of its plane, so that there is no "
                "direction; choose a place beside it."
            )
        up = unit("up", aside)
        # The tip frame has z along the catheter, x along the beam and y = z × x as the image plane's normal.
        return unit("normal", np.cross(axis, up)), up

    def _landmark(self, target: Target, key: str) -> FloatArray:
        if key not in self._points_ct:
            known = ", ".join(sorted(self._points_ct)) or "none"
            raise ConfigError(
                f"Task {self._task.key}: target {target.key} names the landmark {key}, which this heart does not have; "
                f"it has {known}."
            )
        return self._box(self._points_ct[key])

    def _box(self, point_ct: FloatArray) -> FloatArray:
        return np.asarray(self._box_from_ct[:3, :3] @ point_ct + self._box_from_ct[:3, 3])


_ARRAYS = ("point_box", "direction_box", "up_box")


def placed_mapping(placed: PlacedTask) -> dict[str, Any]:
    """Return a placed task for JSON, exact to the last bit; `placed_from_mapping` is the inverse."""
    fields = {name: value for name, value in vars(placed).items() if name != "targets"}
    return fields | {"targets": [_target_mapping(each) for each in placed.targets]}


def _target_mapping(target: PlacedTarget) -> dict[str, Any]:
    return {
        name: value.tolist() if name in _ARRAYS and value is not None else value for name, value in vars(target).items()
    }


def placed_from_mapping(values: Mapping[str, Any]) -> PlacedTask:
    """Return the placed task that `placed_mapping` gave.

    Raises:
        ValueError, KeyError, TypeError: it is none.
    """
    return PlacedTask(**{**values, "targets": tuple(_target_from(each) for each in values["targets"])})


def _target_from(values: Mapping[str, Any]) -> PlacedTarget:
    fields: dict[str, Any] = dict(values)
    for name in _ARRAYS:
        if fields.get(name) is not None:
            fields[name] = np.array(fields[name], dtype=np.float64)
    return PlacedTarget(**fields)
