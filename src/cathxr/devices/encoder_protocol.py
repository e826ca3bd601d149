"""The roll encoder's protocol: lines of text with a CRC. firmware/roll_encoder/protocol.md is the contract. Pure."""

import binascii
import re
import zlib
from dataclasses import dataclass

from cathxr.core import Roll

NAME = "cathxr-roll"
PROTOCOL = 1
BAUD = 115200
_BITS_PER_BYTE = 10
USUAL_RATE_HZ = 200
HIGHEST_RATE_HZ = 400
LONGEST_LINE = 64
"""Of the board's lines, with CRC and newline."""

KEPT = 0x01
MOVED = 0x02
SKIPPED = 0x04
POLLED = 0x08
_RESTARTS_SHIFT = 4

CAUSES = ("unknown", "power", "external", "brownout", "watchdog")

_NUMBER = rb"(0|[1-9]\d{0,9})"
_SIGNED = rb"(0|-?[1-9]\d{0,9})"
_GUARDED = re.compile(rb"([ -)+-~]+)\*([0-9A-F]{4})")
_REPORT = re.compile(rb"R " + _NUMBER + rb" " + _NUMBER + rb" " + _SIGNED + rb" " + _NUMBER + rb" ([0-9A-F]{2})")
_ANYONE = re.compile(rb"I ([a-z0-9-]+) " + _NUMBER + rb"( .*)?")
_IDENTITY = re.compile(
    rb" (\d+\.\d+\.\d+) " + _NUMBER + rb" ([a-z]+) (kept|lost) ([0-9A-F]{8}) " + _NUMBER,
)
_ANSWER = re.compile(rb"A ([a-z]+)((?: [0-9A-F-]+)*)")
_REFUSAL = re.compile(rb"E ([a-z]+)")


@dataclass(frozen=True)
class Report:
    """One report: seq and illegal modulo 65536, us the board's micros() modulo 2^32, count a 32-bit whole number."""

    seq: int
    us: int
    count: int
    illegal: int
    flags: int

    @property
    def restarts(self) -> int:
        """The board's restart counter modulo 16."""
        return self.flags >> _RESTARTS_SHIFT


@dataclass(frozen=True)
class Identity:
    """What a board says it is. cause: of its last restart; kept: the count survived that; mark: see `mark_of`."""

    firmware: str
    restarts: int
    cause: str
    kept: bool
    mark: int
    rate_hz: int


@dataclass(frozen=True)
class Stranger:
    """A board that names itself in this form but speaks another protocol, or is another thing altogether."""

    name: str
    protocol: int


@dataclass(frozen=True)
class Answer:
    """A command was carried out; its arguments as the board understood them."""

    command: str
    arguments: tuple[str, ...]


@dataclass(frozen=True)
class Refusal:
    """A command was not carried out: crc, unknown, arguments, range, long."""

    reason: str


Message = Report | Identity | Stranger | Answer | Refusal


def crc16(body: bytes) -> int:
    """Return the CRC-16/CCITT-FALSE of a line's body: everything before its asterisk."""
    return binascii.crc_hqx(body, 0xFFFF)


def guarded(body: str) -> bytes:
    """Return a body as a line, with its CRC and newline."""
    raw = body.encode("ascii")
    return raw + b"*%04X\n" % crc16(raw)


def report_line(report: Report) -> bytes:
    """Return a report as the board sends it."""
    return guarded(f"R {report.seq} {report.us} {report.count} {report.illegal} {report.flags:02X}")


def line_ns(report: Report) -> int:
    """Return how long a report's line takes to be transmitted: 2.1 to 3.7 ms, by how many digits its numbers have."""
    return round(1e9 * _BITS_PER_BYTE / BAUD * len(report_line(report)))


def identity_line(identity: Identity) -> bytes:
    """Return the identity as the board sends it."""
    kept = "kept" if identity.kept else "lost"
    return guarded(
        f"I {NAME} {PROTOCOL} {identity.firmware} {identity.restarts} {identity.cause} {kept} "
        f"{identity.mark:08X} {identity.rate_hz}"
    )


def parse_line(line: bytes) -> Message | None:
    """Return what a line (without its newline) says; None where anything about it is not exactly as it must be."""
    whole = _GUARDED.fullmatch(line)
    if whole is None or len(line) >= LONGEST_LINE or int(whole[2], 16) != crc16(whole[1]):
        return None
    body = whole[1]
    if (found := _REPORT.fullmatch(body)) is not None:
        return _report(found)
    if (found := _ANYONE.fullmatch(body)) is not None:
        return _identity(found)
    if (found := _ANSWER.fullmatch(body)) is not None:
        return Answer(found[1].decode(), tuple(found[2].decode().split()))
    if (found := _REFUSAL.fullmatch(body)) is not None:
        return Refusal(found[1].decode())
    return None


def _report(found: re.Match[bytes]) -> Report | None:
    seq, us, count, illegal = (int(each) for each in found.groups()[:4])
    if seq > 0xFFFF or us > 0xFFFFFFFF or illegal > 0xFFFF or not -(2**31) <= count < 2**31:
        return None
    return Report(seq, us, count, illegal, int(found[5], 16))


def _identity(found: re.Match[bytes]) -> Identity | Stranger | None:
    name, protocol = found[1].decode(), int(found[2])
    if name != NAME or protocol != PROTOCOL:
        return Stranger(name, protocol)
    rest = _IDENTITY.fullmatch(found[3] or b"")
    if rest is None or rest[3].decode() not in CAUSES:
        return None
    firmware, restarts, cause, kept, mark, rate = (each.decode() for each in rest.groups())
    return Identity(firmware, int(restarts), cause, kept == "kept", int(mark, 16), int(rate))


class LineReader:
    """Turns a stream of bytes, of whatever kind, into messages; finds its feet again at every newline.

    damaged: lines, or stretches without a newline, that were no message. The rest of a line that was under way when
    reading began is not held against the board.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._pending = b""
        self._overlong = False
        self._begun = False

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that these bytes complete, in order."""
        *lines, self._pending = (self._pending + data).split(b"\n")
        messages = []
        for line in lines:
            message = None if self._overlong else parse_line(line.removesuffix(b"\r"))
            if message is not None:
                messages.append(message)
            elif self._begun:
                self.damaged += 1
            self._overlong, self._begun = False, True
        if len(self._pending) > LONGEST_LINE:
            self._pending, self._overlong = b"", True
        return messages


def command_id() -> bytes:
    """Return the command that has the board name itself."""
    return guarded("id")


def command_rate(rate_hz: int) -> bytes:
    """Return the command that sets the reports per second; 0 stops them."""
    return guarded(f"rate {rate_hz}")


def command_zero(count: int, mark: int) -> bytes:
    """Return the command that makes the present position `count` and notes what that count belongs to."""
    return guarded(f"zero {count} {mark:08X}")


def command_mark(mark: int) -> bytes:
    """Return the command that notes what the count belongs to and leaves the count as it is."""
    return guarded(f"mark {mark:08X}")


def mark_of(roll: Roll) -> int:
    """Return the 32-bit mark of a rig's zero: what ties the board's count to this rig's way of turning it into roll.

    The board keeps it with the count and forgets both when it loses power. A count that carries another mark, or none
    (0), says nothing about the roll of this rig.
    """
    direction = " ".join(f"{each:.9g}" for each in roll.zero_direction)
    text = f"{roll.counts_per_turn:.9g} {roll.gear_ratio:.9g} {roll.direction} {roll.zero_count:.9g} {direction}"
    return zlib.crc32(text.encode("ascii")) or 1
