"""The fake board does what the firmware does: the same vectors, the same restarts."""

from pathlib import Path

import pytest

from cathxr.devices.encoder_fake import FakeBoard
from cathxr.devices.encoder_protocol import (
    POLLED,
    SKIPPED,
    Answer,
    Identity,
    LineReader,
    Message,
    Refusal,
    Report,
    guarded,
)

COMMANDS = [
    line.split(",")[1:]
    for line in (Path(__file__).resolve().parents[2] / "firmware" / "vectors.csv").read_text("ascii").splitlines()
    if line.startswith("command,")
]
SECOND = 1_000_000_000


def said(board: FakeBoard, until_ns: int) -> list[Message]:
    reader = LineReader()
    found = reader.feed(b"\n" + board.transmit(until_ns))
    assert reader.damaged == 0
    return found


@pytest.mark.parametrize(("line", "answer"), COMMANDS, ids=[each[0] for each in COMMANDS])
def test_it_answers_as_the_firmware_does(line: str, answer: str) -> None:
    board = FakeBoard(lambda t_ns: 7, start_ns=0)
    board.receive(b"rate 0\n", 0)
    said(board, SECOND)
    board.receive(line.encode() + b"\r\n", SECOND)
    found = said(board, 2 * SECOND)
    if answer == "poll":
        (report,) = found
        assert isinstance(report, Report)
        assert report.flags & POLLED
    elif answer == "id":
        assert isinstance(found[0], Identity)
    else:
        words = answer.split()
        expected = Answer(words[1], tuple(words[2:])) if words[0] == "A" else Refusal(words[1])
        assert expected in found


def test_it_counts_from_where_it_got_power() -> None:
    board = FakeBoard(lambda t_ns: 1000 + t_ns // 10_000_000, start_ns=SECOND)
    first = next(each for each in said(board, 3 * SECOND) if isinstance(each, Report))
    assert first.count == 0
    board.receive(guarded("zero -5 0000CAFE"), 3 * SECOND)
    board.restart(4 * SECOND, "external", waits_s=1.0)
    identity, *reports = said(board, 6 * SECOND)
    assert isinstance(identity, Identity)
    assert (identity.kept, identity.mark, identity.restarts) == (True, 0xCAFE, 1)
    assert isinstance(reports[0], Report)
    assert reports[0].count == -5 + 100  # what was turned during the second of the boot loader is missing
    board.restart(7 * SECOND, "power")
    identity, *reports = said(board, 8 * SECOND)
    assert isinstance(identity, Identity)
    assert (identity.kept, identity.mark, identity.restarts) == (False, 0, 0)
    assert isinstance(reports[0], Report)
    assert reports[0].count == 0


def test_a_full_line_leaves_reports_out() -> None:
    board = FakeBoard(lambda t_ns: -2_000_000_000 - t_ns, start_ns=0, start_us=4_000_000_000)
    board.receive(guarded("zero -2000000000 00000001") + guarded("rate 400"), 0)
    reports = [each for each in said(board, SECOND) if isinstance(each, Report)]
    # 38 bytes and more at 86.8 us each: 300 a second at the most.
    assert len(reports) < 310
    assert any(each.flags & SKIPPED for each in reports)
    assert reports[-1].seq > 390


def test_counts_go_around() -> None:
    board = FakeBoard(lambda t_ns: t_ns // SECOND, start_ns=0)
    board.receive(guarded("zero 2147483647"), 0)
    reports = [each for each in said(board, 3 * SECOND // 2) if isinstance(each, Report)]
    assert reports[-1].count == -(2**31)
