"""When there is no fresh pose: coast for a moment on the last one, or say lost. One policy for every tracker."""

import math
from dataclasses import replace

import numpy as np

from cathxr.core import FloatArray, Observation, Pose, Status, Track
from cathxr.geometry.pose import turned_about_z

COAST_NS = 250_000_000
"""How long a Track may coast. A trainee's hand moves a tip at 50-150 mm/s, so a longer guess would mislead."""
COAST_SPEED_MM_S = 50.0
"""How fast the tip is taken to wander while unseen: it grows sigma_mm."""

FASTEST_MM_S = 150.0
NEAR_MM = 1.0
"""What a tip may have moved since it was last seen: by a quick hand, and a little."""


def missing_reason(observation: Observation) -> str | None:
    """Return why an observation brings no fresh picture of both views, None when it does.

    A view that repeats its last picture to the last bit brings no news: the camera, or its link, is frozen.
    """
    missing = [
        each.reason
        for each in observation.detections
        if each.reason is not None and each.reason.startswith("no picture")
    ]
    if missing:
        return missing[0]
    if len(observation.detections) < 2:
        return "no picture from one camera"
    frozen = [each.camera for each in observation.detections if each.repeats > 0]
    if len(frozen) == 1:
        return f"frozen picture from {frozen[0]}"
    return "frozen pictures" if frozen else None


class Continuity:
    """Remembers the last tracked Track. Missing pictures coast; pictures that show no catheter are lost at once."""

    def __init__(self) -> None:
        self._last: Track | None = None

    def tracked(self, track: Track) -> Track:
        """Return `track`, remembered as the last good one."""
        self._last = track
        return track

    def near(self, t_ns: int, tip_box: FloatArray) -> bool:
        """Return whether a tip (3,) mm lies where the last good one, not long ago, can have moved to."""
        last = self._last
        if last is None or last.tip_box is None or not 0 <= t_ns - last.t_ns <= COAST_NS:
            return False
        reach = NEAR_MM + FASTEST_MM_S * (t_ns - last.t_ns) * 1e-9
        return float(np.linalg.norm(tip_box - last.tip_box)) < reach

    def coasting(self, observation: Observation, reason: str) -> Track:
        """Return the last good pose, flagged and with a larger sigma, or a lost Track when it is too old.

        The roll is the observation's: the encoder goes on while pictures are missing, and may have become invalid.
        """
        last = self._last
        age_ns = observation.t_ns - last.t_ns if last is not None else 0
        if last is None or last.box_from_tip is None or last.sigma_mm is None or not 0 <= age_ns <= COAST_NS:
            return self.lost(observation, reason)
        sigma = math.hypot(last.sigma_mm, COAST_SPEED_MM_S * age_ns * 1e-9)
        turned_rad = (observation.roll_rad or 0.0) - (last.roll_rad or 0.0)
        return replace(
            last,
            seq=observation.seq,
            t_ns=observation.t_ns,
            status=Status.COASTING,
            reason=reason,
            box_from_tip=_turned(last.box_from_tip, turned_rad),
            roll_rad=observation.roll_rad,
            roll_predicted=observation.roll_predicted,
            sigma_mm=sigma,
        )

    def lost(self, observation: Observation, reason: str) -> Track:
        """Return a lost Track with its reason; what was remembered is dropped."""
        self._last = None
        return Track(seq=observation.seq, t_ns=observation.t_ns, status=Status.LOST, reason=reason)

    def reset(self) -> None:
        """Forget what came before."""
        self._last = None


def _turned(box_from_tip: Pose, angle_rad: float) -> Pose:
    """Return the pose after a turn of the tip about its own tangent."""
    if angle_rad == 0.0:
        return box_from_tip
    return Pose.from_matrix(turned_about_z(box_from_tip.rotation, angle_rad), box_from_tip.translation_mm)
