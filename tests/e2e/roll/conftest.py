"""A hand that turns a handle, gears with play, a board, and what a host makes of it at the instants of pictures."""

from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import pi, sin

import numpy as np

from cathxr.core import FloatArray, Reading, Rig, Roll
from cathxr.devices.clock import ManualClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_protocol import mark_of
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.geometry.roll import RollFollower
from cathxr.runtime.history import History, Sample
from cathxr.storage.rig_file import example_rig

START_NS = 5_000_000_000
SECOND = 1_000_000_000
PLAY_DEG = 0.33
_FINE_NS = 1_000_000
_TREMOR_DEG, _TREMOR_HZ = 0.03, 9.0
_SPIN_DEG_S = 1080.0  # 3 turns a second


class Hand:
    """The roll of the handle at any instant: strokes to and fro, fine corrections, rests with a tremor, fast spins.

    Every move is a minimum-jerk profile (Flash, Hogan: J. Neuroscience 5(7), 1985), whose peak speed is 1.875 times its
    mean. spin_deg_s: the peak speed of the spins; one move in nine is a spin of one to four turns.
    """

    def __init__(self, seed: int, seconds: float, *, spin_deg_s: float = _SPIN_DEG_S) -> None:
        rng = np.random.default_rng([seed, 0x4A7D])
        begins, values, ends = [0.0], [0.0], [0.5]
        while ends[-1] < seconds:
            kind = rng.choice(9)
            if kind == 0:
                size = rng.choice([-1, 1]) * rng.uniform(360.0, 1440.0)
                takes = 1.875 * abs(size) / spin_deg_s
            elif kind < 5:
                size = rng.choice([-1, 1]) * rng.uniform(10.0, 90.0)
                takes = abs(size) / rng.uniform(15.0, 120.0)
            else:
                size = rng.choice([-1, 1]) * rng.uniform(1.0, 8.0)
                takes = rng.uniform(0.3, 1.2)
            begins.append(float(ends[-1] + rng.choice([0.0, rng.uniform(0.1, 2.0)])))
            ends.append(float(begins[-1] + takes))
            values.append(float(values[-1] + size))
        self._begins, self._ends, self._values = begins, ends, values

    def deg(self, t_ns: int) -> float:
        """Return the catheter's roll at the gearbox, degrees."""
        t_s = (t_ns - START_NS) / SECOND
        move = max(bisect_right(self._begins, t_s) - 1, 0)
        if move == 0:
            return 0.0
        share = min((t_s - self._begins[move]) / (self._ends[move] - self._begins[move]), 1.0)
        done = share**3 * (10.0 + share * (6.0 * share - 15.0))
        before, after = self._values[move - 1], self._values[move]
        tremor = _TREMOR_DEG * sin(2.0 * pi * _TREMOR_HZ * t_s)
        return before + done * (after - before) + tremor


class Held:
    """A hand that at times holds still, as in the jig, and then goes on where it was."""

    def __init__(self, hand: Hand) -> None:
        self._hand = hand
        self._parts = [(START_NS, START_NS, True)]  # from when on, the hand's instant then, whether it moves

    def deg(self, t_ns: int) -> float:
        """Return the catheter's roll at the gearbox, degrees."""
        return self._hand.deg(self._instant_ns(t_ns))

    def move(self, t_ns: int, moving: bool) -> None:
        """Hold still from an instant on, or move again."""
        self._parts.append((t_ns, self._instant_ns(t_ns), moving))

    def _instant_ns(self, t_ns: int) -> int:
        begin_ns, instant_ns, moving = next(each for each in reversed(self._parts) if each[0] <= t_ns)
        return instant_ns + (t_ns - begin_ns if moving else 0)


class Geared:
    """The encoder's position, driven through gears with play; asked at instants that do not go back."""

    def __init__(self, roll: Roll, deg_at: Callable[[int], float], *, play_deg: float) -> None:
        self._roll, self._deg_at, self._half = roll, deg_at, 0.5 * play_deg
        self._t_ns, self._deg = START_NS, deg_at(START_NS)

    def count(self, t_ns: int) -> int:
        """Return the count after x4 decoding."""
        while self._t_ns < t_ns:
            self._t_ns = min(self._t_ns + _FINE_NS, t_ns)
            driving = self._deg_at(self._t_ns)
            self._deg = min(max(self._deg, driving - self._half), driving + self._half)
        per_degree = self._roll.counts_per_turn * self._roll.gear_ratio / 360.0
        return int(np.floor(self._roll.zero_count + self._roll.direction * per_degree * self._deg + 0.5))


