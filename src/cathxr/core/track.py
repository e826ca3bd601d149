"""The waist of the hourglass: one Track per picture pair, and what rides beside it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from cathxr.core.arrays import FloatArray, checked
from cathxr.core.pose import Pose


class Status(StrEnum):
    """How far a Track can be trusted."""

    TRACKED = "tracked"
    COASTING = "coasting"
    LOST = "lost"


@dataclass(frozen=True, eq=False)
class Track:
    """The catheter at one instant.

    shape_box (K, 3) mm in `box`, tip first, entry last, uniform in arc length. box_from_tip: see Frames in
    ARCHITECTURE.md. roll_rad: unwrapped, None without a valid encoder; roll_predicted: see Observation. sigma_mm: root
    of the trace of the tip's covariance, calibration included. latency_ns: mid-exposure to Track, None offline. A lost
    track carries no pose.
    """

    seq: int
    t_ns: int
    status: Status
    reason: str = ""
    shape_box: FloatArray | None = None
    box_from_tip: Pose | None = None
    roll_rad: float | None = None
    sigma_mm: float | None = None
    latency_ns: int | None = None
    roll_predicted: bool = False

    def __post_init__(self) -> None:
        lost = self.status is Status.LOST
        absent = (self.shape_box is None, self.box_from_tip is None, self.sigma_mm is None)
        if any(each != lost for each in absent):
            raise ValueError(
                "Track: expected shape, pose and sigma on a tracked or coasting Track and none on a lost one"
            )
        if lost and self.roll_rad is not None:
            raise ValueError("Track: a lost Track carries no roll")
        if self.roll_predicted and self.roll_rad is None:
            raise ValueError("Track: expected a roll where one was predicted")
        if self.status is not Status.TRACKED and not self.reason:
            raise ValueError(f"Track: expected a reason with status {self.status.value}")
        if self.shape_box is not None:
            shape = checked("shape_box", self.shape_box, (None, 3))
            if len(shape) < 2:
                raise ValueError(f"shape_box: expected at least 2 points, got {len(shape)}")
            object.__setattr__(self, "shape_box", shape)
        if self.roll_rad is not None and not np.isfinite(self.roll_rad):
            raise ValueError(f"roll_rad: expected a finite number or None, got {self.roll_rad}")
        if self.sigma_mm is not None and not (np.isfinite(self.sigma_mm) and self.sigma_mm >= 0):
            raise ValueError(f"sigma_mm: expected a finite number of at least 0, got {self.sigma_mm}")

    @property
    def tip_box(self) -> FloatArray | None:
        """The tip (3,) mm in `box`, None when lost."""
        return None if self.shape_box is None else self.shape_box[0]

    @property
    def direction_box(self) -> FloatArray | None:
        """The tip's unit tangent (3,), pointing distally, in `box`, None when lost."""
        return None if self.box_from_tip is None else self.box_from_tip.rotation[:, 2]

    @property
    def yaw_rad(self) -> float | None:
        """atan2(dy, dx) of the tip's tangent, None when lost."""
        direction = self.direction_box
        return None if direction is None else float(np.arctan2(direction[1], direction[0]))

    @property
    def pitch_rad(self) -> float | None:
        """asin(dz) of the tip's tangent, None when lost."""
        direction = self.direction_box
        return None if direction is None else float(np.arcsin(np.clip(direction[2], -1.0, 1.0)))

    @property
    def length_mm(self) -> float | None:
        """Arc length from entry to tip, None when lost."""
        if self.shape_box is None:
            return None
        return float(np.linalg.norm(np.diff(self.shape_box, axis=0), axis=1).sum())


@dataclass(frozen=True)
class Event:
    """Something that happened: a command carried out, a recording begun, a target reached. The payload is JSON-able."""

    t_ns: int
    kind: str
    payload: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Health:
    """One source's state. age_s: since its last item (None: none yet). losses: items dropped or skipped so far."""

    t_ns: int
    source: str
    running: bool
    age_s: float | None
    rate_hz: float
    losses: int
    last_error: str | None = None
