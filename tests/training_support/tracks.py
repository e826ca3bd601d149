"""Tracks made by hand."""

from collections.abc import Iterable, Sequence

import numpy as np

from cathxr.core import FloatArray, Pose, Status, Track
from cathxr.training.placing import PlacedTarget, PlacedTask

MS = 1_000_000


def track(
    t_ns: int,
    tip: Sequence[float] | FloatArray | None,
    *,
    rotation: FloatArray | None = None,
    roll_rad: float | None = 0.0,
    status: Status = Status.TRACKED,
    seq: int = 0,
) -> Track:
    """Return a Track with its tip there; None: lost."""
    if tip is None:
        return Track(seq, t_ns, Status.LOST, "no catheter")
    turned = np.column_stack([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]) if rotation is None else rotation
    end = np.asarray(tip, dtype=np.float64)
    shape = np.stack([end, end - 20.0 * turned[:, 2]])
    reason = "" if status is Status.TRACKED else "hidden"
    return Track(seq, t_ns, status, reason, shape, Pose.from_matrix(turned, end), roll_rad, 0.1)


def tracks(tips: Iterable[Sequence[float] | None], *, step_ms: int = 20, start_ms: int = 0) -> list[Track]:
    """Return one Track for each tip, at even steps."""
    return [track((start_ms + i * step_ms) * MS, tip, seq=i) for i, tip in enumerate(tips)]


def tip_target(key: str, place: Sequence[float], *, radius: float = 5.0, dwell_s: float = 0.1) -> PlacedTarget:
    """Return a target for the tip."""
    return PlacedTarget(key, key, "tip", np.array(place, dtype=np.float64), radius, dwell_s=dwell_s)


def placed(*targets: PlacedTarget, limit_s: float = 10.0, **more: object) -> PlacedTask:
    """Return a task of these targets."""
    return PlacedTask("task", "Task", "free", limit_s, targets, **more)