@dataclass(frozen=True)
class Looked:
    """What the host knew of the roll at a picture's instant, and what was true. sample: None where it knew nothing."""

    t_ns: int
    truth_deg: float
    sample: Sample | None


@dataclass
class RollLine:
    """The whole way from the hand to the roll at a picture's instant, on a clock that is moved by hand.

    The host looks at its port every 1 to 3 ms, and now and then not for up to 60 ms; pictures come 30 times a second
    and the roll is looked up 5 to 20 ms after their instant, when both pictures of a pair have arrived.
    """

    seed: int
    seconds: float
    backlash_deg: float | None = PLAY_DEG
    play_deg: float = PLAY_DEG
    start_us: int = 0
    drift: float = 3e-4
    spin_deg_s: float = _SPIN_DEG_S
    slipped: int = 0
    readings: list[Reading] = field(default_factory=list)

    def __post_init__(self) -> None:
        rig = example_rig()
        assert rig.roll is not None
        self.roll = replace(rig.roll, direction=-1, zero_count=1000.0, backlash_deg=self.backlash_deg)
        self.rig: Rig = replace(rig, roll=self.roll)
        self.clock = ManualClock(START_NS)
        self.hand = Held(Hand(self.seed, self.seconds + 1.0, spin_deg_s=self.spin_deg_s))
        self.geared = Geared(self.roll, self.hand.deg, play_deg=self.play_deg)
        self.board = FakeBoard(
            lambda t_ns: self.geared.count(t_ns) + self.slipped,
            start_ns=START_NS,
            mark=mark_of(self.roll),
            drift=self.drift,
            start_us=self.start_us,
        )
        self.port = FakePort(self.board, self.clock, seed=self.seed)
        self.history = History(RollFollower(self.roll))
        self.rng = np.random.default_rng([self.seed, 0x11E])
        self.encoder = SerialEncoder(
            self.rig, clock=self.clock, options={"port": "fake", "open_port": self.port.open, "confirmed": True}
        )

    def looked_up(self) -> Iterator[Looked]:
        """Yield every picture's roll. Raises what the encoder raises."""
        with self.encoder:
            yield from self.looks(self.clock.now_ns() + SECOND // 2, START_NS + round(self.seconds * SECOND))

    def looks(self, from_ns: int, until_ns: int) -> Iterator[Looked]:
        """Yield the roll at the pictures' instants of a stretch of time, with the encoder open."""
        for picture_ns in range(from_ns, until_ns, SECOND // 30):
            self.receive(picture_ns + int(self.rng.uniform(5e6, 20e6)))
            yield Looked(picture_ns, self.hand.deg(picture_ns), self.history.at(picture_ns))

    def receive(self, until_ns: int) -> None:
        """Have the host read its port until an instant."""
        while self.clock.now_ns() < until_ns:
            pause_ns = self.rng.uniform(1e6, 3e6) if self.rng.random() > 0.002 else self.rng.uniform(5e6, 60e6)
            self.clock.wait_until_ns(min(self.clock.now_ns() + int(pause_ns), until_ns))
            while (reading := self.encoder.read(0.0)) is not None:
                self.readings.append(reading)
                self.history.add(reading)

    def error_deg(self, looked: Looked) -> float | None:
        """Return how far the host's roll is from the hand's, degrees; None where it gave none."""
        if looked.sample is None:
            return None
        return float(np.degrees(self.roll.angle_rad(looked.sample.count)) - looked.truth_deg)


def errors_deg(line: RollLine) -> FloatArray:
    """Return the errors (N,) at all of a line's pictures, degrees; NaN where the host knew nothing."""
    found = [line.error_deg(each) for each in line.looked_up()]
    return np.array([np.nan if each is None else each for each in found])
