"""The roll encoder's board in Python: what it sends and when, for a count that is a function of time; faults to order.

`FakeBoard` is the board alone, without clock or port; `FakePort` puts it behind the interface of a serial port, in
memory and so on every system. See encoder_fake_terminal for one that other programs can open.
"""

import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from cathxr.core import Clock, DeviceLost
from cathxr.devices import encoder_protocol as protocol
from cathxr.devices.encoder_protocol import Identity, Report

_NS = 1_000_000_000
_BYTE_NS = 10 * _NS // protocol.BAUD
_START_NS = 70_000_000
"""From reset to the first line, where no boot loader waits."""
_BUFFER_NS = 63 * _BYTE_NS
_LONGEST_COMMAND = 40


def _wrapped(value: int, bits: int) -> int:
    half = 1 << (bits - 1)
    return (value + half) % (1 << bits) - half


class FakeBoard:
    """What the board of firmware/roll_encoder does, to the line.

    count_at: the encoder's true position in counts at an instant in ns, counted by whoever turns it; the board itself
    starts from 0 whenever it gets power. Instants are of the caller's clock and never go back. drift: how much slower
    the board's clock runs. start_us: where its micros() stood at the start. mark: of the zero that it already knows.
    """

    def __init__(
        self,
        count_at: Callable[[int], int],
        *,
        start_ns: int,
        mark: int = 0,
        drift: float = 0.0,
        start_us: int = 0,
    ) -> None:
        self.illegal = 0
        self._count_at, self._drift = count_at, drift
        self._rate_hz = protocol.USUAL_RATE_HZ
        self._restarts, self._cause, self._kept, self._moved = 0, "power", mark != 0, False
        self._mark = mark
        self._offset = 0 if mark else -count_at(start_ns)
        self._command = b""
        self._begin(start_ns, start_us)

    def _begin(self, t_ns: int, start_us: int = 0) -> None:
        """Be running from `t_ns` on."""
        self._origin_ns, self._origin_us = t_ns, start_us
        self._seq, self._skipped, self._rate_hz, self.illegal = 0, False, protocol.USUAL_RATE_HZ, 0
        self._due_ns = t_ns + _NS // self._rate_hz
        self._busy_until_ns = t_ns
        self._out: deque[tuple[int, bytes]] = deque()
        self._send(t_ns, self._identity())

    def restart(self, t_ns: int, cause: str = "external", *, waits_s: float = 0.0) -> None:
        """Be reset at `t_ns`: by "external", "watchdog", "brownout" or "power". waits_s: the boot loader's pause.

        What the encoder does before the board runs again is not counted; the two latter causes lose count and mark.
        """
        begins_ns = t_ns + _START_NS + round(waits_s * _NS)
        before, after = self._count_at(t_ns), self._count_at(begins_ns)
        self._cause, self._kept = cause, cause not in ("power", "brownout")
        self._moved = self._kept and (after - before) % 4 != 0
        # Of what was missed, the board makes out no more than the state of its two inputs.
        self._offset = self._offset + before - after if self._kept else -after
        self._restarts = 0 if cause == "power" else (self._restarts + 1) % (1 << 16)
        self._mark = self._mark if self._kept else 0
        self._begin(begins_ns)

    @property
    def next_ns(self) -> int:
        """When there will be something to transmit next, at the earliest."""
        report_ns = self._due_ns if self._rate_hz else self._busy_until_ns + _NS
        return min(report_ns, self._out[0][0]) if self._out else report_ns

    def count(self, t_ns: int) -> int:
        """Return what the board counts at an instant."""
        return _wrapped(self._count_at(t_ns) + self._offset, 32)

    def transmit(self, until_ns: int) -> bytes:
        """Return the lines whose last byte is out by `until_ns` and that were not returned before."""
        while self._rate_hz and self._due_ns <= until_ns:
            self._report(self._due_ns, 0)
            self._due_ns += round(_NS / self._rate_hz)
        data = b""
        while self._out and self._out[0][0] <= until_ns:
            data += self._out.popleft()[1]
        return data

    def receive(self, data: bytes, t_ns: int) -> None:
        """Take what the host sends."""
        *lines, self._command = (self._command + data).replace(b"\r", b"\n").split(b"\n")
        for line in lines:
            answer = self._carry_out(line.rstrip(b" "), t_ns)
            if answer:
                self._send(t_ns, answer)

    def _us(self, t_ns: int) -> int:
        return (self._origin_us + int((t_ns - self._origin_ns) * (1.0 - self._drift) / 1000)) % (1 << 32)

    def _identity(self) -> bytes:
        return protocol.identity_line(
            Identity("1.0.0", self._restarts, self._cause, self._kept, self._mark, self._rate_hz)
        )

    def _send(self, t_ns: int, line: bytes) -> None:
        self._busy_until_ns = max(self._busy_until_ns, t_ns) + len(line) * _BYTE_NS
        self._out.append((self._busy_until_ns, line))

    def _report(self, t_ns: int, flags: int) -> None:
        flags |= (protocol.KEPT if self._kept else 0) | (protocol.MOVED if self._moved else 0)
        flags |= (protocol.SKIPPED if self._skipped else 0) | (self._restarts % 16) << 4
        line = protocol.report_line(Report(self._seq, self._us(t_ns), self.count(t_ns), self.illegal, flags))
        self._seq = (self._seq + 1) % (1 << 16)
        room = self._busy_until_ns + len(line) * _BYTE_NS - t_ns <= _BUFFER_NS
        self._skipped = not room and not flags & protocol.POLLED
        if not self._skipped:
            self._send(t_ns, line)

    def _carry_out(self, line: bytes, t_ns: int) -> bytes:
        """Return the answer to one command; the firmware's commands.h is the model."""
        if not line:
            return b""
        if len(line) > _LONGEST_COMMAND:
            return protocol.guarded("E long")
        body, star, crc = line.partition(b"*")
        if star and crc != b"%04X" % protocol.crc16(body):
            return protocol.guarded("E crc")
        words = body.decode("ascii", errors="replace").split(" ")
        if "" in words or len(words) > 3:
            return protocol.guarded("E arguments")
        try:
            return self._obey(words[0], words[1:], bool(star), t_ns)
        except ValueError:
            return protocol.guarded("E arguments")

    def _obey(self, word: str, given: list[str], guarded: bool, t_ns: int) -> bytes:
        if word == "id" and not given:
            return self._identity()
        if word == "poll" and not given:
            self._report(t_ns, protocol.POLLED)
            return b""
        if word == "rate" and len(given) == 1:
            rate_hz = _decimal(given[0])
            if not 0 <= rate_hz <= protocol.HIGHEST_RATE_HZ:
                return protocol.guarded("E range")
            self._rate_hz = rate_hz
            self._due_ns = t_ns + (_NS // rate_hz if rate_hz else 0)
            return protocol.guarded(f"A rate {rate_hz}")
        if word == "zero":
            count = _decimal(given[0]) if given else 0
            mark = _hex(given[1]) if len(given) == 2 else 0
            if len(given) == 2 and not guarded:
                return protocol.guarded("E crc")
            self._offset, self._mark = count - self._count_at(t_ns), mark
            return protocol.guarded(f"A zero {count} {mark:08X}")
        if word == "mark" and len(given) == 1:
            mark = _hex(given[0])
            if not guarded:
                return protocol.guarded("E crc")
            self._mark = mark
            return protocol.guarded(f"A mark {mark:08X}")
        known = word in ("id", "poll", "rate", "mark")
        return protocol.guarded("E arguments" if known else "E unknown")


def _decimal(text: str) -> int:
    value = int(text)
    if text != str(value) or not -(2**31) <= value < 2**31:
        raise ValueError(text)
    return value


def _hex(text: str) -> int:
    if len(text) != 8 or text != f"{int(text, 16):08X}":
        raise ValueError(text)
    return int(text, 16)


@dataclass
class Faults:
    """What goes wrong on the way, changed at will while it runs. noise: the share of bytes that come damaged.

    held: nothing comes through, and all of it when it ends; dropped: nothing comes through, ever; unplugged: gone.
    """

    noise: float = 0.0
    held: bool = False
    dropped: bool = False
    unplugged: bool = False


class FakePort:
    """A serial port in memory with a FakeBoard behind it. `open` gives the port and, as on a Nano, resets the board.

    waits_s: the boot loader's pause at every opening; None: opening resets nothing.
    """

    def __init__(
        self, board: FakeBoard, clock: Clock, *, name: str = "fake", waits_s: float | None = None, seed: int = 0
    ) -> None:
        self.board, self.faults = board, Faults()
        self._clock, self._name, self._waits_s = clock, name, waits_s
        self._random = random.Random(seed)
        self._held = b""

    @property
    def name(self) -> str:
        """The port's name."""
        return self._name

    def open(self, name: str) -> "FakePort":
        """Return the port itself, opened. The name is not looked at: there is but this one."""
        now_ns = self._clock.now_ns()
        self.board.transmit(now_ns)  # nobody received it
        if self._waits_s is not None:
            self.board.restart(now_ns, waits_s=self._waits_s)
        return self

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, waiting up to `timeout_s` for something.

        Raises:
            DeviceLost: it is unplugged.
        """
        deadline_ns = self._clock.now_ns() + round(timeout_s * _NS)
        while True:
            if self.faults.unplugged:
                raise DeviceLost(f"The roll encoder on {self._name} has gone: check its USB cable.")
            now_ns = self._clock.now_ns()
            data = self._through(self.board.transmit(now_ns))
            if data or now_ns >= deadline_ns:
                return data
            self._clock.wait_until_ns(min(deadline_ns, max(self.board.next_ns, now_ns + 1)))

    def write(self, data: bytes) -> None:
        """Send bytes to the board."""
        if self.faults.unplugged:
            raise DeviceLost(f"The roll encoder on {self._name} has gone: check its USB cable.")
        self.board.receive(data, self._clock.now_ns())

    def close(self) -> None:
        """Give it back."""

    def _through(self, data: bytes) -> bytes:
        """Return what is left of the board's bytes after the faults."""
        if self.faults.dropped:
            data = b""
        if self.faults.noise > 0.0:
            data = b"".join(self._noisy(each) for each in data)
        if self.faults.held:
            self._held += data
            return b""
        data, self._held = self._held + data, b""
        return data

    def _noisy(self, byte: int) -> bytes:
        if self._random.random() >= self.faults.noise:
            return bytes([byte])
        kind = self._random.randrange(4)
        damaged = byte ^ (1 << self._random.randrange(8))
        return (b"", bytes([byte, self._random.randrange(256)]), bytes([damaged]), bytes([damaged]))[kind]
