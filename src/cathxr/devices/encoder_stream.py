"""From the board's bytes to Readings: which reports to believe, when they were latched, and what a restart has cost.

Pure: bytes and instants come as arguments. The same for a real board, a simulated one, and the twin's.
"""

from dataclasses import dataclass, replace

from cathxr.core import Reading
from cathxr.devices import encoder_protocol as protocol
from cathxr.devices.encoder_clock import BoardClock
from cathxr.devices.encoder_protocol import Answer, Identity, LineReader, Refusal, Report

UNCONFIRMED = 0x100
"""Reading.flags: the board has restarted, or the port was opened, and nobody has confirmed the zero since."""
NO_ZERO = 0x200
"""Reading.flags: the count does not belong to this rig's zero: power was lost, or the jig was never used."""
MISCOUNTED = 0x400
"""Reading.flags: so many impossible transitions since the last confirmation that the count may be off by a degree."""
INVALID = UNCONFIRMED | NO_ZERO | MISCOUNTED
"""A reading with any of these flags gives no valid roll."""
RUN_SHIFT = 12
SAME_RUN = 0xF << RUN_SHIFT | 0xF0
"""Reading.flags: the board's restarts, and how often the count began anew (after a restart, at a new zero), modulo 16.

Between two readings that differ in these the count did not go on, and nothing may be interpolated.
"""

_FASTEST_COUNTS_S = 200_000
_SLACK_COUNTS = 64
_SLACK_NS = 2_500_000_000
"""By how much a report may be held up on the way; a board that is silent for longer is taken for lost."""
_DRIFT = 0.02
_COUNTS_PER_ILLEGAL = 4


@dataclass(frozen=True)
class EncoderState:
    """What is known about the count. cause: of the board's last restart; restarts: its counter (lost with power).

    kept: the count survived the last restart. moved: but the handle was turned meanwhile. restarts_seen: how often the
    board restarted while it was connected. needs_jig: the count does not belong to the rig's zero; needs_confirmation:
    it does, but a person has not yet confirmed it since the last restart; miscounted: see MISCOUNTED.
    """

    firmware: str = ""
    restarts: int = 0
    restarts_seen: int = 0
    cause: str = "unknown"
    kept: bool = False
    moved: bool = False
    needs_jig: bool = True
    needs_confirmation: bool = True
    miscounted: bool = False

    @property
    def valid(self) -> bool:
        """Whether the count gives the rig's roll."""
        return self.flags == 0

    @property
    def flags(self) -> int:
        """The bits of INVALID that readings carry now."""
        unconfirmed = UNCONFIRMED if self.needs_confirmation or self.needs_jig else 0
        return unconfirmed | (NO_ZERO if self.needs_jig else 0) | (MISCOUNTED if self.miscounted else 0)

    @property
    def sentence(self) -> str:
        """What a person has to do, and why; empty when nothing."""
        if self.needs_jig and not self.kept:
            return "The encoder's count was lost with its power: set roll zero again with the jig."
        if self.needs_jig:
            return "The encoder's count does not belong to this rig's zero: set roll zero with the jig."
        if self.miscounted:
            return "The encoder's signal is disturbed and its count is in doubt: check its cable, then set roll zero."
        if self.needs_confirmation and self.moved:
            return "The encoder restarted and was turned meanwhile: compare mark T with the picture, then confirm roll."
        if self.needs_confirmation:
            return "The encoder restarted and kept its count: confirm that roll is right."
        return ""


@dataclass(frozen=True)
class EncoderLink:
    """How the line to the board does. board_us: its clock at the last report, None before the first.

    drift: how much slower the board's clock runs, as a share. missed, damaged, doubted: reports that never came, lines
    that came damaged, reports that were not believed. refusals: the board's last ones.
    """

    board_us: int | None
    drift: float
    rate_hz: int
    missed: int
    damaged: int
    doubted: int
    refusals: tuple[str, ...]


@dataclass(frozen=True)
class _Arrival:
    """A report, with when it came."""

    report: Report
    arrival_ns: int


