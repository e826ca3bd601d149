"""What the encoder of the simulated box would count: the catheter's roll through gears with some play."""

import numpy as np

from cathxr.core import Roll
from cathxr.twin.world import TwinWorld


class Gears:
    """The encoder's position in counts at instants that never go back. For one thread.

    roll: the gears as they are. play_deg: at the catheter, the settings' encoder_backlash_deg unless given; the gears
    follow only when it is used up, and start in its middle.
    """

    def __init__(self, world: TwinWorld, roll: Roll, *, play_deg: float | None = None) -> None:
        self._world, self._roll = world, roll
        self._half_rad = 0.5 * float(np.deg2rad(world.settings.encoder_backlash_deg if play_deg is None else play_deg))
        self._followed_rad: float | None = None

    def reset(self) -> None:
        """Stand in the middle of the play again."""
        self._followed_rad = None

    def count(self, t_ns: int) -> int:
        """Return the position after x4 decoding, with the rig's zero."""
        roll_rad = float(np.deg2rad(self._world.controls(t_ns).roll_deg))
        before = roll_rad if self._followed_rad is None else self._followed_rad
        self._followed_rad = min(max(before, roll_rad - self._half_rad), roll_rad + self._half_rad)
        per_rad = self._roll.direction * self._roll.counts_per_turn * self._roll.gear_ratio / (2.0 * np.pi)
        return int(np.floor(self._roll.zero_count + per_rad * self._followed_rad + 0.5))
