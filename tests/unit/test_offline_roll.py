"""The play of the gears in recorded counts: found by every reading, whatever pictures there are."""

import numpy as np
import pytest

from cathxr.app.offline_roll import RecordedCounts
from cathxr.core import Roll
from cathxr.storage.tables import RollCounts

ROLL = Roll(2400, 2.0, backlash_deg=0.45)  # six counts
SECOND = 1_000_000_000


def recorded(counts: list[float], roll: Roll | None = ROLL) -> RecordedCounts:
    """Return a recording with a reading each second."""
    return RecordedCounts(RollCounts(np.arange(len(counts), dtype=np.int64) * SECOND, np.array(counts, float)), roll)


def test_a_turn_back_between_two_pictures_is_seen() -> None:
    counts = recorded([0, 20, 40, 60, 50, 40, 30])
    assert counts.at(2 * SECOND) == pytest.approx(43.0)
    assert counts.at(6 * SECOND) == pytest.approx(27.0)  # only the readings in between show that it was going back
    assert counts.at(0) == 0.0


def test_between_readings_the_side_glides_and_a_prediction_keeps_it() -> None:
    counts = recorded([0, 20, 40, 30])
    assert counts.at(2 * SECOND + SECOND // 2) == pytest.approx(35.0)  # from +3 to -3
    assert counts.at(3 * SECOND + SECOND // 2) == pytest.approx(25.0 - 3.0)
    assert counts.at(4 * SECOND) == pytest.approx(20.0 - 3.0)


def test_readings_of_one_instant_all_show_the_way() -> None:
    t_ns = np.array([0, 1, 1, 2], dtype=np.int64) * SECOND
    counts = RecordedCounts(RollCounts(t_ns, np.array([0.0, 30.0, 20.0, 20.0])), ROLL)
    assert counts.at(SECOND) == pytest.approx(17.0)


def test_without_play_the_counts_are_as_recorded() -> None:
    for roll in (None, Roll(2400, 2.0), Roll(2400, backlash_deg=0.0)):
        assert recorded([0, 20, 40, 30], roll).at(2 * SECOND) == 40.0
