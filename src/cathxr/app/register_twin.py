"""The simulated hand of `cathxr register --touch --source twin`: puts the tip to each landmark of the heart."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cathxr.core import Clock, ConfigError, FloatArray, Pose, Rig
from cathxr.heart import HeartFolder
from cathxr.registration import Registration, caval_placement
from cathxr.twin import TwinWorld
from cathxr.twin.kinematics import CatheterBody
from cathxr.twin.phantom import reaching

_TURN_DEG, _SHIFT_MM = 6.0, 3.0
_HAND_STD_MM = 0.3
"""How far off a landmark the hand puts the tip, along each axis."""
_WIDEST_MM, _NEAREST_MM = 45.0, 12.0
_FEWEST = 4


@dataclass(frozen=True, eq=False)
class Touching:
    """Where the model truly is in the box, and the controls (4,) that put the tip to each landmark."""

    truth: Registration
    controls: Mapping[str, FloatArray]


def touching(world: TwinWorld, heart: HeartFolder, points_ct: Mapping[str, FloatArray], *, seed: int) -> Touching:
    """Return the simulated model's place by seed, and how to touch those points (3,) in `ct` that can be reached.

    Raises:
        ConfigError: the heart has no caval openings to place it by, or too few points can be reached.
    """
    rng = np.random.default_rng([seed, 0x7E57])
    truth = _truth(heart, rng)
    controls: dict[str, FloatArray] = {}
    for key, point in points_ct.items():
        place = truth.box(point) + rng.normal(0.0, _HAND_STD_MM, 3)
        if place[0] < _NEAREST_MM or np.hypot(place[1], place[2]) > _WIDEST_MM or not _is_inside(world.rig_true, place):
            continue
        found = _reached(world.body, place, key)
        if found is not None:
            controls[key] = found
    if len(controls) < _FEWEST:
        reached = ", ".join(controls) or "none"
        raise ConfigError(
            f"The simulated catheter reaches too few of this heart's landmarks ({reached}), {_FEWEST} are needed: "
            "leave --landmark out, or take the built-in heart (without --heart)."
        )
    return Touching(truth, controls)


class SimulatedHand:
    """Steers the twin's tip to a landmark when it is asked for."""

    def __init__(self, world: TwinWorld, controls: Mapping[str, FloatArray], *, clock: Clock) -> None:
        self._world, self._controls, self._clock = world, dict(controls), clock

    def go(self, key: str | None) -> None:
        """Begin to move to a landmark; None: stay."""
        if key is None:
            return
        insertion, roll, anterior, left = (float(each) for each in self._controls[key])
        self._world.steer(
            self._clock.now_ns(), insertion_mm=insertion, roll_deg=roll, anterior_deg=anterior, left_deg=left
        )


def comparison(found: Registration, truth: Registration, heart_ct: FloatArray) -> str:
    """Return how far off the heart (M, 3) in `ct` is registered, against the simulation's truth."""
    off = np.linalg.norm(found.ct(truth.box(heart_ct)) - heart_ct, axis=1)
    stated = "unknown" if found.worst_tre_mm is None else f"{found.worst_tre_mm:.2f} mm"
    rms = float(np.sqrt(np.mean(np.square(off))))
    return (
        f"The simulation's truth: over the heart the registration is {rms:.2f} mm off (root mean square), "
        f"{off.max():.2f} mm at worst; {stated} was predicted there (root mean square of many)."
    )


def _truth(heart: HeartFolder, rng: np.random.Generator) -> Registration:
    """Return where the simulated model is: the default placement, turned and moved a little."""
    placed = caval_placement(heart.points_ct, method="simulated")
    if placed is None:
        raise ConfigError(
            f"The heart {heart.path} names no openings inferior_vena_cava and superior_vena_cava to put it into the "
            "simulated box by: take another heart, or real cameras."
        )
    angle = np.deg2rad(_TURN_DEG) * rng.uniform(0.3, 1.0)
    axis = rng.normal(size=3)
    turn = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis / np.linalg.norm(axis)])
    moved = Pose(turn, rng.uniform(-_SHIFT_MM, _SHIFT_MM, 3))
    return Registration(placed.ct_from_box @ moved, placed.kind, placed.method)


def _is_inside(rig: Rig, place: FloatArray) -> bool:
    return bool((place >= rig.roi.min_mm).all() and (place <= rig.roi.max_mm).all())


def _reached(body: CatheterBody, place: FloatArray, key: str) -> FloatArray | None:
    try:
        return np.asarray(reaching(body, place[None], names=[key])[0])
    except ConfigError:
        return None
