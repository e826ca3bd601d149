"""The host's encoder on the real firmware through pyserial, at the pace of a real board, with faults to order."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from cathxr.core import DeviceLost, DeviceNotFound, Reading
from cathxr.devices.clock import MonotonicClock
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.devices.encoder_stream import INVALID
from cathxr.storage.rig_file import example_rig

from .conftest import HZ, Board, Built, quadrature

EDGES_S = 40.0
"""How fast the handle is turned: 3 degrees of roll a second. Slow, for a busy computer's sake: see PAUSE_S."""
PAUSE_S = 0.25
"""By how much a busy computer may hold up the simulation against the host's clock: 10 counts, 0.75 degrees."""
WITHIN_PAUSES = 3
"""What may be left then, counts: less than a degree with the pause's own."""
FAULTS = ("noise 0.002", "noise 0.05", "noise 0.5", "hold", "drop", "inject", "none")


class Hand:
    """Turns the simulated encoder and knows at every instant of the host's clock where it stood."""

    def __init__(self, board: Board, folder: Path) -> None:
        self._board, self._times = board, folder / "times.bin"
        self._at_cycle, self._position = [np.zeros(1, np.int64)], [np.zeros(1, np.int64)]
        board.ask(f"times {self._times}")

    @property
    def position(self) -> int:
        return int(self._position[-1][-1])

    @property
    def rests(self) -> bool:
        """Whether the encoder has been turned by all that it was to be."""
        return self._board.ask("state").split()[3] == "0"

    def turn(self, steps: int) -> None:
        """Begin to turn by so many counts; it takes steps / EDGES_S seconds. What was begun before must have ended."""
        assert self.rests, "turned before it rested"
        path = np.full(abs(steps), int(np.sign(steps)), np.int64)
        cycles, inputs = quadrature(path, EDGES_S, phase_error=0.2, jitter=0.1, start=self.position)
        start = self._board.play(cycles, inputs)
        self._at_cycle.append(start + cycles.astype(np.int64))
        self._position.append(self.position + np.cumsum(path))

    def worst_error(self, readings: list[Reading]) -> float:
        """Return by how many counts the worst of these readings is off, whatever the simulation's pace was."""
        if not readings:
            return 0.0
        times = np.fromfile(self._times, "<u8")
        times = times[: len(times) // 2 * 2].reshape(-1, 2).astype(np.int64)
        cycles, positions = np.concatenate(self._at_cycle), np.concatenate(self._position)
        worst = 0
        for each in readings:
            reach = [each.t_ns - 1e9 * PAUSE_S, each.t_ns + 1e9 * PAUSE_S]
            low, high = np.interp(reach, times[:, 1], times[:, 0])
            first, last = np.searchsorted(cycles, [low - 0.006 * HZ, high], side="right")
            around = positions[max(0, first - 1) : last + 1]
            worst = max(worst, int(np.maximum(around.min() - each.count, each.count - around.max())))
        return worst


@pytest.fixture
def board(built: Built, tmp_path: Path) -> Iterator[Board]:
    with Board(built, tmp_path) as made:
        made.ask("pace on")
        yield made


def encoder_on(board: Board) -> SerialEncoder:
    return SerialEncoder(example_rig(), clock=MonotonicClock(), options={"port": board.port_name})


def readings(encoder: SerialEncoder, seconds: float) -> list[Reading]:
    clock, found = MonotonicClock(), []
    until_ns = clock.now_ns() + round(seconds * 1e9)
    while clock.now_ns() < until_ns:
        reading = encoder.read(0.05)
        if reading is not None:
            found.append(reading)
    return found


def readings_until(encoder: SerialEncoder, hand: Hand) -> list[Reading]:
    """Read until the hand rests."""
    found = readings(encoder, 0.1)
    while not hand.rests:
        found += readings(encoder, 0.1)
    return found


def make_valid(board: Board, encoder: SerialEncoder, hand: Hand) -> None:
    """Do what a person does while the handle rests: confirm, or use the jig."""
    board.ask("noise 0 0")
    board.ask("line pass")
    readings_until(encoder, hand)
    readings(encoder, 0.3)
    state = encoder.state
    assert state is not None
    if state.needs_jig or state.miscounted:
        encoder.set_zero(hand.position)
        for _ in range(20):
            readings(encoder, 0.1)
            if encoder.state is not None and encoder.state.valid:
                break
    elif state.needs_confirmation:
        encoder.confirm()
    assert encoder.state is not None
    assert encoder.state.valid


def test_roll_through_the_whole_chain(board: Board, tmp_path: Path) -> None:
    hand = Hand(board, tmp_path)
    with encoder_on(board) as encoder:
        assert all(each.flags & INVALID for each in readings(encoder, 0.3))
        make_valid(board, encoder, hand)
        hand.turn(30)
        found = readings_until(encoder, hand)
        hand.turn(-50)
        found += readings_until(encoder, hand) + readings(encoder, 0.5)
    assert not any(each.flags & INVALID for each in found)
    assert found[-1].count == -20
    assert hand.worst_error(found) <= WITHIN_PAUSES


def test_an_unplugged_board_is_found_again(board: Board, tmp_path: Path) -> None:
    hand = Hand(board, tmp_path)
    encoder = encoder_on(board)
    with encoder:
        make_valid(board, encoder, hand)
        board.ask("unplug")
        with pytest.raises(DeviceLost):
            readings(encoder, 3.0)
    with pytest.raises(DeviceNotFound):
        encoder.__enter__()
    board.port_name = board.ask("plug")
    with encoder_on(board) as encoder:
        # With the cable went the power: the jig, and nothing less, makes it valid again.
        assert all(each.flags & INVALID for each in readings(encoder, 0.3))
        assert encoder.state is not None
        assert encoder.state.needs_jig
        make_valid(board, encoder, hand)


def faults(board: Board, tmp_path: Path, seconds: float, seed: int) -> tuple[int, int, float]:
    """Turn and disturb for so long; return how many faults, how many valid readings, and the worst of their errors."""
    rng, clock, hand = np.random.default_rng(seed), MonotonicClock(), Hand(board, tmp_path)
    until_ns = clock.now_ns() + round(seconds * 1e9)
    injected, checked, valid = 0, 0, []
    worst = 0.0
    while clock.now_ns() < until_ns:
        with suppress(DeviceLost), encoder_on(board) as encoder:
            while clock.now_ns() < until_ns:
                make_valid(board, encoder, hand)
                for _ in range(4):
                    fault = str(
                        rng.choice(["noise 0.002", "noise 0.05", "noise 0.5", "hold", "drop", "inject", "none"])
                    )
                    injected += fault != "none"
                    board.ask("line " + (fault if fault in ("hold", "drop") else "pass"))
                    board.ask(f"{fault} {rng.integers(1, 2**31)}" if fault.startswith("noise") else "noise 0 0")
                    if fault == "inject":
                        board.ask("inject " + rng.bytes(60).hex())
                    hand.turn(int(rng.choice([-1, 1]) * rng.integers(5, 16)))
                    valid += [each for each in readings_until(encoder, hand) if not each.flags & INVALID]
                board.ask("noise 0 0")
                board.ask("line pass")
                valid += [each for each in readings(encoder, 0.1) if not each.flags & INVALID]
                if rng.random() < 0.6:  # the handle rests, and the board is reset
                    injected += 1
                    board.ask("reset " + str(rng.choice(["external", "watchdog", "brownout", "power"])))
                    # What was on the way is of before; from the first sign of the restart on nothing is valid.
                    valid += [each for each in readings(encoder, 0.3) if not each.flags & INVALID]
                worst, checked = max(worst, hand.worst_error(valid[checked:])), len(valid)
    return injected, len(valid), worst


def test_no_fault_makes_a_wrong_angle_valid(board: Board, tmp_path: Path) -> None:
    injected, valid, worst = faults(board, tmp_path, 12.0, seed=1)
    assert injected > 8
    assert valid > 200
    assert worst <= WITHIN_PAUSES


@pytest.mark.proof
def test_ten_minutes_of_faults_and_no_wrong_valid_angle(board: Board, tmp_path: Path) -> None:
    injected, valid, worst = faults(board, tmp_path, 600.0, seed=2)
    print(f"{injected} faults, {valid} valid readings, worst error {worst} counts beyond the pace's")
    assert injected > 500
    assert valid > 20_000
    assert worst <= WITHIN_PAUSES
