"""A steerable catheter: from four controls to its centreline in the box.

The centreline starts at the inlet (x = 0) and has a smooth curvature profile: a distal section that the two flexion
controls bend evenly, a body with a gentle bend of its own, a stiff straight end. The inlet holds the catheter straight,
so curvature grows from zero over the first millimetres outside it. Both bends are fixed to the catheter and so turn
with the roll. Frames are carried by parallel transport (Bishop), which is exact for each integration step's arc.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from cathxr.core import FloatArray, Pose
from cathxr.geometry.pose import frame_from_tangent, turned_about_z

STEP_MM = 0.25
_END_MM = 5.0
_BEND_MM = 52.0
_RAMP_MM = 8.0
_GUIDE_MM = 6.0


@dataclass(frozen=True)
class Controls:
    """What a hand sets. Flexion is that of the free distal section: anterior towards the beam x, left towards z × x."""

    insertion_mm: float
    roll_deg: float
    anterior_deg: float
    left_deg: float

    def array(self) -> FloatArray:
        """Return the four values (4,) in the order of the fields."""
        return np.array([self.insertion_mm, self.roll_deg, self.anterior_deg, self.left_deg])


@dataclass(frozen=True, eq=False)
class CatheterBody:
    """What one catheter in one inlet always has.

    radius_mm; entry_frame (3, 3): columns x (roll zero), y, z (insertion) in `box`; memory_per_mm (2,): curvature of
    the body towards the beam and to the left, 1/mm. torsion_per_mm, torsion_per_bend: twist of the tip's frame ahead of
    the handle, rad for each mm inserted and rad for each rad of bend.
    """

    radius_mm: float
    entry_frame: FloatArray
    memory_per_mm: FloatArray
    torsion_per_mm: float = 0.0
    torsion_per_bend: float = 0.0

    @classmethod
    def of(
        cls,
        *,
        radius_mm: float,
        tilt_rad: FloatArray,
        zero_direction: FloatArray,
        memory_per_mm: FloatArray,
        torsion_per_mm: float = 0.0,
        torsion_per_bend: float = 0.0,
    ) -> "CatheterBody":
        """Return a body that enters along +x tilted by (2,) rad towards +y and +z."""
        tangent = np.array([1.0, np.tan(tilt_rad[0]), np.tan(tilt_rad[1])])
        frame = frame_from_tangent(tangent, zero_direction)
        return cls(radius_mm, frame, memory_per_mm, torsion_per_mm, torsion_per_bend)

    @property
    def least_insertion_mm(self) -> float:
        """The shortest insertion that still shows the whole rounded end."""
        return self.radius_mm + 0.5


def centreline(body: CatheterBody, controls: Controls, *, points: int) -> tuple[FloatArray, Pose]:
    """Return the centreline (points, 3) mm in `box`, **tip first**, uniform in arc length, and box_from_tip.

    Its arc length is the insertion; steps are at most STEP_MM long.
    """
    between = max(1, int(np.ceil(controls.insertion_mm / STEP_MM / (points - 1))))
    path, frame = _path(body, controls, length=controls.insertion_mm, steps=between * (points - 1))
    box_from_tip = Pose.from_matrix(turned_about_z(frame, np.deg2rad(controls.roll_deg)), path[-1])
    return np.ascontiguousarray(path[::-between]), box_from_tip


def sphere_path(body: CatheterBody, controls: Controls, *, steps: int, behind_mm: float) -> FloatArray:
    """Return the centres (steps + 2, 3) mm in `box` of the ball that sweeps out the catheter, **from the inlet on**.

    The first lies `behind_mm` straight behind the entry; the last is one radius before the tip, so that the ball there
    makes the rounded end.
    """
    path, _ = _path(body, controls, length=controls.insertion_mm - body.radius_mm, steps=steps)
    behind = path[0] - behind_mm * body.entry_frame[:, 2]
    return np.concatenate([behind[None], path])


def _path(body: CatheterBody, controls: Controls, *, length: float, steps: int) -> tuple[FloatArray, FloatArray]:
    """Return points (steps + 1, 3) from the entry on and the frame (3, 3) at the last: transported, then twisted."""
    roll = np.deg2rad(controls.roll_deg)
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    flexion = turn @ np.deg2rad([controls.anterior_deg, controls.left_deg])
    memory = turn @ body.memory_per_mm
    path = np.empty((steps + 1, 3))
    frame = body.entry_frame.copy()
    bend = _integrate(path, frame, length, controls.insertion_mm, flexion, memory, max(_END_MM, body.radius_mm))
    torsion = body.torsion_per_mm * length + body.torsion_per_bend * bend
    return path, frame if torsion == 0.0 else turned_about_z(frame, torsion)


@njit(cache=True, nogil=True)
def _ramp(x: float) -> float:
    """0 below 0, 1 above 1, with two continuous derivatives between."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@njit(cache=True, nogil=True)
def _integrate(path, frame, length, insertion, flexion, memory, end_mm):  # type: ignore[no-untyped-def]
    """Fill `path`, carry `frame` (two normals, tangent) along it and return the whole bend, rad.

    Each step is an arc of its middle's curvature.
    """
    steps = path.shape[0] - 1
    whole = 0.0
    h = length / steps
    path[0] = 0.0
    for i in range(steps):
        s = (i + 0.5) * h
        u = insertion - s - end_mm
        held = _ramp(s / _GUIDE_MM)
        rest = _ramp((u - _BEND_MM + _RAMP_MM) / _RAMP_MM)
        bend = held * _ramp(u / _RAMP_MM) * (1.0 - rest) / (_BEND_MM - _RAMP_MM)
        k1 = bend * flexion[0] + held * rest * memory[0]
        k2 = bend * flexion[1] + held * rest * memory[1]
        k = np.sqrt(k1 * k1 + k2 * k2)
        angle = k * h
        if k > 1e-12:
            c1, c2 = k1 / k, k2 / k
            along, aside = np.sin(angle) / k, 2.0 * np.sin(0.5 * angle) ** 2 / k
        else:
            c1, c2, along, aside = 1.0, 0.0, h, 0.0
        sine, cosine = np.sin(angle), np.cos(angle)
        for j in range(3):
            tangent = frame[j, 2]
            towards = c1 * frame[j, 0] + c2 * frame[j, 1]
            path[i + 1, j] = path[i, j] + along * tangent + aside * towards
            change = (cosine - 1.0) * towards - sine * tangent
            frame[j, 0] += change * c1
            frame[j, 1] += change * c2
            frame[j, 2] = cosine * tangent + sine * towards
        whole += angle
    return whole
