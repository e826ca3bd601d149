"""Whatever happens to the encoder: a roll that is given as valid is the truth, within the bound of docs/wire.md."""

import contextlib
import math

from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from cathxr.core import DeviceError, Rig
from cathxr.devices.clock import ManualClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_protocol import mark_of
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.runtime.roll import LiveRoll
from cathxr.storage.rig_file import example_rig

START_NS = 5_000_000_000
AMPLITUDE = 400.0
TURN_S = 1.4
"""The handle goes to and fro by 30 degrees either way: up to 135 degrees/s and 604 degrees/s^2."""
BOUND_DEG = 0.15
"""A count (0.075: half by rounding, half by setting the zero to a whole one), 604 degrees/s^2 across the 25 ms that are
bridged at most (604 * 0.025^2 / 8 = 0.05), and stamps off by 0.1 ms at 135 degrees/s (0.01)."""

Step = tuple[str, float]


class Handle:
    """A handle that swings; it can be held where it turns back, as a person in the jig would."""

    def __init__(self) -> None:
        self._held: list[tuple[int, int]] = []

    def hold(self, t_ns: int) -> int:
        """Have it held from its next turning point after `t_ns` on, for ever; return that instant."""
        half_ns = round(TURN_S * 0.5e9)
        begins = t_ns + (-self._phase_ns(t_ns)) % half_ns
        self._held.append((begins, 1 << 62))
        return begins

    def release(self, t_ns: int) -> None:
        begins, _ = self._held[-1]
        self._held[-1] = (begins, max(begins, t_ns))

    def count(self, t_ns: int) -> float:
        return AMPLITUDE * math.cos(2e-9 * math.pi * self._phase_ns(t_ns) / TURN_S)

    def _phase_ns(self, t_ns: int) -> int:
        return t_ns - sum(max(0, min(t_ns, end) - begin) for begin, end in self._held)


class Bench:
    """The live roll of a driver on a simulated board, in simulated time, and a person who looks after it."""

    def __init__(self, seed: int) -> None:
        self.rig: Rig = example_rig()
        assert self.rig.roll is not None
        self.roll = self.rig.roll
        self.clock, self.handle = ManualClock(START_NS), Handle()
        self.board = FakeBoard(
            lambda t_ns: round(self.handle.count(t_ns)), start_ns=START_NS, mark=mark_of(self.roll), drift=0.001
        )
        self.port = FakePort(self.board, self.clock, waits_s=0.3, seed=seed)
        options = {"port": "fake", "open_port": self.port.open}
        self.encoder = SerialEncoder(self.rig, clock=self.clock, options=options)
        self.live = LiveRoll(self.roll, self.encoder)
        self.is_open = False
        self.given = 0
        self.worst_deg = 0.0

    def run(self, seconds: float) -> None:
        """Do what the encoder's thread does, and look the roll up as the tracking does."""
        until_ns = self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < until_ns:
            try:
                if not self.is_open:
                    self.encoder.__enter__()
                    self.is_open = True
                reading = self.encoder.read(0.05)
            except DeviceError:
                self.close()
                self.clock.advance_ns(300_000_000)
                continue
            if reading is not None:
                self.live.add(reading)
            now_ns = self.clock.now_ns()
            for age_ns in (0, 4_000_000, 11_000_000, 60_000_000):
                self.check(now_ns - age_ns)

    def close(self) -> None:
        self.encoder.__exit__(None, None, None)
        self.live.forget()
        self.is_open = False

    def check(self, t_ns: int) -> None:
        found = self.live.at(t_ns)
        if found.roll_rad is not None:
            self.given += 1
            error_deg = math.degrees(abs(found.roll_rad - self.roll.angle_rad(self.handle.count(t_ns))))
            self.worst_deg = max(self.worst_deg, error_deg)

    def look_after(self) -> None:
        """Do what the page asks for, as an attentive person does, a second or more after the page has said it."""
        self.port.faults.held = self.port.faults.dropped = False
        self.plug()
        self.run(2.2)
        status = self.live.status(self.clock.now_ns(), running=self.is_open, error=None)
        if status.valid or not status.needs:
            return
        now_ns = self.clock.now_ns()
        right = abs(self.board.count(now_ns) - self.handle.count(now_ns)) <= 1.0
        if status.needs == "confirm" and right:
            with contextlib.suppress(DeviceError):  # it has just restarted: the jig is needed after all
                self.live.confirm()
            return
        still_ns = self.handle.hold(now_ns)
        self.run((still_ns - now_ns) * 1e-9 + 0.1)
        with contextlib.suppress(DeviceError):
            self.encoder.set_zero(round(self.handle.count(self.clock.now_ns())))
        self.run(3.0)  # noise may eat the command several times; the person lets go when the page says it is set
        self.handle.release(self.clock.now_ns())

    def plug(self) -> None:
        if self.port.faults.unplugged:
            self.port.faults.unplugged = False
            self.board.transmit(self.clock.now_ns())
            self.board.restart(self.clock.now_ns(), "power")

    def do(self, step: Step) -> None:
        kind, amount = step
        faults, now_ns = self.port.faults, self.clock.now_ns()
        if kind in ("external", "watchdog", "brownout", "power"):
            self.board.transmit(now_ns)
            self.board.restart(now_ns, kind, waits_s=amount)
        elif kind == "noise":
            faults.noise = 0.0 if faults.noise else 0.03 * amount
        elif kind == "held":
            faults.held = True
            self.run(0.8 * amount)
            faults.held = False
        elif kind == "dropped":
            faults.dropped = True
            self.run(3.0 * amount)
            faults.dropped = False
        elif kind == "unplugged":
            faults.unplugged = True
            self.run(amount)
            self.plug()
        elif kind == "bounce":
            self.board.illegal += round(30 * amount)
        elif kind == "person":
            self.look_after()
        self.run(0.3 + 0.5 * amount)


KINDS = ("external", "watchdog", "brownout", "power", "noise", "held", "dropped", "unplugged", "bounce", "person")
STEPS = st.lists(st.tuples(st.sampled_from(KINDS), st.floats(0.0, 1.0)), min_size=2, max_size=7)


@given(steps=STEPS, seed=st.integers(0, 1000))
@settings(max_examples=30, deadline=None, phases=(Phase.explicit, Phase.reuse, Phase.generate))
def test_no_sequence_of_faults_makes_a_wrong_roll_valid(steps: list[Step], seed: int) -> None:
    bench = Bench(seed)
    bench.run(0.5)
    assert bench.given == 0  # nobody has confirmed anything yet
    bench.look_after()
    for step in steps:
        bench.do(step)
    bench.port.faults.noise = 0.0
    bench.look_after()
    bench.look_after()  # a zero that noise had eaten
    before = bench.given
    bench.run(1.0)
    assert bench.given > before + 100, "roll did not become valid again"
    assert bench.worst_deg < BOUND_DEG
