"""The [roll] of a rig from the jig: its zero, its gears' play, whether one turn gives the counts it should. Pure."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from cathxr.calibration.roll_rocking import Play
from cathxr.calibration.roll_sentences import number
from cathxr.core import CalibrationError, Provenance, Roll

TURN_TOLERANCE_DEG = 8.0
"""A mark brought back by eye, without the jig, is within this; no two pairs of gears are so much alike."""
LEAST_TURN = 0.1
"""Of what the rig expects: less is no turn, whatever the gears."""
JIG_STD_DEG = 0.3
"""What the jig and the lock leave open, unless they are known better."""
_ROUNDING = 1.0 / 12.0
_X4 = 4.0
_DENOMINATORS = (1, 2, 3, 4)
_EXTREME = 12.0


@dataclass(frozen=True)
class TurnCheck:
    """What one turn to the right says of the rig. counts: signed, the play taken out.

    gear_ratio, counts_per_turn, direction: those that fit; is_as_stated: they are the rig's. closure_deg: how far the
    counts are from a whole turn of what fits. sentence: what was found, for people.
    """

    counts: float
    gear_ratio: float
    counts_per_turn: float
    direction: int
    is_as_stated: bool
    closure_deg: float
    sentence: str


@dataclass(frozen=True)
class JigCalibration:
    """What the jig procedure measured. zero: the encoder's count for the rig's zero, in the run's own counts.

    zero_std, counts: of the zero, the jig's share included. play, turn: None where that step was left out.
    """

    roll: Roll
    zero: float
    zero_std: float
    play: Play | None
    turn: TurnCheck | None

    def board_count(self, count: int) -> int:
        """Return what the board is to call the position at which it counts `count` now.

        The zero is taken at the nearest whole turn, so that roll begins near 0 after the turn that was counted.
        """
        turn = self.roll.counts_per_turn * self.roll.gear_ratio
        turns = round((count - self.zero) / turn)
        return round(self.roll.zero_count + count - self.zero - turns * turn)


def counts_per_degree(roll: Roll) -> float:
    """Return the encoder counts for one degree of the catheter."""
    return roll.counts_per_turn * roll.gear_ratio / 360.0


def check_turn(roll: Roll, counts: float, *, play: Play | None = None) -> TurnCheck:
    """Return what `counts` for one turn of the handle to the right say of a rig's [roll].

    To the right: clockwise, seen from the handle towards the box: that is right-handed about the insertion, positive
    roll. counts: from the middle of the play at the start to where the turn ended, so that the encoder lags half of it.

    Raises:
        CalibrationError: it was hardly turned, or the counts fit no pair of gears.
    """
    expected = roll.counts_per_turn * roll.gear_ratio
    if abs(counts) < LEAST_TURN * expected:
        raise CalibrationError(
            f"That was no turn: {counts:+.0f} counts, where one turn gives {expected:.0f}; turn the handle once round."
        )
    full = abs(counts) + (0.0 if play is None else 0.5 * play.counts)
    direction = 1 if counts > 0 else -1
    tolerance = TURN_TOLERANCE_DEG / 360.0
    said = f"{full:.0f} counts for one turn"
    fits: list[str] = []
    ratio, per_turn = roll.gear_ratio, roll.counts_per_turn
    if abs(full - expected) > tolerance * expected:
        if any(abs(full - factor * expected) <= tolerance * factor * expected for factor in (_X4, 1.0 / _X4)):
            per_turn = roll.counts_per_turn * (_X4 if full > expected else 1.0 / _X4)
            fits.append(
                f"counts_per_turn {per_turn:.0f} fits, the rig says {roll.counts_per_turn:.0f} (pulses are counted x4)"
            )
        else:
            ratio = _simple_ratio(full, roll, tolerance=tolerance)
            fits.append(f"gear_ratio {number(ratio)} fits, the rig says {number(roll.gear_ratio)}")
    if direction != roll.direction:
        fits.append(f"direction {direction} fits, the rig says {roll.direction}")
    sentence = f"{said}: {'; '.join(fits)}." if fits else f"{said}, as the rig says."
    turn = ratio * per_turn
    closure_deg = 360.0 * (full - turn) / turn
    return TurnCheck(direction * full, ratio, per_turn, direction, not fits, closure_deg, sentence)


def _simple_ratio(full: float, roll: Roll, *, tolerance: float) -> float:
    """Return the simplest ratio of teeth that gives `full` counts for one turn."""
    ratio = full / roll.counts_per_turn
    if 1.0 / _EXTREME < ratio < _EXTREME:
        for denominator in _DENOMINATORS:
            simple = round(ratio * denominator) / denominator
            if simple > 0 and abs(simple - ratio) <= tolerance * ratio:
                return simple
    raise CalibrationError(
        f"{full:.0f} counts for one turn fit no simple pair of gears (ratio {ratio:.3g}; the rig says "
        f"{number(roll.gear_ratio)}): turn exactly once, or write gear_ratio into the rig from the gears' teeth."
    )


def jig_calibration(
    roll: Roll,
    *,
    rested: int,
    play: Play | None,
    turn: TurnCheck | None,
    date: str,
    jig_std_deg: float = JIG_STD_DEG,
) -> JigCalibration:
    """Return the [roll] that the jig procedure gives, with errors, date and method.

    rested: the count at which the handle was confirmed in the jig; the zero where the play was not measured, and then
    as uncertain as the rig's backlash makes it. date: ISO 8601. jig_std_deg: what the jig itself leaves open; a turn
    that closes worse says more.
    """
    changed = roll
    if turn is not None:
        changed = replace(
            roll, gear_ratio=turn.gear_ratio, counts_per_turn=turn.counts_per_turn, direction=turn.direction
        )
    per_degree = counts_per_degree(changed)
    if play is None:
        zero = float(rested)
        variance = ((roll.backlash_deg or 0.0) * per_degree) ** 2 / 12.0 + _ROUNDING
    else:
        zero, variance = play.middle, play.middle_std**2
        changed = replace(changed, backlash_deg=max(0.0, play.counts) / per_degree)
    closure = 0.0 if turn is None else abs(turn.closure_deg) / 2.0**0.5
    # The board counts in whole numbers, so that the zero is rounded once more when it is set.
    zero_std = (variance + _ROUNDING + (max(jig_std_deg, closure) * per_degree) ** 2) ** 0.5
    std = {**roll.provenance.std, "zero_count": np.array(zero_std)}
    if play is not None:
        std["backlash_deg"] = np.array(play.counts_std / per_degree)
    provenance = Provenance(
        std=MappingProxyType(std),
        n=None if play is None else play.stops,
        date=date,
        method="; ".join(_method(play, turn)),
    )
    return JigCalibration(replace(changed, provenance=provenance), zero, zero_std, play, turn)


def _method(play: Play | None, turn: TurnCheck | None) -> Iterator[str]:
    yield "jig"
    if play is not None:
        yield f"play from {play.stops} stops"
    if turn is not None:
        yield f"one turn counted, closing within {abs(turn.closure_deg):.1f} deg"


def changes(before: Roll, after: Roll) -> Mapping[str, tuple[Any, Any]]:
    """Return what a calibration changes: (before, after) by the key in rig.toml."""
    keys = ("counts_per_turn", "gear_ratio", "direction", "backlash_deg")
    return {
        key: (getattr(before, key), getattr(after, key)) for key in keys if getattr(before, key) != getattr(after, key)
    }
