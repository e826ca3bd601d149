"""From encoder counts to the roll at the gearbox, and from there to the tip: the play of the gears, and torsion."""

import math

import numpy as np

from cathxr.core import FloatArray, Roll
from cathxr.geometry.curves import arc_length, resampled, tangents

_HYSTERESIS_COUNTS = 2.0
"""How far the encoder has to go back before that counts as turning back: what jitter of one count each way spans."""
_GLIDE = 0.5
"""Over which share of the play the estimate then goes from one side of it to the other."""
_BEND_STEP_MM = 5.0
"""Spacing of the tangents whose turning is summed up: finer ones would sum up the noise of the points."""


class RollFollower:
    """Takes the play of the gears out of encoder counts. Give it every reading of one encoder, in order.

    The catheter drives the encoder through gears with a play of b = `roll.backlash_deg` (full width, at the catheter).
    `Roll.angle_rad` is the middle of the play, so the truth lies within b/2 of it; while the catheter turns, the gears
    touch on one side, and the truth is b/2 ahead. So the estimate is the middle plus or minus b/2 by the direction in
    which the encoder last moved. When it moves back, that is ignored for two counts, which is what jitter at rest may
    do, and then the estimate glides to the other side while the encoder moves by another b/2. The estimate is a
    continuous function of the counts' path, does not depend on time, and starts in the middle, where neither side is
    known. Without backlash it is Roll.angle_rad to the last bit.

    Two play operators in series do this (Krasnosel'skii, Pokrovskii: Systems with Hysteresis, 1989): `_held` follows
    the count at up to h/2, `_trail` follows `_held` at up to g/2; the offset is b/g of the distance between these two.
    """

    def __init__(self, roll: Roll) -> None:
        self._roll = roll
        self._half_play = 0.5 * (roll.backlash_deg or 0.0) / 360.0 * roll.counts_per_turn * roll.gear_ratio
        self._half_glide = _GLIDE * self._half_play
        self._held: float | None = None
        self._trail = 0.0
        self._offset = 0.0

    def reset(self) -> None:
        """Forget which way the encoder last moved: it begins anew, maybe with another count."""
        self._held, self._offset = None, 0.0

    def corrected(self, count: float) -> float:
        """Return the count with the play taken out: Roll.angle_rad turns it into the roll."""
        if self._half_play == 0.0:
            return count
        if self._held is None:
            self._held = self._trail = count
        half = 0.5 * _HYSTERESIS_COUNTS
        self._held = min(max(self._held, count - half), count + half)
        self._trail = min(max(self._trail, self._held - self._half_glide), self._held + self._half_glide)
        self._offset = self._half_play * (self._held - self._trail) / self._half_glide
        return count + self._offset

    def angle_rad(self, count: float) -> float:
        """Return the unwrapped roll for an encoder count, radians, right-handed about the insertion direction."""
        return self._roll.angle_rad(self.corrected(count))

    @property
    def uncertainty_rad(self) -> float:
        """How far the truth may be from the last estimate, by the play and half a count: from b/2 up to b, radians.

        A bound, not a standard deviation. It is reached while a turn back has not moved the encoder yet, which no
        count can tell; while the catheter goes on turning in its direction the error is that of the count alone.
        """
        counts = self._half_play + abs(self._offset) + 0.5
        return abs(self._roll.angle_rad(self._roll.zero_count + counts))


def torsion_rad(roll: Roll, *, length_mm: float, bend_rad: float) -> float:
    """Return by how much the catheter is twisted between gearbox and tip, radians, right-handed about its tangent.

    Linear in both: `roll.torsion_deg_per_mm` times the inserted length, plus `roll.torsion_deg_per_quarter_bend` for
    each 90 degrees of bend (`bend_rad` is the whole of it, whichever way it goes). Without these: 0.
    """
    along = (roll.torsion_deg_per_mm or 0.0) * length_mm
    around = (roll.torsion_deg_per_quarter_bend or 0.0) * bend_rad / (0.5 * math.pi)
    return math.radians(along + around)


def total_bend_rad(shape_box: FloatArray) -> float:
    """Return the integral of the curvature along a centreline (K, 3) mm, radians: 0 when straight, never negative.

    Raises:
        ValueError: fewer than two points, or a curve without length.
    """
    steps = max(2, round(float(arc_length(shape_box)[-1]) / _BEND_STEP_MM))
    along = tangents(resampled(shape_box, steps + 1))
    turn = np.linalg.norm(np.cross(along[:-1], along[1:]), axis=1)
    return float(np.arctan2(turn, np.einsum("ij,ij->i", along[:-1], along[1:])).sum())


def tip_roll_rad(roll: Roll | None, *, shape_box: FloatArray, roll_rad: float | None) -> float:
    """Return the tip's turn about its tangent for a centreline (K, 3) mm, tip first or last: the roll plus torsion.

    roll: the rig's, None where it has none. roll_rad: at the gearbox; None (no valid roll) counts as 0.
    """
    turn = roll_rad or 0.0
    if roll is None or not (roll.torsion_deg_per_mm or roll.torsion_deg_per_quarter_bend):
        return turn
    length_mm = float(arc_length(shape_box)[-1])
    return turn + torsion_rad(roll, length_mm=length_mm, bend_rad=total_bend_rad(shape_box))