class EncoderStream:
    """Readings from what one opened board sends.

    mark: of the rig's zero (see encoder_protocol.mark_of). latency_ns: from latch to arrival at the least, without the
    line's own time on the wire, which is known; both are subtracted from every stamp. counts_per_degree: of roll, for
    how many impossible transitions are too many. first_seq: the number of the first reading. A report is believed when
    it follows from the one before: time on the board goes on as on the host, numbers and counts by no more than they
    can. One that does not is held back; when the next one follows from it, the board has restarted without our seeing
    it say so.
    """

    def __init__(self, *, mark: int, latency_ns: int, counts_per_degree: float, first_seq: int = 0) -> None:
        self.state = EncoderState()
        self.doubted = 0
        self.missed = 0
        self.rate_hz = protocol.USUAL_RATE_HZ
        self.refusals: tuple[str, ...] = ()
        self._mark, self._latency_ns = mark, latency_ns
        self._most_illegal = max(1, int(counts_per_degree / _COUNTS_PER_ILLEGAL))
        self._reader = LineReader()
        self._clock = BoardClock()
        self._seq = first_seq
        self._last: _Arrival | None = None
        self._held: _Arrival | None = None
        self._illegal: int | None = None
        self._illegal_since = 0
        self._last_t_ns: int | None = None
        self._identity: Identity | None = None
        self._asking = True
        self._command: Answer | None = None
        self._jump_allowed = False
        self._run = 0

    @property
    def next_seq(self) -> int:
        """The number of the next reading."""
        return self._seq

    @property
    def damaged(self) -> int:
        """Lines that came damaged so far."""
        return self._reader.damaged

    @property
    def link(self) -> EncoderLink:
        """How the line to the board does."""
        board_us = None if self._last is None else self._last.report.us
        return EncoderLink(
            board_us, self._clock.drift, self.rate_hz, self.missed, self.damaged, self.doubted, self.refusals
        )

    @property
    def wants_identity(self) -> bool:
        """Whether the board is to be asked who it is: a restart was found out whose announcement did not come."""
        return self._asking

    @property
    def command(self) -> bytes | None:
        """The command that the board has not answered yet, to be sent again until it has; None where there is none."""
        if self._command is None:
            return None
        return protocol.guarded(" ".join((self._command.command, *self._command.arguments)))

    def confirm(self) -> None:
        """Take a person's word that roll is right.

        Raises:
            ValueError: the jig is needed, or the board has yet to answer a command that changes its zero.
        """
        if self.state.needs_jig:
            raise ValueError(self.state.sentence)
        if self._command is not None:
            raise ValueError("The encoder has not answered yet: wait a moment, then confirm roll.")
        self._forgive()

    def set_zero(self, count: int) -> None:
        """Have the board take the present position for `count` of this rig's zero: the handle is in the jig.

        Raises:
            ValueError: the count does not fit 32 bits.
        """
        if not -(2**31) <= count < 2**31:
            raise ValueError(f"count: expected a 32-bit whole number, got {count}")
        self._change(Answer("zero", (str(count), f"{self._mark:08X}")))

    def adopt(self, mark: int) -> None:
        """Have the board keep its count and take it for another zero's: the rig was calibrated with it just now."""
        self._mark = mark
        self._change(Answer("mark", (f"{mark:08X}",)))

    def _change(self, command: Answer) -> None:
        """Have a command sent; whether the board has carried it out is not known until its answer has come."""
        self._command = command
        self.state = replace(self.state, needs_confirmation=True)

    def take(self, data: bytes, arrival_ns: int) -> list[Reading]:
        """Return the readings that these bytes complete; `arrival_ns`: when they were received, or just after."""
        readings = []
        for message in self._reader.feed(data):
            if isinstance(message, Report):
                reading = self._report(_Arrival(message, arrival_ns))
                if reading is not None:
                    readings.append(reading)
            elif isinstance(message, Identity):
                self.introduce(message)
            elif isinstance(message, Answer):
                self._answer(message)
            elif isinstance(message, Refusal):
                self.refusals = (*self.refusals[-7:], message.reason)
        return readings

    def introduce(self, identity: Identity) -> None:
        """Take note of who the board says it is: when it was found, after a restart, and whenever it was asked."""
        known, self._identity, self._asking = self._identity, identity, False
        if known is not None and identity.restarts != known.restarts:
            self._begin_anew()
        self.rate_hz = identity.rate_hz
        self.state = replace(
            self.state,
            firmware=identity.firmware,
            restarts=identity.restarts,
            cause=identity.cause,
            kept=identity.kept,
            needs_jig=identity.mark != self._mark,
        )

    def _begin_anew(self) -> None:
        """The board has restarted: its clock, its numbers and what a person had confirmed are of the past."""
        self._clock, self._last, self._held, self._illegal = BoardClock(), None, None, None
        self._run += 1
        self.state = replace(self.state, needs_confirmation=True, restarts_seen=self.state.restarts_seen + 1)

    def _forgive(self) -> None:
        self._illegal_since = 0
        self.state = replace(self.state, needs_confirmation=False, miscounted=False, moved=False)

    def _answer(self, answer: Answer) -> None:
        if answer.command == "rate" and len(answer.arguments) == 1 and answer.arguments[0].isdigit():
            self.rate_hz = int(answer.arguments[0])
        if answer == self._command:
            self._jump_allowed = answer.command == "zero"
            self._run += self._jump_allowed
            self._command = None
            self.state = replace(self.state, needs_jig=False)
            self._forgive()

    def _report(self, came: _Arrival) -> Reading | None:
        """Return the reading of a report that can be believed."""
        if not self._expected(came):
            if self._held is None or not self._follows(self._held, came):
                self.doubted += 1
                self._held = came
                return None
            self._begin_anew()
            self._identity, self._asking = None, True
            self.state = replace(self.state, needs_jig=True, kept=bool(came.report.flags & protocol.KEPT))
        self._held, self._jump_allowed = None, False
        return self._reading(came)

    def _expected(self, came: _Arrival) -> bool:
        """Return whether a report is the next of what was believed so far."""
        if self._last is None:
            return self._identity is None or came.report.restarts == self._identity.restarts % 16
        return self._follows(self._last, came)

    def _follows(self, before: _Arrival, after: _Arrival) -> bool:
        """Return whether a report can be a later one of the same run of the board."""
        passed_ns = 1000 * ((after.report.us - before.report.us) % (1 << 32))
        host_ns = after.arrival_ns - before.arrival_ns
        numbers = (after.report.seq - before.report.seq) % (1 << 16)
        turned = abs((after.report.count - before.report.count + 2**31) % 2**32 - 2**31)
        return (
            after.report.restarts == before.report.restarts
            and abs(passed_ns - host_ns) <= _SLACK_NS + _DRIFT * host_ns
            and 1 <= numbers <= 2 + 2e-9 * protocol.HIGHEST_RATE_HZ * passed_ns
            and (
                self._jump_allowed
                or self._command is not None
                or turned <= _SLACK_COUNTS + 1e-9 * _FASTEST_COUNTS_S * passed_ns
            )
        )

    def _reading(self, came: _Arrival) -> Reading | None:
        report, last = came.report, self._last
        step = 1 if last is None else (report.seq - last.report.seq) % (1 << 16)
        self.missed += step - 1
        self._seq += step
        self._last = came
        self._count_illegal(report.illegal)
        if report.flags & protocol.MOVED and last is None:
            self.state = replace(self.state, moved=True)
        t_ns = self._clock.stamp_ns(report.us, came.arrival_ns - protocol.line_ns(report)) - self._latency_ns
        if self._last_t_ns is not None and t_ns <= self._last_t_ns:
            t_ns = self._last_t_ns + 1  # the offset was just corrected downwards; order matters more than the rest
        self._last_t_ns = t_ns
        flags = report.flags | self.state.flags | self._run % 16 << RUN_SHIFT
        return Reading(self._seq - 1, t_ns, report.count, report.illegal, flags)

    def _count_illegal(self, illegal: int) -> None:
        self._illegal_since += 0 if self._illegal is None else (illegal - self._illegal) % (1 << 16)
        self._illegal = illegal
        if self._illegal_since >= self._most_illegal and not self.state.miscounted:
            self.state = replace(self.state, miscounted=True)
