"""What the readings of an encoder say about it: rate, losses, clock, angle, validity; as lines for people."""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from cathxr.core import Reading, Roll
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.devices.encoder_stream import EncoderLink, EncoderState

Level = Literal["plain", "good", "warn", "bad"]

_WINDOW_NS = 1_000_000_000
_SLOW = 0.9
_LOSSY = 0.01
_FASTEST_DRIFT = 0.01
"""A resonator is within half a percent; twice that is a broken board."""
_LATE_MS = 20.0
"""Longer than the FTDI driver's usual 16 ms: something holds the line up."""
_WRAP_MIN = 71.6


@dataclass(frozen=True)
class Line:
    """One thing about the encoder. level: "bad" makes the report fail."""

    label: str
    value: str
    level: Level = "plain"


class EncoderWatch:
    """Takes readings as they come; `lines` tells about them. roll: None where counts cannot become an angle."""

    def __init__(self, encoder: SerialEncoder, roll: Roll | None) -> None:
        self._encoder, self._roll = encoder, roll
        self._recent: deque[tuple[int, int]] = deque()  # (arrival, lateness over the least), ns
        self._first: Reading | None = None
        self._last: Reading | None = None

    def take(self, reading: Reading, now_ns: int) -> None:
        """Take a reading that came at `now_ns`."""
        self._first, self._last = self._first or reading, reading
        self._recent.append((now_ns, now_ns - reading.t_ns))
        while now_ns - self._recent[0][0] > _WINDOW_NS:
            self._recent.popleft()

    def lines(self) -> list[Line]:
        """Return what is known now."""
        state, link = self._encoder.state, self._encoder.link
        if state is None or link is None:
            return [Line("link", "closed", "bad")]
        if self._first is None or self._last is None:
            return [*_board(state, link), Line("reports", "none come", "bad")]
        return [
            *_board(state, link),
            *self._reports(self._first, self._last, link),
            *_clock(link, [late for _, late in self._recent]),
            *self._position(self._last, is_valid=state.valid),
            *self._validity(state),
        ]

    def _reports(self, first: Reading, last: Reading, link: EncoderLink) -> Iterator[Line]:
        span_ns = self._recent[-1][0] - self._recent[0][0]
        rate_hz = (len(self._recent) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0
        slow = len(self._recent) > 2 and rate_hz < _SLOW * link.rate_hz
        yield Line("reports", f"{rate_hz:.0f} of {link.rate_hz} a second", "bad" if slow else "good")
        lost, of = self._encoder.losses, last.seq - first.seq + 1
        share = (lost + link.damaged) / max(1, of)
        yield Line(
            "lost, damaged, doubted",
            f"{lost}, {link.damaged}, {link.doubted} (of {of})",
            "bad" if share > _LOSSY else "warn" if share > 0.0 else "good",
        )
        illegal = (last.illegal - first.illegal) % (1 << 16)
        total = f"{illegal} since this began, {last.illegal} since the board started"
        yield Line("impossible transitions", total, "bad" if illegal else "warn" if last.illegal else "good")
        if link.refusals:
            yield Line("commands refused", ", ".join(link.refusals), "bad")

    def _position(self, last: Reading, *, is_valid: bool) -> Iterator[Line]:
        yield Line("count", str(last.count))
        if self._roll is None:
            yield Line("roll", "give --rig: it says how counts become roll")
        else:
            degrees = f"{math.degrees(self._roll.angle_rad(last.count)):+.2f}°"
            yield Line("roll", degrees if is_valid else f"{degrees}, not valid", "good" if is_valid else "warn")

    def _validity(self, state: EncoderState) -> Iterator[Line]:
        if self._roll is None:
            yield Line("zero", "give --rig: the count belongs to a rig's zero")
        elif state.valid:
            yield Line("zero", "valid", "good")
        elif state.needs_jig:
            yield Line("zero", f"{state.sentence} `cathxr calibrate roll` does that.", "warn")
        elif state.miscounted:
            yield Line("zero", state.sentence, "bad")
        else:
            yield Line("zero", f"{state.sentence} The page of `cathxr run` asks for that.", "warn")


def _board(state: EncoderState, link: EncoderLink) -> Iterator[Line]:
    yield Line("firmware", state.firmware, "good")
    if link.board_us is not None:
        yield Line("uptime", f"{1e-6 * link.board_us:.1f} s (the board's clock goes around every {_WRAP_MIN} min)")
    kept = "kept" if state.kept else "lost"
    moved = ", turned meanwhile" if state.moved else ""
    yield Line("restarts", f"{state.restarts}, the last by: {state.cause}; count {kept}{moved}")
    if state.restarts_seen:
        yield Line("restarts while watched", str(state.restarts_seen), "bad")


def _clock(link: EncoderLink, lates_ns: list[int]) -> Iterator[Line]:
    drift = f"{1e6 * link.drift:+.0f} ppm against this computer"
    yield Line("board's clock", drift, "bad" if abs(link.drift) > _FASTEST_DRIFT else "good")
    if lates_ns:
        ordered = sorted(lates_ns)
        middle, most = (1e-6 * ordered[min(len(ordered) - 1, int(share * len(ordered)))] for share in (0.5, 0.95))
        text = f"{middle:.1f} ms in the middle, {most:.1f} ms for 95 % (beyond the least)"
        yield Line("reports are late by", text, "warn" if most > _LATE_MS else "good")
