"""The encoder's protocol against the firmware's vectors, and against everything that is not it."""

import binascii
import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cathxr.devices.encoder_protocol import (
    CAUSES,
    LONGEST_LINE,
    Identity,
    LineReader,
    Report,
    Stranger,
    crc16,
    guarded,
    identity_line,
    mark_of,
    parse_line,
    report_line,
)
from cathxr.storage.rig_file import example_rig

VECTORS = [
    line.split(",")
    for line in (Path(__file__).resolve().parents[2] / "firmware" / "vectors.csv").read_text("ascii").splitlines()
    if line and not line.startswith("#")
]


def vectors(kind: str) -> list[list[str]]:
    found = [fields[1:] for fields in VECTORS if fields[0] == kind]
    assert found, f"no vectors of the kind {kind}"
    return found


reports = st.builds(
    Report,
    seq=st.integers(0, 0xFFFF),
    us=st.integers(0, 0xFFFFFFFF),
    count=st.integers(-(2**31), 2**31 - 1),
    illegal=st.integers(0, 0xFFFF),
    flags=st.integers(0, 0xFF),
)
identities = st.builds(
    Identity,
    firmware=st.from_regex(r"[0-9]{1,2}\.[0-9]{1,2}\.[0-9]{1,2}", fullmatch=True),
    restarts=st.integers(0, 0xFFFF),
    cause=st.sampled_from(CAUSES),
    kept=st.booleans(),
    mark=st.integers(0, 0xFFFFFFFF),
    rate_hz=st.integers(0, 400),
)


@pytest.mark.parametrize("fields", vectors("crc"), ids=lambda each: each[0])
def test_crc(fields: list[str]) -> None:
    assert crc16(fields[0].encode()) == int(fields[1], 16)


@pytest.mark.parametrize("fields", vectors("report"), ids=lambda each: each[-1])
def test_reports(fields: list[str]) -> None:
    report = Report(*map(int, fields[:4]), int(fields[4], 16))
    assert parse_line(fields[5].encode()) == report
    assert report_line(report) == fields[5].encode() + b"\n"


@pytest.mark.parametrize("fields", vectors("identity"), ids=lambda each: each[-1])
def test_identities(fields: list[str]) -> None:
    restarts, cause, kept, mark, rate, line = fields
    identity = Identity("1.0.0", int(restarts), cause, kept == "kept", int(mark, 16), int(rate))
    assert parse_line(line.encode()) == identity
    assert identity_line(identity) == line.encode() + b"\n"


@pytest.mark.parametrize("fields", vectors("stranger"), ids=lambda each: each[-1])
def test_strangers(fields: list[str]) -> None:
    assert parse_line(fields[2].encode()) == Stranger(fields[0], int(fields[1]))


@pytest.mark.parametrize("fields", vectors("damaged"), ids=lambda each: repr(each[-1]))
def test_damaged_lines(fields: list[str]) -> None:
    assert parse_line(fields[0].encode()) is None


@given(reports, identities)
def test_what_is_written_is_read(report: Report, identity: Identity) -> None:
    for line, what in ((report_line(report), report), (identity_line(identity), identity)):
        assert len(line) <= LONGEST_LINE
        assert line.isascii()
        assert parse_line(line[:-1]) == what


@given(st.binary(max_size=200))
def test_random_bytes_give_nothing(data: bytes) -> None:
    assert LineReader().feed(data + b"\n") == []


@given(st.text("R IAE-*0123456789ABCDEF\n", max_size=300))
def test_random_characters_of_the_protocol_give_nothing(text: str) -> None:
    # A CRC fits by chance once in 65536 lines that have the form of one; hypothesis makes few that do. What is found
    # nevertheless must be right by its CRC.
    for line in text.encode().split(b"\n"):
        if parse_line(line) is not None:
            body, _, crc = line.partition(b"*")
            assert int(crc, 16) == binascii.crc_hqx(body, 0xFFFF)


@given(reports, st.data())
def test_a_burst_of_damage_is_always_noticed(report: Report, data: st.DataObject) -> None:
    # A CRC of 16 bits finds every burst of up to 16 bits inside the body, and the form of the rest is fixed.
    line = report_line(report)[:-1]
    start = data.draw(st.integers(0, len(line) - 3))
    burst = data.draw(st.integers(1, 0xFFFF)) << 8 * (len(line) - 2 - start)
    damaged = (int.from_bytes(line) ^ burst).to_bytes(len(line))
    assume(b"\n" not in damaged)
    if start < line.index(b"*") - 1:
        assert parse_line(damaged) is None
    else:
        assert parse_line(damaged) in (None, report)


@given(reports, st.data())
def test_a_byte_too_many_or_too_few_is_always_noticed(report: Report, data: st.DataObject) -> None:
    line = report_line(report)[:-1]
    at = data.draw(st.integers(0, len(line) - 1))
    assert parse_line(line[:at] + line[at + 1 :]) in (None, report)
    longer = line[:at] + data.draw(st.binary(min_size=1, max_size=1)) + line[at:]
    assert parse_line(longer) in (None, report)


@given(st.lists(reports, min_size=1, max_size=8), st.data())
def test_lines_come_through_in_any_pieces(some: list[Report], data: st.DataObject) -> None:
    stream, reader, found = b"".join(map(report_line, some)), LineReader(), []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        found += reader.feed(stream[:size])
        stream = stream[size:]
    assert found == some
    assert reader.damaged == 0


@given(st.lists(reports, min_size=1, max_size=4), st.binary(max_size=150))
def test_it_finds_its_feet_after_garbage(some: list[Report], garbage: bytes) -> None:
    reader = LineReader()
    reader.feed(garbage)
    found = reader.feed(b"\n" + b"".join(map(report_line, some)))
    assert found[-len(some) :] == some


def test_the_rest_of_a_line_at_the_beginning_is_no_damage() -> None:
    line = report_line(Report(1, 2, 3, 4, 5))
    reader = LineReader()
    assert reader.feed(line[7:] + line) == [Report(1, 2, 3, 4, 5)]
    assert reader.damaged == 0
    assert reader.feed(line[7:]) == []
    assert reader.damaged == 1


def test_an_endless_line_takes_no_memory() -> None:
    reader = LineReader()
    for _ in range(100):
        assert reader.feed(b"R 1 2 3" * 20) == []
    assert len(reader._pending) <= LONGEST_LINE
    assert reader.feed(b"\n" + guarded("E unknown"))


def test_the_examples_of_the_contract_are_right() -> None:
    text = (Path(__file__).resolve().parents[2] / "firmware" / "roll_encoder" / "protocol.md").read_text("utf-8")
    lines = re.findall(r"(?:[RIA]|zero) [^*\n>]*\*[0-9A-F]{4}", text)
    assert len(lines) >= 7
    for line in lines:
        line = line.rsplit("          ", 1)[-1]
        assert line[-4:] == f"{crc16(line[:-5].encode()):04X}", line
        assert line.startswith("zero") or parse_line(line.encode()) is not None


def test_the_mark_follows_everything_that_turns_counts_into_roll() -> None:
    roll = example_rig().roll
    assert roll is not None
    marks = {
        mark_of(each)
        for each in (
            roll,
            replace(roll, zero_count=1),
            replace(roll, counts_per_turn=2048),
            replace(roll, gear_ratio=1.5),
            replace(roll, direction=-1),
            replace(roll, zero_direction=[0.0, 1.0, 0.0]),
        )
    }
    assert len(marks) == 6
    assert 0 not in marks
    assert mark_of(roll) == mark_of(replace(roll, backlash_deg=0.4))
