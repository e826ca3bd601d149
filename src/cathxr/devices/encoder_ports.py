"""Finding the roll encoder's serial port: USB IDs only order the candidates; what the board says of itself decides."""

import contextlib
import errno
import os
import platform
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import serial
from serial.tools import list_ports

from cathxr.core import Clock, DeviceLost, DeviceNotFound
from cathxr.devices import encoder_protocol as protocol
from cathxr.devices.encoder_protocol import Identity, LineReader, Report, Stranger

PATIENCE_S = 4.0
"""How long a board may take to name itself: the Nano's old boot loader waits two seconds after every opening."""
_FIRST_QUESTION_S = 2.5
_QUESTIONS_S = 0.5
_POLL_S = 0.02
_MOST_AT_ONCE = 8

_CH340 = {(0x1A86, each) for each in (0x7523, 0x7522, 0x5523, 0x55D4, 0x55D3)}
_OTHERS = {(0x0403, 0x6001), (0x0403, 0x6015), (0x10C4, 0xEA60), (0x067B, 0x2303), (0x067B, 0x23A3)}
_ARDUINO = {0x2341, 0x2A03}


class Port(Protocol):
    """An open serial port, real or not."""

    @property
    def name(self) -> str: ...

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, waiting up to `timeout_s` for the first byte. Raises DeviceLost when it has gone."""
        ...

    def write(self, data: bytes) -> None: ...

    def close(self) -> None: ...


OpenPort = Callable[[str], Port]


@dataclass(frozen=True)
class Candidate:
    """A port that may have the board on it. rank: lower is likelier; what: the port's own words about itself."""

    device: str
    what: str
    rank: int
    usb: bool


@dataclass(frozen=True)
class Attempt:
    """What came of trying one port: a board and the port it is on, still open, or why not."""

    device: str
    what: str
    reason: str = ""
    port: Port | None = None
    identity: Identity | None = None


class SerialPort:
    """A real port through pyserial, for this program alone."""

    def __init__(self, device: str) -> None:
        try:
            self._serial = serial.Serial(device, protocol.BAUD, timeout=_POLL_S, write_timeout=1.0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise DeviceNotFound(why_not_opened(device, error)) from error
        self.name = device

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, waiting up to `timeout_s` for the first byte.

        Raises:
            DeviceLost: the port has gone.
        """
        until = time.monotonic() + timeout_s
        try:
            while True:
                waiting = self._serial.in_waiting
                if waiting:
                    return bytes(self._serial.read(waiting))
                left = until - time.monotonic()
                if left >= _POLL_S:
                    first = bytes(self._serial.read(1))
                    if first:
                        return first + bytes(self._serial.read(self._serial.in_waiting))
                elif left > 0:
                    time.sleep(min(left, 0.001))
                else:
                    return b""
        except (serial.SerialException, OSError, TypeError) as error:  # TypeError: pyserial, closed while it reads
            raise DeviceLost(f"The roll encoder on {self.name} has gone: check its USB cable.") from error

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            DeviceLost: the port has gone or takes no more.
        """
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError) as error:
            raise DeviceLost(f"The roll encoder on {self.name} takes no commands: check its USB cable.") from error

    def close(self) -> None:
        """Give the port back."""
        with contextlib.suppress(serial.SerialException, OSError):
            self._serial.close()


def why_not_opened(device: str, error: BaseException) -> str:
    """Return why a port could not be opened, and what to do, without a full stop."""
    number = getattr(error, "errno", None)
    text = str(error)
    windows = platform.system() == "Windows"
    if "exclusively lock" in text or number in (errno.EBUSY, errno.EAGAIN) or (windows and "denied" in text):
        return "another program has it open (a Serial Monitor?): close that"
    if number in (errno.EACCES, errno.EPERM) or "Permission denied" in text:
        return f"you may not open it: {_permission_advice(device)}"
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or "FileNotFoundError" in text:
        return "there is no such port"
    return f"it cannot be opened ({text or type(error).__name__})"


def _permission_advice(device: str) -> str:
    """Return which group to join, read from the device itself where there are such groups."""
    if os.name == "nt":
        return "ask whoever administers this computer"
    import grp  # exists on POSIX only

    try:
        group = grp.getgrgid(os.stat(device).st_gid).gr_name
    except (OSError, KeyError):
        group = "dialout"
    return f"join the group {group} (sudo usermod -aG {group} $USER), then log out and in again"


