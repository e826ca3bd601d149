"""How the rendered catheters move: centrelines that bend by a given curvature at each arc length."""

from collections.abc import Callable

import numpy as np

from cathxr.core import FloatArray

STEP_MM = 0.25
STRAIGHT_MM = 25.0
"""How much of the catheter, straight, lies before the inlet."""
PERIOD_S = 10 / 3
"""Time in which a manoeuvre runs from its beginning to its end."""

Bend = Callable[[float], tuple[float, float]]
"""Curvature about two directions across, 1/mm, at an arc length from the tip, mm."""

_TURN = 2.0 * np.pi


def centreline(length_mm: float, bend: Bend, yaw: float = 0.0, pitch: float = 0.0) -> FloatArray:
    """Return points (N, 3), mm in `box`, every STEP_MM, proximal first, through the inlet at the origin.

    yaw, pitch: the direction in which it leaves the inlet, rad from +x. In a frame that does not twist.
    """
    total = length_mm + STRAIGHT_MM
    point = np.array([-STRAIGHT_MM, 0.0, 0.0])
    frame = np.eye(3)  # columns: tangent, and two directions across
    inlet = round(STRAIGHT_MM / STEP_MM)
    points = []
    for index in range(round(total / STEP_MM) + 1):
        points.append(point)
        if index == inlet:
            frame = _turned(np.array([0.0, -pitch, yaw])) @ frame
        first, second = bend(total - index * STEP_MM) if index > inlet else (0.0, 0.0)
        turn = (first * frame[:, 2] - second * frame[:, 1]) * STEP_MM
        point = point + STEP_MM * (_turned(0.5 * turn) @ frame[:, 0])
        frame = _turned(turn) @ frame
    return np.array(points)


def moving(motion: str, time_s: float, phase: float = 0.0) -> FloatArray:
    """Return the centreline at a time: (N, 3), mm, the last point in the middle of the rounded end.

    phase: where in its manoeuvre it begins, of one.
    """
    return _MOTIONS[motion](time_s / PERIOD_S + phase)


def _sweep(u: float) -> FloatArray:
    length = 70.0 + 30.0 * np.sin(0.9 * _TURN * u)
    strength, plane = np.sin(1.3 * _TURN * u + 0.5) / 28.0, 0.8 * _TURN * u
    return centreline(length, _plane(45.0, strength, plane), yaw=0.06 * np.sin(5.0 * u), pitch=-0.05)


def _quick(u: float) -> FloatArray:
    length = 85.0 + 8.0 * np.sin(4.0 * _TURN * u)
    return centreline(length, _plane(45.0, np.sin(3.3 * _TURN * u) / 45.0, 1.1 * _TURN * u))


def _curl(u: float) -> FloatArray:
    return centreline(88.0, _plane(47.0, 0.1 * min(1.0, 0.15 + 3.3 * u), 0.4 + 8.0 * u))


def _camera(u: float) -> FloatArray:
    strength, plane = (0.6 + 0.4 * np.sin(5.0 * _TURN * u)) / 16.0, 0.5 * np.pi + 0.8 * np.sin(3.3 * _TURN * u)
    return centreline(80.0, _plane(26.0, strength, plane))


def _cross(u: float) -> FloatArray:
    strength = min(1.0, 0.3 + 3.3 * u) / 13.0
    plane = 0.3 + 1.6 * _TURN * u

    def bend(from_tip: float) -> tuple[float, float]:
        here = plane + 0.009 * (from_tip - 40.0)
        return (strength * np.cos(here), strength * np.sin(here)) if from_tip < 80.0 else (0.001, 0.0)

    return centreline(120.0, bend)


_MOTIONS = {"sweep": _sweep, "quick": _quick, "curl": _curl, "camera": _camera, "cross": _cross}


def _plane(flexible_mm: float, strength: float, plane: float) -> Bend:
    """Return a bend of one curvature in one plane over the flexible end, and nearly none before it."""

    def bend(from_tip: float) -> tuple[float, float]:
        return (strength * np.cos(plane), strength * np.sin(plane)) if from_tip < flexible_mm else (0.001, 0.0015)

    return bend


def _turned(vector: FloatArray) -> FloatArray:
    """Return the rotation matrix of a rotation vector (3,), rad, by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
