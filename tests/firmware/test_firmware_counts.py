"""The real firmware on the simulated board: what it counts, what it says, how fast."""

from pathlib import Path

import numpy as np
import pytest

from cathxr.devices.encoder_protocol import (
    SKIPPED,
    Answer,
    Identity,
    Message,
    Refusal,
    Report,
    command_mark,
    command_zero,
    parse_line,
)

from .conftest import HZ, Board, Built, Dialogue, quadrature

BYTE_S = 1360 / HZ
"""A byte on the line: the nearest that 16 MHz come to 115200 baud."""


@pytest.fixture
def dialogue(board: Board):  # type: ignore[no-untyped-def]
    board.ask("automatic off")
    made = Dialogue(board)
    yield made
    made.close()


def reports(lines: list[bytes]) -> list[Report]:
    """Return the reports among lines of which every one must be whole."""
    messages = [parse_line(each) for each in lines]
    assert None not in messages
    return [each for each in messages if isinstance(each, Report)]


def last_count(dialogue: Dialogue) -> Report:
    return reports(dialogue.run(0.02))[-1]


def truth_at(report: Report, start: int, cycles: np.ndarray, steps: np.ndarray) -> tuple[int, int]:
    """Return the least and the greatest position around a report's latch.

    The board's time begins within 200 us after its reset; 4 us are its resolution, and an edge is counted within 15 us.
    """
    latch = report.us * 16
    position = np.concatenate([[0], np.cumsum(steps)])
    low, high = np.searchsorted(start + cycles.astype(np.int64), [latch - 500, latch + 3700])
    return int(position[low : high + 1].min()), int(position[low : high + 1].max())


@pytest.mark.parametrize(
    ("rate", "phase_error", "jitter"),
    [(14_000, 0.0, 0.0), (50_000, 0.0, 0.0), (50_000, 0.3, 0.1), (80_000, 0.0, 0.0)],
)
def test_every_edge_is_counted(dialogue: Dialogue, rate: float, phase_error: float, jitter: float) -> None:
    # 14 k edges/s is the design: 600 pulses x 4 x gear 2 x 3 turns a second.
    steps = np.concatenate([np.ones(20_000, np.int64), -np.ones(15_000, np.int64)])
    cycles, inputs = quadrature(steps, rate, phase_error=phase_error, jitter=jitter)
    dialogue.run(0.1)
    start = dialogue.board.play(cycles, inputs)
    found = reports(dialogue.run(len(steps) / rate + 0.05))
    assert found[-1].count == 5000
    assert found[-1].illegal == 0
    for each in found:
        low, high = truth_at(each, start, cycles, steps)
        assert low <= each.count <= high


def test_reversals_are_counted(dialogue: Dialogue) -> None:
    rng = np.random.default_rng(4)
    steps = np.repeat(rng.choice([-1, 1], 3000), rng.integers(1, 12, 3000))
    cycles, inputs = quadrature(steps, 50_000, phase_error=0.2, jitter=0.1, seed=5)
    dialogue.run(0.1)
    dialogue.board.play(cycles, inputs)
    found = reports(dialogue.run(len(steps) / 50_000 + 0.05))
    assert (found[-1].count, found[-1].illegal) == (steps.sum(), 0)


def test_bounce_is_counted_forth_and_back(dialogue: Dialogue) -> None:
    # An edge that chatters five times within 30 us: seen or not, what stays is one step.
    cycles, inputs = quadrature(np.ones(4000, np.int64), 8000)
    before = np.concatenate([[0], inputs[:-1]]).astype(np.uint64)
    rng = np.random.default_rng(6)
    chatter = np.sort(rng.integers(1, 480, (4000, 10)), axis=1).astype(np.uint64)
    states = np.where(np.arange(10) % 2 == 0, before[:, None], inputs[:, None])
    dialogue.run(0.1)
    dialogue.board.play(
        np.concatenate([cycles[:, None], cycles[:, None] + chatter], axis=1).ravel(),
        np.concatenate([inputs[:, None], states], axis=1).ravel().astype(np.uint64),
    )
    found = reports(dialogue.run(0.6))
    assert (found[-1].count, found[-1].illegal) == (4000, 0)


def test_too_fast_is_said_and_recovered(dialogue: Dialogue) -> None:
    # Beyond what the interrupts keep up with, two edges are seen as one impossible change: taken for two steps.
    cycles, inputs = quadrature(np.ones(20_000, np.int64), 130_000)
    dialogue.run(0.1)
    dialogue.board.play(cycles, inputs)
    found = reports(dialogue.run(0.3))[-1]
    assert found.count == 20_000
    assert found.illegal > 0


