"""The serial encoder on the fake board in memory: validity, restarts, losses, and that no wrong angle is ever valid."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cathxr.core import ConfigError, DeviceError, DeviceLost, DeviceNotFound, Reading, Rig
from cathxr.devices.clock import ManualClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort, Faults
from cathxr.devices.encoder_protocol import KEPT, mark_of
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.devices.encoder_stream import INVALID, MISCOUNTED, NO_ZERO, UNCONFIRMED
from cathxr.storage.rig_file import example_rig

START_NS = 5_000_000_000


class Handle:
    """A handle that somebody turns to and fro at up to 800 counts/s, and holds still at times."""

    def __init__(self) -> None:
        self._parts = [(0, 0, False)]  # from when on, the phase then, whether it moves

    def __call__(self, t_ns: int) -> int:
        return round(400 * np.sin(self._phase_ns(t_ns) * 2e-9))

    def move(self, t_ns: int, moving: bool) -> None:
        self._parts.append((t_ns, self._phase_ns(t_ns), moving))

    def _phase_ns(self, t_ns: int) -> int:
        start_ns, phase_ns, moving = next(each for each in reversed(self._parts) if each[0] <= t_ns)
        return phase_ns + (t_ns - start_ns if moving else 0)


class Bench:
    """A rig, a handle that is turned, a board, a port, and the encoder on it."""

    def __init__(self, *, known: bool = True, waits_s: float | None = 1.0, seed: int = 0, **board: Any) -> None:
        rig = example_rig()
        assert rig.roll is not None
        self.rig: Rig = rig
        self.clock = ManualClock(START_NS)
        self.handle = Handle()
        self.turn: Callable[[int], int] = self.handle
        mark = mark_of(rig.roll) if known else 0
        self.board = FakeBoard(lambda t_ns: self.turn(t_ns), start_ns=START_NS, mark=mark, **board)
        self.port = FakePort(self.board, self.clock, waits_s=waits_s, seed=seed)

    def move(self, moving: bool = True) -> None:
        self.handle.move(self.clock.now_ns(), moving)

    def encoder(self, rig: Rig | None = None, **options: Any) -> SerialEncoder:
        given = {"port": "fake", "open_port": self.port.open, **options}
        return SerialEncoder(rig or self.rig, clock=self.clock, options=given)

    def readings(self, encoder: SerialEncoder, seconds: float) -> list[Reading]:
        """Read for so long."""
        found, until_ns = [], self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < until_ns:
            reading = encoder.read(0.05)
            if reading is not None:
                found.append(reading)
        return found

    def error(self, reading: Reading) -> float:
        """Return how far a reading's count is from the handle's true position then, in counts."""
        # A stamp may be off by the transmission's 3 ms; at the sine's 800 counts/s that is 2.4 counts.
        return reading.count - self.turn(reading.t_ns)


def test_counts_and_stamps_follow_the_handle() -> None:
    bench = Bench()
    with bench.encoder() as encoder:
        encoder.confirm()
        bench.move()
        found = bench.readings(encoder, 3.0)
    assert len(found) == pytest.approx(600, abs=2)
    assert {each.flags for each in found} == {KEPT | 1 << 4}
    # The lines' own time on the wire, 2.1 to 2.7 ms, is taken off, and nothing else holds them up: what is left is the
    # step of 4 us of micros() and of a count.
    assert max(abs(bench.error(each)) for each in found) <= 1
    assert encoder.losses == 0


def test_nothing_is_valid_before_a_person_has_confirmed_it() -> None:
    bench = Bench()
    with bench.encoder() as encoder:
        assert encoder.state is not None
        assert encoder.state.needs_confirmation
        assert not encoder.state.needs_jig
        assert "confirm" in encoder.warnings[0]
        assert {each.flags & INVALID for each in bench.readings(encoder, 0.3)} == {UNCONFIRMED}
        encoder.confirm()
        assert encoder.warnings == ()
        assert {each.flags & INVALID for each in bench.readings(encoder, 0.3)} == {0}
    with bench.encoder() as encoder:  # opened again, reset again
        assert {each.flags & INVALID for each in bench.readings(encoder, 0.3)} == {UNCONFIRMED}


def test_without_its_zero_the_jig_is_needed_and_enough() -> None:
    bench = Bench(known=False)
    with bench.encoder() as encoder:
        assert {each.flags & INVALID for each in bench.readings(encoder, 0.3)} == {UNCONFIRMED | NO_ZERO}
        assert "jig" in encoder.warnings[0]
        with pytest.raises(DeviceError, match="jig"):
            encoder.confirm()
        bench.turn = lambda t_ns: 1234
        encoder.set_zero(-50)
        found = bench.readings(encoder, 0.5)
    valid = [each for each in found if not each.flags & INVALID]
    assert len(valid) > 80
    assert {each.count for each in valid} == {-50}
    with bench.encoder() as encoder:  # the board knows the zero now: a click is enough
        assert encoder.state is not None
        assert not encoder.state.needs_jig


def test_while_the_zero_is_being_set_nothing_is_valid() -> None:
    # Where the answer is lost on the way, the count is another already and nobody knows: it must not be valid.
    bench = Bench()
    with bench.encoder() as encoder:
        encoder.confirm()
        bench.readings(encoder, 0.1)
        encoder.set_zero(5000)
        with pytest.raises(DeviceError, match="wait a moment"):
            encoder.confirm()
        bench.port.faults.dropped = True
        bench.readings(encoder, 0.1)
        bench.port.faults.dropped = False
        found = bench.readings(encoder, 0.15)
        assert {each.count for each in found} == {5000}
        assert all(each.flags & UNCONFIRMED for each in found)
        # It is told again, and the answer makes it valid.
        assert not bench.readings(encoder, 0.5)[-1].flags & INVALID


def test_the_zero_of_another_rig_is_not_this_ones() -> None:
    bench = Bench()
    assert bench.rig.roll is not None
    other = replace(bench.rig, roll=replace(bench.rig.roll, zero_count=77))
    with bench.encoder(other) as encoder:
        assert encoder.state is not None
        assert encoder.state.needs_jig
        assert "does not belong" in encoder.state.sentence


def test_a_rig_calibrated_just_now_adopts_the_count() -> None:
    bench = Bench()
    assert bench.rig.roll is not None
    better = replace(bench.rig, roll=replace(bench.rig.roll, zero_count=77))
    with bench.encoder() as encoder:
        assert better.roll is not None
        bench.move()
        encoder.adopt(better.roll)
        before = bench.readings(encoder, 0.5)
        assert abs(bench.error(before[-1])) <= 4
    with bench.encoder(better) as encoder:
        assert encoder.state is not None
        assert not encoder.state.needs_jig


@pytest.mark.parametrize("announced", [True, False])
@pytest.mark.parametrize("cause", ["external", "watchdog", "brownout", "power"])
def test_a_restart_under_way_ends_validity(cause: str, announced: bool) -> None:
    bench = Bench()
    with bench.encoder() as encoder:
        encoder.confirm()
        bench.move()
        before = bench.readings(encoder, 0.5)
        bench.move(False)
        bench.board.restart(bench.clock.now_ns(), cause)
        if not announced:
            bench.port.faults.dropped = True
            bench.readings(encoder, 0.075)
            bench.port.faults.dropped = False
        after = bench.readings(encoder, 1.0)
        state = encoder.state
    assert state is not None
    assert before
    assert len(after) > 150
    assert all(each.flags & UNCONFIRMED for each in after)
    lost = cause in ("brownout", "power")
    assert state.cause == cause
    assert state.needs_jig == lost
    assert state.kept != lost
    assert state.restarts_seen == 1
    # It is asked for what its missing announcement did not say, and until it has answered the jig is called for.
    assert {bool(each.flags & NO_ZERO) for each in after[100:]} == {lost}
    assert all(one.seq < other.seq and one.t_ns < other.t_ns for one, other in zip(before + after, after, strict=False))


def test_a_turn_while_the_board_restarts_is_said() -> None:
    bench = Bench(waits_s=1.0)
    bench.turn = lambda t_ns: 3 * (t_ns // 1_000_000_000)
    with bench.encoder() as encoder:
        bench.readings(encoder, 0.1)
        assert "turned meanwhile" in encoder.warnings[0]


def test_the_rate_is_set_and_set_again_after_a_restart() -> None:
    bench = Bench()
    with bench.encoder(rate_hz=50) as encoder:
        bench.readings(encoder, 0.5)
        assert len(bench.readings(encoder, 1.0)) == pytest.approx(50, abs=1)
        bench.board.restart(bench.clock.now_ns(), "watchdog")
        bench.readings(encoder, 1.0)
        assert len(bench.readings(encoder, 1.0)) == pytest.approx(50, abs=1)


def test_silence_and_unplugging_end_it() -> None:
    bench = Bench()
    with bench.encoder() as encoder:
        bench.port.faults.dropped = True
        with pytest.raises(DeviceLost, match="nothing for 2 s"):
            bench.readings(encoder, 3.0)
    bench.port.faults.dropped = False
    with bench.encoder() as encoder:
        bench.port.faults.unplugged = True
        with pytest.raises(DeviceLost, match="has gone"):
            bench.readings(encoder, 1.0)


@pytest.mark.parametrize(("cause", "jig"), [("unknown", True), ("external", False)])
def test_a_port_that_vanished_took_the_power_along_unless_the_board_knows_better(cause: str, jig: bool) -> None:
    bench = Bench(waits_s=None)
    encoder = bench.encoder()
    with encoder:
        bench.port.faults.unplugged = True
        with pytest.raises(DeviceLost):
            encoder.read(0.1)
    bench.port.faults.unplugged = False
    bench.board.restart(bench.clock.now_ns(), cause)
    with encoder:
        assert encoder.state is not None
        assert encoder.state.needs_jig == jig


def test_what_was_held_up_is_stamped_with_its_own_time() -> None:
    bench = Bench()
    with bench.encoder() as encoder:
        encoder.confirm()
        bench.move()
        bench.readings(encoder, 2.0)
        bench.port.faults.held = True
        assert bench.readings(encoder, 0.09) == []
        bench.port.faults.held = False
        found = bench.readings(encoder, 0.1)
    assert len(found) > 30
    assert max(abs(bench.error(each)) for each in found) <= 4
    assert encoder.losses == 0


def test_disturbed_wiring_ends_validity() -> None:
    bench = Bench()
    with bench.encoder() as encoder:
        encoder.confirm()
        bench.board.illegal = 1
        assert not any(each.flags & INVALID for each in bench.readings(encoder, 0.3))
        # 13.3 counts a degree of roll and at most 4 counts off at each: three may be 0.9 degrees.
        bench.board.illegal = 4
        assert bench.readings(encoder, 0.3)[-1].flags & MISCOUNTED
        assert "cable" in encoder.warnings[0]
        encoder.set_zero(0)
        assert not bench.readings(encoder, 0.3)[-1].flags & INVALID


def test_the_boards_clock_may_go_around() -> None:
    bench = Bench(start_us=2**32 - 3_000_000, waits_s=None, drift=0.003)
    with bench.encoder() as encoder:
        encoder.confirm()
        bench.move()
        found = bench.readings(encoder, 6.0)
    assert len(found) == pytest.approx(1200, abs=10)
    assert max(abs(bench.error(each)) for each in found) <= 5
    assert encoder.losses == 0


FAULTS = ("noise", "heavy", "hold", "drop", "watchdog", "brownout", "unplug", "none")


def make_valid(bench: Bench, encoder: SerialEncoder) -> None:
    """Do what a person does: hold the handle, compare it with the picture, and confirm or use the jig."""
    bench.port.faults = Faults()
    bench.move(False)
    bench.readings(encoder, 0.5)
    state, here = encoder.state, bench.turn(bench.clock.now_ns())
    assert state is not None
    off = bench.readings(encoder, 0.1)[-1].count != here  # what was turned during a restart is seen in the picture
    if state.needs_jig or state.miscounted or off:
        encoder.set_zero(here)
        bench.readings(encoder, 0.5)
    elif state.needs_confirmation:
        encoder.confirm()
    assert encoder.state is not None
    assert encoder.state.valid
    bench.move()


@pytest.mark.parametrize("seed", range(4))
def test_no_damage_makes_a_wrong_angle_valid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bench = Bench(waits_s=0.2, seed=seed, drift=float(rng.uniform(-0.005, 0.005)))
    errors, faults = [], 0
    encoder = bench.encoder()
    while faults < 100:
        bench.port.faults = Faults()
        try:
            with encoder:
                make_valid(bench, encoder)
                for _ in range(10):
                    fault = str(rng.choice(FAULTS))
                    faults += fault != "none"
                    noise = {"noise": 0.01, "heavy": 0.3}.get(fault, 0.0)
                    unplugged = fault == "unplug" and bool(rng.random() < 0.3)
                    bench.port.faults = Faults(noise, fault == "hold", fault == "drop", unplugged)
                    if fault in ("watchdog", "brownout"):
                        bench.board.restart(bench.clock.now_ns(), fault)
                    found = bench.readings(encoder, float(rng.uniform(0.05, 0.4)))
                    errors += [abs(bench.error(each)) for each in found if not each.flags & INVALID]
        except DeviceLost:
            pass
    assert len(errors) > 300
    # 800 counts/s for the 3 ms that a line takes, plus 5 ms of drift in the first second of a clock, and a rounding.
    assert max(errors) <= 8


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"baud": 9600}, "no option baud; it has port, rate_hz"),
        ({"port": 3}, "must name a port"),
        ({"port": ""}, "must name a port"),
        ({"rate_hz": 1000}, "from 20 to 400"),
        ({"rate_hz": True}, "whole number"),
        ({"rate_hz": 99.5}, "whole number"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        SerialEncoder(example_rig(), clock=ManualClock(), options=options)


def test_a_rig_without_roll_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"no \[roll\]"):
        SerialEncoder(replace(example_rig(), roll=None), clock=ManualClock(), options={})


def test_a_port_that_is_not_there_is_named() -> None:
    encoder = SerialEncoder(example_rig(), clock=ManualClock(), options={"port": "/dev/no-such-port"})
    with pytest.raises(DeviceNotFound, match="/dev/no-such-port: there is no such port"):
        encoder.__enter__()
