"""The roll of a live encoder: at a picture's instant, whether it is valid, and what a person can do about it."""

from dataclasses import dataclass
from typing import Literal

from cathxr.core import ConfigError, Reading, Roll, RollStatus, Source, Zeroed
from cathxr.devices.encoder_stream import INVALID, MISCOUNTED, NO_ZERO
from cathxr.geometry.roll import RollFollower
from cathxr.runtime.history import History

_SILENT_NS = 500_000_000
"""After this long without a reading, or without one that fits a picture, the roll counts as not valid."""
_SETTLING_NS = 1_000_000_000
"""The first pictures may be older than the first readings."""
_NO_ENCODER = "This system has no roll encoder: name its driver under [encoder] in config.toml."


@dataclass(frozen=True)
class RollAt:
    """The roll at an instant. roll_rad: unwrapped, None where it is not valid; predicted: see History."""

    roll_rad: float | None = None
    predicted: bool = False


class LiveRoll:
    """What one encoder says of the roll. Readings come in one thread, questions from any.

    roll, encoder: None where there is none. There is a roll at an instant only where every reading that it is made from
    is free of the flags of INVALID, no restart lies between them, and they are not too old. What is given then is off
    by no more than a count, what the handle speeds up by between two readings, and the play that no count can tell
    (RollFollower.uncertainty_rad); a person who confirms what is not so can make it wrong, nothing else can.
    """

    def __init__(self, roll: Roll | None, encoder: Source[Reading] | None) -> None:
        self._roll, self._encoder = roll, encoder
        self._history = History(None if roll is None else RollFollower(roll))
        self._keeper = _keeper(encoder)
        self._first_ns: int | None = None
        self._unanswered_ns: int | None = None
        self._asked_ns = 0

    def add(self, reading: Reading) -> None:
        """Take the next reading."""
        self._history.add(reading)
        if self._first_ns is None:
            self._first_ns = reading.t_ns

    def forget(self) -> None:
        """Forget all readings: the encoder has gone."""
        self._history.clear()
        self._first_ns = self._unanswered_ns = None

    def at(self, t_ns: int) -> RollAt:
        """Return the roll at an instant."""
        sample = self._history.at(t_ns)
        self._asked_ns = t_ns
        if sample is not None:
            self._unanswered_ns = None
        elif self._unanswered_ns is None and self._first_ns is not None and t_ns > self._first_ns + _SETTLING_NS:
            self._unanswered_ns = t_ns
        if sample is None or self._roll is None or sample.flags & INVALID:
            return RollAt()
        return RollAt(self._roll.angle_rad(sample.count), sample.predicted)

    def status(self, now_ns: int, *, running: bool, error: str | None) -> RollStatus:
        """Return whether the roll is valid. running, error: of the encoder's thread."""
        if self._encoder is None:
            return RollStatus(False, False)
        if self._roll is None:
            return RollStatus(running, False, "", "The rig says nothing of the roll encoder: add [roll] to rig.toml.")
        if not running:
            return RollStatus(False, False, "", error or "The roll encoder is being opened.")
        newest = self._history.newest
        if newest is None or now_ns - newest.t_ns > _SILENT_NS:
            return RollStatus(True, False, "", "The roll encoder reports nothing: check its USB cable.")
        if newest.flags & INVALID:
            return self._untrusted(newest.flags)
        if self._unanswered_ns is not None and self._asked_ns - self._unanswered_ns > _SILENT_NS:
            return RollStatus(
                True,
                False,
                "",
                "The encoder's readings are not of the same time as the pictures: measure the delays with "
                "cathxr calibrate timing.",
            )
        return RollStatus(True, True)

    def confirm(self) -> None:
        """Take a person's word that roll is right. Raises CathxrError where that cannot be or is not enough."""
        self._zeroed().confirm()

    def zero(self) -> None:
        """Have the present position be roll zero: the handle is in the jig. Raises CathxrError where it cannot be."""
        keeper = self._zeroed()
        keeper.set_zero(round(0.0 if self._roll is None else self._roll.zero_count))

    def _zeroed(self) -> Zeroed:
        if self._encoder is None or self._roll is None:
            raise ConfigError(_NO_ENCODER)
        if self._keeper is None:
            raise ConfigError("This encoder's driver keeps no zero that could be confirmed or set.")
        return self._keeper

    def _untrusted(self, flags: int) -> RollStatus:
        """Return why a reading with these flags gives no roll, in the driver's words where it has some."""
        needs: Literal["confirm", "jig"] = "jig" if flags & (NO_ZERO | MISCOUNTED) else "confirm"
        said = " ".join(getattr(self._encoder, "warnings", ()))
        if self._keeper is None:
            return RollStatus(True, False, "", said or "The roll encoder's driver says that its count is not valid.")
        usual = "Set roll zero with the jig." if needs == "jig" else "Confirm that roll is right."
        return RollStatus(True, False, needs, said or usual)


def _keeper(encoder: object) -> Zeroed | None:
    """Return the encoder where it keeps a zero."""
    return encoder if isinstance(encoder, Zeroed) else None
