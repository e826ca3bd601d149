"""The roll encoder on a serial port: what `cathxr.encoders` finds under the name "serial"."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from threading import Lock
from types import TracebackType
from typing import Any, Self

from cathxr.core import Clock, ConfigError, DeviceError, DeviceLost, DeviceNotFound, Reading, Rig, Roll
from cathxr.devices import encoder_protocol as protocol
from cathxr.devices.encoder_ports import Attempt, OpenPort, Port, SerialPort, candidates, find_board, try_port
from cathxr.devices.encoder_protocol import Identity
from cathxr.devices.encoder_stream import EncoderLink, EncoderState, EncoderStream

_NS = 1_000_000_000
_SILENCE_S = 2.0
_AGAIN_NS = 300_000_000
_LATE_NS = 100_000_000
_FULL_TURN_DEG = 360.0


@dataclass(frozen=True)
class EncoderOptions:
    """What a person chooses about the encoder. port: None searches.

    For simulations only: open_port, how a port is opened; confirmed: nobody needs to confirm the zero at the first
    opening.
    """

    port: str | None = None
    rate_hz: int = protocol.USUAL_RATE_HZ
    open_port: OpenPort = SerialPort
    confirmed: bool = False


class SerialEncoder:
    """A Source[Reading] from the board of firmware/roll_encoder.

    Stamps are the latch's instants: the board's clock turned into the host's, minus the line's own time on the wire and
    the rig's encoder_latency_s (what the computer adds). `seq` counts the board's reports, so that a lost one leaves a
    gap. `Reading.flags` are the board's (encoder_protocol) and, from 0x100 on, the host's (encoder_stream): a reading
    with any bit of INVALID gives no valid roll. Opening resets most boards; the port stays open until the source is
    left; a board that is gone is found again by entering again.
    `state` says what is known about the count; `confirm` and `set_zero` may be called from any thread.
    """

    def __init__(self, rig: Rig, *, clock: Clock, options: Mapping[str, Any]) -> None:
        if rig.roll is None:
            raise ConfigError(f"The rig {rig.name!r} has no [roll], so that counts mean nothing: add [roll] to it.")
        self._options = checked_options(options)
        self._clock, self._roll = clock, rig.roll
        self._latency_ns = round(rig.timing.encoder_latency_s * _NS)
        self._lock = Lock()
        self._port: Port | None = None
        self._stream: EncoderStream | None = None
        self._ready: deque[Reading] = deque()
        self._next_seq = 0
        self._late = self._past_losses = 0
        self._vanished = self._opened = False
        self._last_t_ns = self._heard_ns = self._said_ns = 0

    def __enter__(self) -> Self:
        if self._port is not None:
            raise DeviceError("The roll encoder is open already: close it first.")
        attempt = self._find()
        assert attempt.port is not None, "a board was found"
        assert attempt.identity is not None, "a board was found"
        per_degree = self._roll.counts_per_turn * self._roll.gear_ratio / _FULL_TURN_DEG
        stream = EncoderStream(
            mark=protocol.mark_of(self._roll),
            latency_ns=self._latency_ns,
            counts_per_degree=per_degree,
            first_seq=self._next_seq,
        )
        stream.introduce(self._believed(attempt.identity))
        if self._options.confirmed and not self._opened and not stream.state.needs_jig:
            stream.confirm()
        self._opened = True
        with self._lock:
            self._stream = stream
        self._port, self._heard_ns, self._said_ns = attempt.port, self._clock.now_ns(), 0
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()
        with self._lock:
            if self._stream is not None:
                self._next_seq = self._stream.next_seq
                self._past_losses += self._stream.missed
            self._stream = None
        self._ready.clear()

    @property
    def state(self) -> EncoderState | None:
        """What is known about the count; None while it is closed."""
        with self._lock:
            return None if self._stream is None else self._stream.state

    @property
    def link(self) -> EncoderLink | None:
        """How the line to the board does; None while it is closed."""
        with self._lock:
            return None if self._stream is None else self._stream.link

    @property
    def port_name(self) -> str | None:
        """Where the board is; None while it is closed."""
        return None if self._port is None else self._port.name

    @property
    def losses(self) -> int:
        """Reports that never came, came damaged, or came too late to be read, so far."""
        with self._lock:
            return self._late + self._past_losses + (0 if self._stream is None else self._stream.missed)

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each thing that a person has to do before roll is valid."""
        state = self.state
        return () if state is None or not state.sentence else (state.sentence,)

    def confirm(self) -> None:
        """Take a person's word that roll is right after a restart.

        Raises:
            DeviceError: it is closed, or the jig is needed.
        """
        with self._lock:
            try:
                self._opened_stream().confirm()
            except ValueError as error:
                raise DeviceError(str(error)) from error

    def set_zero(self, count: int) -> None:
        """Have the present position be `count` of this rig's zero: a person holds the handle in the jig.

        Done once `state` needs no jig any more; the board is told again until it has answered. The count of a roll
        angle is Roll.angle_rad's inverse; at roll zero it is the rig's zero_count.

        Raises:
            DeviceError: it is closed.
        """
        with self._lock:
            self._opened_stream().set_zero(count)

    def adopt(self, roll: Roll) -> None:
        """Have the board's count belong to a rig that was calibrated just now, with this encoder, in this place.

        Raises:
            DeviceError: it is closed.
        """
        with self._lock:
            self._opened_stream().adopt(protocol.mark_of(roll))

    def read(self, timeout_s: float) -> Reading | None:
        """Return the next reading, or None when none came in time. One that is over 100 ms late is left out.

        Raises:
            DeviceLost: the board has gone, or says nothing for two seconds; DeviceError: it is not open.
        """
        stream, port = self._stream, self._port
        if stream is None or port is None:
            raise DeviceError(_NOT_OPEN)
        deadline_ns = self._clock.now_ns() + round(timeout_s * _NS)
        data = self._receive(port, 0.0)  # whoever comes late is to have all that has come
        while True:
            self._take(stream, data)
            self._speak(stream, port)
            now_ns = self._clock.now_ns()
            if self._ready:
                return self._ready.popleft()
            if now_ns >= deadline_ns:
                return None
            data = self._receive(port, min((deadline_ns - now_ns) / _NS, 0.1))

    def _receive(self, port: Port, timeout_s: float) -> bytes:
        try:
            return port.read(timeout_s)
        except DeviceLost:
            self._vanished = True
            raise

    def _believed(self, identity: Identity) -> Identity:
        """Return what can be believed of a board: power goes with the port, and not every board can tell.

        Where the boot loader has wiped out the cause of a restart, memory that survived a brief loss of power looks
        like memory that was never without. The encoder was, so its count is not what it seems.
        """
        vanished, self._vanished = self._vanished, False
        if vanished and identity.cause == "unknown":
            return replace(identity, kept=False, mark=0)
        return identity

    def _take(self, stream: EncoderStream, data: bytes) -> None:
        """Turn what has come into readings that wait; leave out those that nobody fetched in time."""
        now_ns = self._clock.now_ns()
        with self._lock:
            readings = stream.take(data, now_ns)
        self._ready.extend(each for each in readings if each.t_ns > self._last_t_ns)
        if readings:
            self._heard_ns, self._last_t_ns = now_ns, max(self._last_t_ns, readings[-1].t_ns)
            while self._ready and self._ready[-1].t_ns - self._ready[0].t_ns > _LATE_NS:
                self._ready.popleft()
                self._late += 1
        elif now_ns - self._heard_ns > _SILENCE_S * _NS:
            raise DeviceLost(f"The roll encoder has reported nothing for {_SILENCE_S:g} s: check its USB cable.")

    def _speak(self, stream: EncoderStream, port: Port) -> None:
        """Send what has to be said, and again where it was not answered."""
        now_ns = self._clock.now_ns()
        if now_ns - self._said_ns < _AGAIN_NS:
            return
        with self._lock:
            said = b"" if stream.command is None else stream.command
            said += protocol.command_id() if stream.wants_identity else b""
            # A board that has restarted reports at its usual rate again.
            said += protocol.command_rate(self._options.rate_hz) if stream.rate_hz != self._options.rate_hz else b""
        if said:
            self._said_ns = now_ns
            port.write(said)

    def _opened_stream(self) -> EncoderStream:
        if self._stream is None:
            raise DeviceError(_NOT_OPEN)
        return self._stream

    def _find(self) -> Attempt:
        options = self._options
        if options.port is None:
            return find_board(self._clock, open_port=options.open_port, ports=candidates())
        attempt = try_port(options.port, "named", self._clock, open_port=options.open_port)
        if attempt.port is None:
            there = ", ".join(each.device for each in candidates()) or "none"
            raise DeviceNotFound(
                f"There is no roll encoder on {options.port}: {attempt.reason}. Serial ports of this computer: {there}."
            )
        return attempt


