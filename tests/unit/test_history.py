"""The roll at a picture's instant: between readings, just after the last, and nowhere else."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cathxr.core import Reading
from cathxr.runtime.history import History, Sample

PERIOD_NS = 5_000_000


def history(count: int = 20, *, per_sample: int = 8) -> History:
    one = History()
    for seq in range(count):
        one.add(Reading(seq, 10**9 + seq * PERIOD_NS, per_sample * seq))
    return one


def at(periods: float) -> int:
    return 10**9 + round(periods * PERIOD_NS)


@pytest.mark.parametrize(("periods", "count"), [(0.0, 0.0), (3.0, 24.0), (3.5, 28.0), (18.25, 146.0), (19.0, 152.0)])
def test_between_readings_the_count_is_interpolated(periods: float, count: float) -> None:
    assert history().at(at(periods)) == Sample(count, False)


def test_after_the_last_reading_it_is_predicted_for_one_period_and_flagged() -> None:
    assert history().at(at(19.5)) == Sample(156.0, True)
    assert history().at(at(20.0)) == Sample(160.0, True)
    assert history().at(at(20.0) + 1) is None


def test_before_the_first_reading_and_without_any_nothing_is_known() -> None:
    assert history().at(at(-0.01)) is None
    assert History().at(at(0)) is None


def test_one_reading_is_known_at_its_own_instant_only() -> None:
    one = history(1)
    assert one.at(at(0)) == Sample(0.0, False)
    assert one.at(at(0) + 1) is None


def test_a_gap_is_not_bridged() -> None:
    one = history()
    one.add(Reading(40, at(40), 320))  # twenty readings lost
    assert one.at(at(30)) is None
    assert one.at(at(40)) == Sample(320.0, False)
    assert one.at(at(40.5)) is None  # nothing to tell the speed from: the reading before is too old
    one.add(Reading(41, at(41), 328))
    assert one.at(at(41.5)) == Sample(332.0, True)


def test_a_short_gap_is_bridged() -> None:
    one = history()
    one.add(Reading(23, at(23), 184))
    assert one.at(at(21)) == Sample(168.0, False)


@pytest.mark.parametrize("again", [Reading(0, at(30), 7), Reading(25, at(5), 7)])
def test_a_board_that_begins_anew_is_not_mixed_with_its_past(again: Reading) -> None:
    one = history()
    one.add(again)
    assert one.at(again.t_ns) == Sample(7.0, False)
    assert one.at(at(10)) is None


def test_what_is_cleared_is_gone() -> None:
    one = history()
    one.clear()
    assert one.at(at(10)) is None


def test_two_seconds_are_kept() -> None:
    one = history(1000)
    assert one.at(at(999 - 401)) is None
    assert one.at(at(999 - 399)) is not None


@given(st.lists(st.integers(-20, 20), min_size=3, max_size=80), st.floats(0.0, 1.0))
def test_the_count_lies_between_its_neighbours(steps: list[int], share: float) -> None:
    one, count, readings = History(), 0, []
    for seq, step in enumerate(steps):
        count += step
        readings.append(Reading(seq, at(seq), count))
        one.add(readings[-1])
    t_ns = at(share * (len(steps) - 1))
    sample = one.at(t_ns)
    assert sample is not None
    before = max((each for each in readings if each.t_ns <= t_ns), key=lambda each: each.t_ns)
    after = min((each for each in readings if each.t_ns >= t_ns), key=lambda each: each.t_ns)
    assert min(before.count, after.count) <= sample.count <= max(before.count, after.count)
    assert not sample.predicted


@pytest.mark.parametrize("flags", [0x10, 0x1000])
def test_nothing_is_interpolated_or_predicted_across_a_restart_or_a_new_zero(flags: int) -> None:
    one = history()
    one.add(Reading(20, at(20), 5000, flags=flags))
    assert one.at(at(19)) == Sample(152.0, False)
    assert one.at(at(19.5)) is None
    assert one.at(at(20)) == Sample(5000.0, False, flags)
    assert one.at(at(20.5)) is None
    one.add(Reading(21, at(21), 5008, flags=flags))
    assert one.at(at(20.5)) == Sample(5004.0, False, flags)
    assert one.at(at(21.5)) == Sample(5012.0, True, flags)


def test_a_sample_has_the_flags_of_both_its_readings() -> None:
    one = history()
    one.add(Reading(20, at(20), 160, flags=0x100))
    one.add(Reading(21, at(21), 168, flags=0x200))
    assert one.at(at(19.5)) == Sample(156.0, False, 0x100)
    assert one.at(at(20.5)) == Sample(164.0, False, 0x300)
    assert one.at(at(21.5)) == Sample(172.0, True, 0x300)
    assert one.newest == Reading(21, at(21), 168, flags=0x200)


class Adds:
    """A corrector that adds to every count a tenth of what it has seen since its last reset."""

    def __init__(self) -> None:
        self.seen, self.resets = 0, 0

    def corrected(self, count: float) -> float:
        self.seen += 1
        return count + 0.1 * self.seen

    def reset(self) -> None:
        self.seen, self.resets = 0, self.resets + 1


def test_the_corrector_gets_every_reading_once_and_is_reset_where_the_count_does_not_go_on() -> None:
    adds = Adds()
    one = History(adds)
    for seq in range(4):
        one.add(Reading(seq, at(seq), 8 * seq))
    assert one.at(at(1)) == Sample(pytest.approx(8.2), False)
    assert one.at(at(1.5)) == Sample(pytest.approx(12.25), False)
    assert one.at(at(3.5)) == Sample(pytest.approx(28.4), True)  # the count is carried on, the correction is held
    assert (adds.seen, adds.resets) == (4, 0)
    one.add(Reading(4, at(4), 0, flags=0x1000))
    assert (adds.seen, adds.resets) == (1, 1)
    one.clear()
    assert adds.resets == 2
