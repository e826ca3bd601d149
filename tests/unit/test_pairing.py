"""Pairing of two cameras' pictures: the stated rules, one by one."""

from dataclasses import dataclass

import pytest

from cathxr.runtime.pairing import MAX_WAIT_NS, SILENCE_NS, Pair, Pairer

PERIOD_NS = 20_000_000
TOP, FRONT = 0, 1


@dataclass(frozen=True)
class Stamp:
    seq: int
    t_ns: int


def at(number: float) -> int:
    """Return the instant that many periods after the start."""
    return 10**9 + round(number * PERIOD_NS)


def stamp(number: float) -> Stamp:
    return Stamp(int(number), at(number))


def pairer() -> Pairer[Stamp]:
    return Pairer(PERIOD_NS, PERIOD_NS)


def numbers(pairs: list[Pair[Stamp]]) -> list[tuple[float | None, float | None]]:
    return [
        tuple(None if each is None else round((each.t_ns - 10**9) / PERIOD_NS, 6) for each in (p.first, p.second))
        for p in pairs
    ]  # type: ignore[misc]


def test_a_pair_goes_out_at_once_when_nothing_nearer_can_come() -> None:
    one = pairer()
    assert one.offer(TOP, stamp(0), at(0.5)) == []
    pairs = one.offer(FRONT, stamp(0.3), at(0.6))
    assert numbers(pairs) == [(0, 0.3)]
    assert pairs[0].skew_ns == round(0.3 * PERIOD_NS)
    assert pairs[0].t_ns == at(0)  # the top picture's instant


def test_it_waits_while_a_nearer_picture_can_come_and_takes_it() -> None:
    one = pairer()
    one.offer(TOP, stamp(0), at(0.1))
    assert one.offer(FRONT, stamp(0.56), at(0.66)) == []  # top 1.0 would be nearer: 0.44
    assert numbers(one.offer(TOP, stamp(1), at(1.1))) == [(1, 0.56)]
    assert one.unpaired == (1, 0)


def test_it_stops_waiting_when_the_nearer_picture_is_overdue() -> None:
    one = pairer()
    one.offer(TOP, stamp(0), at(0.1))
    one.offer(FRONT, stamp(0.55), at(0.65))
    poll_ns = one.next_poll_ns()
    assert poll_ns is not None
    assert poll_ns <= at(0.55 + 0.55 + 0.1 + 0.5) + 1  # the last useful instant, the usual delay, half a period
    assert one.poll(poll_ns - 2) == []
    assert numbers(one.poll(poll_ns)) == [(0, 0.55)]


def test_the_established_side_is_kept_without_waiting() -> None:
    one = pairer()
    one.offer(TOP, stamp(0), at(0.1))
    assert numbers(one.offer(FRONT, stamp(0.35), at(0.45))) == [(0, 0.35)]
    one.offer(TOP, stamp(1), at(1.1))
    assert numbers(one.offer(FRONT, stamp(1.55), at(1.65))) == [(1, 1.55)]


def test_pictures_too_far_apart_do_not_pair() -> None:
    one = pairer()
    one.offer(TOP, stamp(0), at(0.1))
    assert one.offer(FRONT, stamp(0.61), at(0.7)) == []
    assert one.unpaired == (1, 0)
    assert numbers(one.offer(TOP, stamp(1), at(1.1))) == [(1, 0.61)]


def test_a_dropped_picture_costs_its_own_pair_only() -> None:
    one = pairer()
    found = []
    for number in range(6):
        if number != 3:
            found += one.offer(TOP, stamp(number), at(number + 0.2))
        found += one.offer(FRONT, stamp(number + 0.1), at(number + 0.3))
    assert numbers(found) == [(n, n + 0.1) for n in (0, 1, 2, 4, 5)]
    assert one.unpaired == (0, 1)