_NOT_OPEN = "The roll encoder is read before it is opened: use it in a with statement."


def checked_options(options: Mapping[str, Any]) -> EncoderOptions:
    """Return the options as given in a configuration.

    Raises:
        ConfigError: an option is unknown or of the wrong kind.
    """
    known = tuple(EncoderOptions.__dataclass_fields__)
    unknown = sorted(set(options) - set(known))
    if unknown:
        raise ConfigError(f"The roll encoder has no option {', '.join(unknown)}; it has port, rate_hz.")
    port, rate_hz = options.get("port"), options.get("rate_hz", protocol.USUAL_RATE_HZ)
    if port is not None and (not isinstance(port, str) or not port):
        raise ConfigError(f"The roll encoder's option port must name a port, as COM3 or /dev/ttyUSB0, not {port!r}.")
    whole = isinstance(rate_hz, int) and not isinstance(rate_hz, bool)
    if not whole or not 20 <= rate_hz <= protocol.HIGHEST_RATE_HZ:
        raise ConfigError(
            f"The roll encoder's option rate_hz must be a whole number from 20 to {protocol.HIGHEST_RATE_HZ}, "
            f"not {rate_hz!r}."
        )
    return EncoderOptions(port, rate_hz, options.get("open_port", SerialPort), options.get("confirmed") is True)