def candidates() -> list[Candidate]:
    """Return the serial ports of this computer, likeliest first."""
    found = []
    for each in list_ports.comports():
        usb = each.vid is not None
        what = each.description if each.description and each.description != "n/a" else "a serial port"
        found.append(Candidate(each.device, what, _rank(each.vid, each.pid), usb))
    return sorted(found, key=lambda each: (each.rank, each.device))


def _rank(vid: int | None, pid: int | None) -> int:
    if vid is None:
        return 4
    if (vid, pid) in _CH340:
        return 0
    if vid in _ARDUINO:
        return 1
    return 2 if (vid, pid) in _OTHERS else 3


def find_board(clock: Clock, *, open_port: OpenPort, ports: Sequence[Candidate]) -> Attempt:
    """Return the one board among the ports, its port still open: opening it again would reset it again.

    Every USB port is tried, all at the same time, so that a second board is noticed. Other ports are not: opening one
    may disturb what is on it; a person can name it.

    Raises:
        DeviceNotFound: there is no board, or more than one; the sentence lists every port with what came of it.
    """
    likely = [each for each in ports if each.usb]
    with ThreadPoolExecutor(max_workers=_MOST_AT_ONCE, thread_name_prefix="encoder-search") as pool:
        attempts = list(pool.map(lambda each: try_port(each.device, each.what, clock, open_port=open_port), likely))
    boards = [each for each in attempts if each.port is not None]
    if len(boards) == 1:
        return boards[0]
    for each in boards:
        assert each.port is not None, "it is a board"
        each.port.close()
    if boards:
        names = " and ".join(each.device for each in boards)
        raise DeviceNotFound(f"There are {len(boards)} roll encoders, on {names}: name one with the option port.")
    others = [Attempt(each.device, each.what, "not tried, as it is no USB port") for each in ports if not each.usb]
    raise DeviceNotFound(_nowhere([*attempts, *others]))


def _nowhere(attempts: Sequence[Attempt]) -> str:
    if not attempts:
        return "There is no roll encoder: this computer has no serial port; connect the board with a USB data cable."
    tried = "; ".join(f"{each.device} ({each.what}): {each.reason}" for each in attempts)
    return f"No roll encoder was found. {tried}."


def try_port(device: str, what: str, clock: Clock, *, open_port: OpenPort) -> Attempt:
    """Return what is on a port: the board, with its port left open, or why it is none."""
    try:
        port = open_port(device)
    except DeviceNotFound as error:
        return Attempt(device, what, str(error))
    try:
        answer = ask_identity(port, clock)
    except DeviceLost:
        port.close()
        return Attempt(device, what, "it vanished while it was asked")
    except BaseException:
        port.close()
        raise
    if isinstance(answer, Identity):
        return Attempt(device, what, "", port, answer)
    port.close()
    return Attempt(device, what, answer)


def ask_identity(port: Port, clock: Clock) -> Identity | str:
    """Return who the board says it is, or why what is there is no roll encoder.

    Most boards restart when their port is opened and then name themselves. One that reports already is asked at once;
    a silent one is asked only when a boot loader can no longer take the question for its own.
    """
    reader, start_ns, received, ask_s, asked = LineReader(), clock.now_ns(), 0, _FIRST_QUESTION_S, False
    while (waited_s := (clock.now_ns() - start_ns) * 1e-9) < PATIENCE_S:
        data = port.read(max(0.0, min(ask_s, PATIENCE_S) - waited_s))
        received += len(data)
        for message in reader.feed(data):
            if isinstance(message, Identity):
                return message
            if isinstance(message, Stranger):
                return _strange(message)
            if isinstance(message, Report) and not asked:
                ask_s = 0.0
        waited_s = (clock.now_ns() - start_ns) * 1e-9
        if waited_s >= ask_s:
            port.write(b"\n" + protocol.command_id())
            ask_s, asked = waited_s + _QUESTIONS_S, True
    if received == 0:
        return "what is there says nothing: another device, or the board without this project's firmware"
    return "what is there says something else: another device, or the board with another sketch"


def _strange(stranger: Stranger) -> str:
    if stranger.name != protocol.NAME:
        return f"it is a {stranger.name}, not a {protocol.NAME}"
    return (
        f"its firmware speaks protocol {stranger.protocol} and this program speaks {protocol.PROTOCOL}: "
        "flash the firmware that came with this program, or update the program"
    )