def test_a_silent_camera_delays_once_and_is_then_named_at_once() -> None:
    one = pairer()
    found = one.offer(FRONT, stamp(0), at(0)) + one.offer(TOP, stamp(0.1), at(0.1))
    assert len(found) == 1
    number = 1
    while not (alone := one.offer(TOP, stamp(number), at(number))):
        number += 1
    # The front camera spoke last at 0: that is 12.5 periods of 20 ms.
    assert number == -(-MAX_WAIT_NS // PERIOD_NS)
    assert numbers(alone) == [(number, None)]
    assert numbers(one.offer(TOP, stamp(number + 1), at(number + 1))) == [(number + 1, None)]
    # When it returns, its next picture pairs again.
    assert one.offer(FRONT, stamp(number + 1.9), at(number + 1.95)) == []
    assert numbers(one.offer(TOP, stamp(number + 2), at(number + 2))) == [(number + 2, number + 1.9)]


def test_a_camera_that_always_comes_too_late_blocks_no_longer_than_stated() -> None:
    one = pairer()
    late_periods = 20  # 400 ms, more than the 250 ms that a picture waits
    found: list[tuple[int, Pair[Stamp]]] = []
    for number in range(60):
        now = at(number)
        found += [(now, pair) for pair in one.offer(TOP, stamp(number), now)]
        if number >= late_periods:
            found += [(now, pair) for pair in one.offer(FRONT, stamp(number - late_periods), now)]
    alone = [(now, pair) for now, pair in found if pair.first is not None and pair.second is None]
    assert len(alone) > 30
    assert all(now - pair.t_ns <= MAX_WAIT_NS + PERIOD_NS for now, pair in alone)


def test_silence_of_both_is_said_every_half_second() -> None:
    one = pairer()
    assert one.poll(at(0)) == []
    assert one.poll(at(0) + SILENCE_NS - 1) == []
    assert numbers(one.poll(at(0) + SILENCE_NS)) == [(None, None)]
    assert one.poll(at(0) + SILENCE_NS + 1) == []
    assert numbers(one.poll(at(0) + 2 * SILENCE_NS)) == [(None, None)]


def test_the_measured_period_replaces_a_wrong_nominal_one() -> None:
    # The rig says 120 Hz, the cameras give 30: a skew of 12 ms is 1.4 nominal periods and 0.36 true ones.
    one: Pairer[Stamp] = Pairer(8_333_333, 8_333_333)
    found = []
    for seq in range(40):
        t_ns = 10**9 + seq * 33_333_333
        found += one.offer(TOP, Stamp(seq, t_ns), t_ns)
        found += one.offer(FRONT, Stamp(seq, t_ns + 12_000_000), t_ns + 12_000_000)
    assert [pair.first.seq for pair in found if pair.first and pair.second] == list(range(15, 40))


def test_lost_pictures_do_not_lengthen_the_measured_period() -> None:
    one: Pairer[Stamp] = Pairer(33_333_333, 33_333_333)
    for seq in range(0, 120, 3):  # only every third picture is fetched
        t_ns = 10**9 + seq * 33_333_333
        one.offer(TOP, Stamp(seq, t_ns), t_ns)
        one.offer(FRONT, Stamp(seq + 1, t_ns + 33_333_333), t_ns + 33_333_333)
    assert one.period_ns == 33_333_333
    assert one.unpaired[0] >= 38


@pytest.mark.parametrize("t_ns", [at(0), at(-1), at(100)])
def test_a_stamp_that_goes_back_or_lies_in_the_future_is_counted_and_left_out(t_ns: int) -> None:
    one = pairer()
    one.offer(TOP, stamp(0), at(0.1))
    assert one.offer(TOP, Stamp(1, t_ns), at(1)) == []
    assert one.unpaired == (1, 0)
    assert numbers(one.offer(FRONT, stamp(0.1), at(1.1))) == [(0, 0.1)]


def test_wrong_periods_are_refused() -> None:
    with pytest.raises(ValueError, match="expected positive ones"):
        Pairer(0, PERIOD_NS)
