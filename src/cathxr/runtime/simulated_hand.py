"""A simulated person's hand: looks, moves, ends a little beside, looks again. Every effect comes out of its movements.

A movement ends beside its goal by a share of its length, as aimed movements do (Schmidt and others 1979, Psychol Rev
86:415), so that a far target takes several; each takes a time that grows with its length, along a minimum-jerk path
(Flash and Hogan 1985, J Neurosci 5:1688). None of the numbers is measured on people.
"""

from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray
from cathxr.runtime.simulated_aim import controls_for
from cathxr.training import PlacedTask, TrialState
from cathxr.twin.kinematics import CatheterBody
from cathxr.twin.world import CONTROL_RANGES

REST = (30.0, 0.0, 0.0, 0.0)
"""Where every trial begins: insertion mm, roll, anterior, left, deg."""
_SPEED = np.array([22.0, 90.0, 60.0, 60.0])
"""How fast each control is moved, a second: at most 1.9 times that in the middle of a movement."""
_LEAST_S = 0.4
_TREMBLE = np.array([0.8, 2.0, 2.0, 2.0])


@dataclass(frozen=True)
class Skill:
    """How a person moves in a trial. pace: times of moves and looks, 1 is usual. look_s: before each movement, typical.

    aside: standard deviation of a movement's end, as a share of its length.
    """

    pace: float = 1.0
    look_s: float = 0.7
    aside: float = 0.22


@dataclass(frozen=True, eq=False)
class _Move:
    start_s: float
    lasts_s: float
    origin: FloatArray
    goal: FloatArray

    def at(self, t_s: float) -> FloatArray:
        share = min(max((t_s - self.start_s) / self.lasts_s, 0.0), 1.0)
        return self.origin + share**3 * (10.0 - 15.0 * share + 6.0 * share**2) * (self.goal - self.origin)


class SteeringHand:
    """Gives the setpoints of the twin's controls from what a trial's state shows. For one trial."""

    def __init__(self, body: CatheterBody, placed: PlacedTask, skill: Skill, rng: np.random.Generator) -> None:
        self._body, self._placed, self._skill, self._rng = body, placed, skill, rng
        self._at = np.array(REST)
        self._offered: tuple[int, str] | None = None
        self._wanted = self._at
        self._move: _Move | None = None
        self._looks_until_s = 0.0

    def setpoints(self, t_s: float, state: TrialState) -> FloatArray:
        """Return the setpoints (4,) at an instant, for what was seen then."""
        if state.target is None:
            return self._at
        if (state.number, state.target) != self._offered:
            self._offered = (state.number, state.target)
            self._wanted = controls_for(self._body, self._placed.target(state.target), self._at)
            self._move = None
            self._look(t_s)
        inside = state.progress > 0.0 or self._is_in(state)
        if self._move is not None:
            self._at = self._move.at(t_s)
            if t_s >= self._move.start_s + self._move.lasts_s:
                self._move = None
                self._look(t_s)
        elif not inside and t_s >= self._looks_until_s:
            self._move = self._aimed(t_s)
        return self._at

    def _is_in(self, state: TrialState) -> bool:
        assert state.target is not None
        target = self._placed.target(state.target)
        return target.kind == "tip" and state.distance_mm is not None and state.distance_mm < target.distance_mm

    def _look(self, t_s: float) -> None:
        self._looks_until_s = t_s + self._skill.pace * self._skill.look_s * float(self._rng.lognormal(0.0, 0.4))

    def _aimed(self, t_s: float) -> _Move:
        """Return the next movement: towards the wanted controls, and beside them."""
        way = self._wanted - self._at
        beside = self._skill.aside * (np.abs(way) * self._rng.normal(size=4) + _TREMBLE * self._rng.normal(size=4))
        low, high = np.array(list(CONTROL_RANGES.values())).T
        goal = np.clip(self._wanted + beside, low, high)
        lasts_s = self._skill.pace * (_LEAST_S + float(np.max(np.abs(goal - self._at) / _SPEED)))
        return _Move(t_s, lasts_s, self._at.copy(), goal)