def test_it_says_who_it_is_and_obeys(dialogue: Dialogue) -> None:
    first = parse_line(dialogue.run(0.1)[0])
    assert isinstance(first, Identity)
    assert (first.cause, first.kept, first.mark, first.rate_hz) == ("power", False, 0, 200)

    def answers(line: bytes) -> list[Message | None]:
        return [each for each in map(parse_line, dialogue.say(line, 0.03)) if not isinstance(each, Report)]

    assert answers(b"rate 0\n") == [Answer("rate", ("0",))]
    assert dialogue.run(0.1) == []
    assert answers(b"id\r\n") == [Identity("1.0.0", 0, "power", False, 0, 0)]
    assert answers(b"zero 12345\n") == [Answer("zero", ("12345", "00000000"))]
    assert answers(command_zero(-77, 0xCAFE)) == [Answer("zero", ("-77", "0000CAFE"))]
    assert answers(command_mark(0xBEEF)) == [Answer("mark", ("0000BEEF",))]
    assert reports(dialogue.say(b"poll\n"))[0].count == -77
    assert answers(b"zero 5 12345678\n") == [Refusal("crc")]
    assert answers(b"what\nrate 9999\n") == [Refusal("unknown"), Refusal("range")]
    assert answers(b"x" * 200 + b"\n") == [Refusal("long")]
    assert answers(bytes(range(128, 256)) + b"\n") == [Refusal("long")]


@pytest.mark.parametrize(("rate", "widest", "lossless"), [(200, True, True), (250, True, True), (400, False, True)])
def test_reports_are_not_lost(board: Board, built: Built, rate: int, widest: bool, lossless: bool) -> None:
    board.ask("automatic off")
    dialogue = Dialogue(board)
    try:
        dialogue.run(0.1)
        if widest:
            dialogue.say(b"zero -2147483000\n")
            overflows = built.symbol("timer0_overflow_count")
            for byte, value in enumerate((4_194_304 - 4000).to_bytes(4, "little")):
                board.ask(f"poke {overflows + byte:x} {value:x}")
        dialogue.say(b"rate %d\n" % rate)
        found = reports(dialogue.run(2.0))
        gaps = np.diff([each.seq for each in found]) - 1
        assert len(found) == pytest.approx(2 * rate, rel=0.02)
        assert gaps.any() != lossless
        assert any(each.flags & SKIPPED for each in found[2:]) != lossless
    finally:
        dialogue.close()


def test_the_wrap_of_the_microseconds(board: Board, built: Built) -> None:
    board.ask("automatic off")
    dialogue = Dialogue(board)
    try:
        dialogue.run(0.05)
        overflows = built.symbol("timer0_overflow_count")
        for byte, value in enumerate((4_194_304 - 100).to_bytes(4, "little")):
            board.ask(f"poke {overflows + byte:x} {value:x}")
        dialogue.say(b"rate 200\n", 0.01)  # its next report was due in the time before the poke
        found = reports([each for each in dialogue.run(0.5) if each.startswith(b"R")])[1:]
        passed = np.diff([each.us for each in found]) % 2**32
        assert min(each.us for each in found) < 500_000 < 2**31 < max(each.us for each in found)
        # The timer wakes it well before, and it then waits for the instant itself: within 20 us or an interrupt.
        settled = passed[2:]
        assert np.abs(settled - 5000).max() < 60
    finally:
        dialogue.close()


def test_latch_to_last_byte(board: Board, tmp_path: Path) -> None:
    board.ask("automatic off")
    dialogue = Dialogue(board)
    try:
        dialogue.run(0.1)
        dialogue.say(b"zero 1000\n")
        board.ask(f"times {tmp_path / 'times.bin'}")
        found = reports(dialogue.run(1.0))
        ends = np.fromfile(tmp_path / "times.bin", "<u8").reshape(-1, 2)[:, 0].astype(float) / HZ
    finally:
        dialogue.close()
    count = min(len(found), len(ends))
    # The newline is handed over while the byte before it is on the line.
    latency = ends[:count] + 2 * BYTE_S - 1e-6 * np.array([each.us for each in found[:count]])
    length = np.array([len(b"R %d %d 1000 0 00*0000\n" % (each.seq, each.us)) for each in found[:count]])
    spent = latency - length * BYTE_S
    # To write a line takes less than a millisecond, most of it the division of the long numbers.
    assert spent.min() > 0.0
    assert spent.max() < 0.001


def test_it_fits_with_room_to_spare(built: Built) -> None:
    size = built.sections()
    assert size[".text"] + size[".data"] < 0.5 * 30_720
    # The stack has what is left of 2048 bytes; the deepest call needs about 150.
    assert size[".data"] + size[".bss"] + size[".noinit"] < 1400


def test_what_survives_is_clear_of_the_boot_loaders(built: Built) -> None:
    # The old one clears 0x102 to 0x20C at every start; Optiboot uses 0x100 to 0x1FF while it writes a sketch; both
    # have their stack at the end.
    kept = built.symbol("(anonymous namespace)::kept") + 0x100
    assert 0x300 <= kept < 0x700
