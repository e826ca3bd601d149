"""A simulated hand at a simulated gearbox: to try `calibrate roll` without hardware, with a truth to compare with."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cathxr.core import Clock, Roll
from cathxr.wire.calibration_messages import RollStep

_NS = 1_000_000_000
_GEARS = (1.0, 1.5, 2.0, 2.5, 3.0)
_SEAT_DEG = 0.1
_REACTION_S = 0.2
"""Less than a count must rest to be still: else a step could be confirmed before the hand begins with it."""
_MOVE_S = 1.6
_TURN_S = 4.0
_STROKE_S = 0.8
_PUSH = 1.5
_ELASTIC_DEG = 0.01
_SHORT_EVERY = 7
_MIDDLE, _FULL_TURN = 0.5, 360.0

_Stance = tuple[float, float]
"""The catheter's gear and the encoder's, both in degrees of the catheter."""


@dataclass(frozen=True)
class HandTruth:
    """What the calibration has to find out. backlash_deg: full width, at the catheter."""

    backlash_deg: float
    counts_per_turn: float
    gear_ratio: float
    direction: int

    @property
    def counts_per_degree(self) -> float:
        """Encoder counts for one degree of the catheter."""
        return self.counts_per_turn * self.gear_ratio / _FULL_TURN


def hand_truth(roll: Roll, seed: int) -> HandTruth:
    """Return the truth of a seed: play that no rig states, and gears as the rig says (even seeds) or others (odd)."""
    rng = np.random.default_rng([seed, 0x207])
    backlash = float(rng.uniform(0.25, 0.6))
    if seed % 2 == 0:
        return HandTruth(backlash, roll.counts_per_turn, roll.gear_ratio, roll.direction)
    others = [each for each in _GEARS if abs(each / roll.gear_ratio - 1.0) > 0.1]
    gear = float(rng.choice(others))
    return HandTruth(backlash, roll.counts_per_turn, gear, int(rng.choice([-1, 1])))


class SimulatedHand:
    """Turns the gears as a person does who follows the steps; `count_at` is the encoder's count at an instant.

    The encoder's gear stays within half the play of the catheter's. `begin` has a step done, from now on.
    """

    def __init__(self, truth: HandTruth, *, seed: int, clock: Clock) -> None:
        self.truth = truth
        self._clock = clock
        self._rng = np.random.default_rng([seed, 0x41D])
        self._half = _MIDDLE * truth.backlash_deg
        self._phase = float(self._rng.uniform(0.0, 1000.0))
        gear = float(self._rng.uniform(-60.0, -20.0))
        start: _Stance = (gear, gear + float(self._rng.uniform(-self._half, self._half)))
        self._parts: list[tuple[int, Callable[[float], _Stance]]] = [(-(1 << 62), lambda s: start)]

    def count_at(self, t_ns: int) -> int:
        """Return the encoder's count at an instant of the clock."""
        _, encoder = self._stance(t_ns)
        return math.floor(self.truth.direction * self.truth.counts_per_degree * encoder + self._phase)

    def angle_deg(self, t_ns: int) -> float:
        """Return the catheter's true angle at an instant; 0, and every whole turn, is mark T in the jig."""
        return self._stance(t_ns)[0]

    def begin(self, step: RollStep) -> None:
        """Do a step, from now on."""
        now_ns = self._clock.now_ns()
        gear, encoder = self._stance(now_ns)
        if step == "zero":
            part = self._turned(gear, encoder, to=self._seat(round(gear / _FULL_TURN)), seconds=_MOVE_S)
        elif step == "turn":
            part = self._turned(gear, encoder, to=self._seat(round(gear / _FULL_TURN) + 1), seconds=_TURN_S)
        elif step == "backlash":
            part = self._rocked(gear, encoder)
        else:
            part = _resting(gear, encoder)
        self._parts.append((now_ns, part))

    def _stance(self, t_ns: int) -> _Stance:
        begun_ns, part = next(each for each in reversed(self._parts) if each[0] <= t_ns)
        return part((t_ns - begun_ns) / _NS)

    def _seat(self, turns: int) -> float:
        """Return where the jig holds the gear this time."""
        return turns * _FULL_TURN + float(self._rng.normal(0.0, _SEAT_DEG))

    def _turned(self, gear: float, encoder: float, *, to: float, seconds: float) -> Callable[[float], _Stance]:
        def part(s: float) -> _Stance:
            u = min(1.0, max(0.0, (s - _REACTION_S) / seconds))
            at = gear + (to - gear) * u**3 * (10.0 + u * (6.0 * u - 15.0))  # minimum jerk
            taken = max(encoder, at - self._half) if to > gear else min(encoder, at + self._half)
            return at, taken

        return part

    def _rocked(self, gear: float, encoder: float) -> Callable[[float], _Stance]:
        """Have a finger push the encoder's gear from stop to stop; now and then it turns back half-way."""
        elastic = np.abs(self._rng.normal(0.0, _ELASTIC_DEG, 64))

        def part(s: float) -> _Stance:
            if s < _REACTION_S:
                return gear, encoder
            stroke, share = divmod((s - _REACTION_S) / _STROKE_S, 1.0)
            push = math.sin(math.pi * share) * (0.5 if stroke % _SHORT_EVERY == _SHORT_EVERY - 1 else _PUSH)
            reach = self._half + (float(elastic[int(stroke) % len(elastic)]) if push > 1.0 else 0.0)
            side = 1.0 if stroke % 2 else -1.0
            return gear, gear + side * min(push * self._half, reach)

        return part


def _resting(gear: float, encoder: float) -> Callable[[float], _Stance]:
    return lambda s: (gear, encoder)
