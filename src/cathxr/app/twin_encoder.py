"""The twin's roll encoder: a simulated board on the gears of the simulated box, read through the real driver."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from cathxr.core import Clock, ConfigError, Rig
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_protocol import mark_of
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.runtime.commands import Command, only
from cathxr.twin import TwinWorld
from cathxr.twin.gears import Gears

PORT = "twin"
_GARBAGE = 0.02
"""The share of bytes that come damaged: nearly every second line."""


class TwinPort(FakePort):
    """The simulated board's port, with faults that any thread may order; they happen in the thread that reads."""

    def __init__(self, board: FakeBoard, clock: Clock) -> None:
        super().__init__(board, clock, name=PORT)
        self._time = clock
        self._ordered: deque[str] = deque()

    def order(self, fault: str) -> None:
        """Have a fault of FAULTS happen at the next read."""
        self._ordered.append(fault)

    def open(self, name: str) -> "TwinPort":
        """Return the port itself, opened; opening does not reset this board."""
        self._happen()
        super().open(name)
        return self

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, waiting up to `timeout_s`. Raises DeviceLost while it is unplugged."""
        self._happen()
        return super().read(timeout_s)

    def _happen(self) -> None:
        while self._ordered:
            _ORDERS[self._ordered.popleft()](self, self._time.now_ns())

    def restart(self, t_ns: int, cause: str) -> None:
        """Restart the board."""
        self.board.transmit(t_ns)  # what was under way is cut off
        self.board.restart(t_ns, cause)

    def plug(self, t_ns: int) -> None:
        """Plug it in again, if it is not: the board had no power meanwhile."""
        if self.faults.unplugged:
            self.faults.unplugged = False
            self.restart(t_ns, "power")


def _unplug(port: TwinPort, _: int) -> None:
    port.faults.unplugged = True


def _garbage(port: TwinPort, _: int) -> None:
    port.faults.noise = _GARBAGE


def _none(port: TwinPort, t_ns: int) -> None:
    port.faults.noise = 0.0
    port.plug(t_ns)


_ORDERS: Mapping[str, Callable[[TwinPort, int], None]] = MappingProxyType(
    {
        "reset": lambda port, t_ns: port.restart(t_ns, "external"),
        "power": lambda port, t_ns: port.restart(t_ns, "power"),
        "unplug": _unplug,
        "garbage": _garbage,
        "none": _none,
    }
)
FAULTS = tuple(_ORDERS)
"""reset: the board restarts and keeps its count; power: and loses it; unplug: until "none"; garbage: damaged bytes,
until "none"."""


def twin_encoder(
    world: TwinWorld, rig: Rig, *, clock: Clock, play_deg: float | None = None, stamp_error_s: float | None = None
) -> tuple[SerialEncoder, TwinPort]:
    """Return the driver of the twin's encoder, closed, and the port it is on. The zero is known and confirmed at first.

    rig: what the driver is told, with its [roll]; the gears are of the world's own rig. play_deg: of these, at the
    catheter; unless given, what that rig states, else the scene's. stamp_error_s: how late the device's own stamps are,
    before the rig's latency is subtracted; unless given, the rig is right.

    Raises:
        ConfigError: a rig has no [roll].
    """
    gears, told = world.rig_true.roll, rig.roll
    if gears is None or told is None:
        raise ConfigError(f"The rig {rig.name!r} has no [roll] and so no encoder to simulate: add [roll] to it.")
    play = gears.backlash_deg if play_deg is None else play_deg
    turned = Gears(world, gears, play_deg=play)
    board = FakeBoard(turned.count, start_ns=clock.now_ns(), mark=mark_of(told))
    port = TwinPort(board, clock)
    known_s = rig.timing.encoder_latency_s
    error_s = 0.0 if stamp_error_s is None else stamp_error_s - known_s
    # The simulated board has no latency but the line's, which the driver knows: what it subtracts makes the error.
    timing = replace(rig.timing, encoder_latency_s=-error_s)
    options = {"port": PORT, "open_port": port.open, "confirmed": True}
    return SerialEncoder(replace(rig, timing=timing), clock=clock, options=options), port


def fault_command(port: TwinPort) -> Command:
    """Return the command that makes a fault of FAULTS happen to the twin's encoder: {kind}."""

    def encoder_fault(args: Mapping[str, Any]) -> Mapping[str, Any]:
        only("encoder_fault", args, ("kind",))
        kind = args.get("kind")
        if kind not in FAULTS:
            raise ConfigError(f"There is no encoder fault {kind!r}: there are {', '.join(FAULTS)}.")
        port.order(str(kind))
        return {"kind": kind}

    return encoder_fault
