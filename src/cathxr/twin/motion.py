"""Trajectories of the four controls: value, rate and acceleration as functions of time, all of them continuous."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cathxr.core import FloatArray


class Motion(Protocol):
    """A trajectory of the controls."""

    def at(self, t_s: float) -> FloatArray:
        """Return (3, 4): value, rate (1/s) and acceleration (1/s²) of the controls (mm, deg, deg, deg)."""
        ...


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A base (4,) plus J sine waves per control: amplitude, pulsation (rad/s), phase (rad), each (J, 4)."""

    base: FloatArray
    amplitude: FloatArray
    pulsation: FloatArray
    phase: FloatArray

    @classmethod
    def held(cls, values: FloatArray) -> "Harmonics":
        """Return the motion that stays at `values` (4,)."""
        none = np.zeros((0, 4))
        return cls(np.asarray(values, dtype=np.float64), none, none, none)

    def at(self, t_s: float) -> FloatArray:
        """Return (3, 4); see `Motion`."""
        angle = self.pulsation * t_s + self.phase
        sine, cosine = self.amplitude * np.sin(angle), self.amplitude * np.cos(angle)
        return np.stack(
            [
                self.base + sine.sum(axis=0),
                (self.pulsation * cosine).sum(axis=0),
                -(self.pulsation * self.pulsation * sine).sum(axis=0),
            ]
        )


@dataclass(frozen=True, eq=False)
class Modulated:
    """A base (4,) plus one wave per control whose frequency itself swings, so that no stretch of it looks like another.

    amplitude (4,); pulsation (4,) rad/s, its mean; depth (4,): the swing's share of it, under 1; swing (4,) rad/s, the
    swing's own pulsation; phase (4,) rad.
    """

    base: FloatArray
    amplitude: FloatArray
    pulsation: FloatArray
    depth: FloatArray
    swing: FloatArray
    phase: FloatArray

    def at(self, t_s: float) -> FloatArray:
        """Return (3, 4); see `Motion`."""
        turn = self.swing * t_s
        lead = self.depth * self.pulsation
        angle = self.pulsation * t_s - lead / self.swing * np.cos(turn) + self.phase
        rate = self.pulsation + lead * np.sin(turn)
        change = lead * self.swing * np.cos(turn)
        sine, cosine = self.amplitude * np.sin(angle), self.amplitude * np.cos(angle)
        return np.stack([self.base + sine, rate * cosine, change * cosine - rate * rate * sine])


@dataclass(frozen=True, eq=False)
class Follow:
    """A goal's motion plus an offset that dies away like a critically damped third-order system.

    The offset's value, rate and acceleration at start_s make up what the goal lacks, so a change of goal is smooth to
    the second derivative. stiffness (4,) 1/s.
    """

    goal: Motion
    start_s: float
    stiffness: FloatArray
    coefficients: FloatArray

    @classmethod
    def towards(
        cls, goal: Motion, *, start_s: float, state: FloatArray, stiffness: float, rate_limits: FloatArray
    ) -> "Follow":
        """Return the motion that leaves `state` (3, 4) at start_s for `goal`.

        rate_limits (4,) 1/s: from rest the offset is never made up faster (its peak rate is 0.27 times stiffness times
        offset); `stiffness` 1/s is the greatest used.
        """
        offset = state - goal.at(start_s)
        largest = np.maximum(np.abs(offset[0]), 1e-9)
        stiff = np.minimum(stiffness, rate_limits / (2.0 * np.exp(-2.0) * largest))
        coefficients = np.stack(
            [
                offset[0],
                offset[1] + stiff * offset[0],
                0.5 * (offset[2] + 2.0 * stiff * offset[1] + stiff * stiff * offset[0]),
            ]
        )
        return cls(goal, start_s, stiff, coefficients)

    def at(self, t_s: float) -> FloatArray:
        """Return (3, 4); see `Motion`."""
        since = t_s - self.start_s
        decay = np.exp(-self.stiffness * since)
        c0, c1, c2 = self.coefficients
        value = c0 + since * (c1 + since * c2)
        slope = c1 + 2.0 * since * c2
        offset = np.stack(
            [
                value,
                slope - self.stiffness * value,
                2.0 * c2 - 2.0 * self.stiffness * slope + self.stiffness**2 * value,
            ]
        )
        return np.asarray(self.goal.at(t_s) + decay * offset, dtype=np.float64)
