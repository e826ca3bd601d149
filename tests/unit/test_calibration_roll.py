"""Roll from the jig: the play from rocking with an honest error, one turn that names wrong gears, what is refused."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from cathxr.calibration.roll import check_turn, counts_per_degree, jig_calibration
from cathxr.calibration.roll_rocking import Rocking
from cathxr.calibration.roll_sentences import clock_angle_rad, side_of
from cathxr.core import CalibrationError, FloatArray, Provenance, Roll

ROLL = Roll(2400.0, 2.0)
PER_DEGREE = counts_per_degree(ROLL)
DATE = "2026-02-03"


def rocked(
    low: float, high: float, rng: np.random.Generator, *, strokes: int = 10, jitter: float = 0.0, creep: float = 0.0
) -> list[int]:
    """Return the counts of strokes between two stops (counts, not whole ones), each met within `jitter`."""
    path: list[int] = []
    at = 0.5 * (low + high)
    for stroke in range(strokes):
        to = (high if stroke % 2 else low) + creep * stroke + float(rng.normal(0.0, jitter))
        path += np.floor(np.linspace(at, to, 30)).astype(int).tolist()
        at = to
    return path


def rocking_of(counts: list[int]) -> Rocking:
    rocking = Rocking()
    for each in counts:
        rocking.add(each)
    return rocking


@pytest.mark.parametrize("jitter", [0.0, 0.25, 0.5])
def test_the_plays_error_is_the_one_stated(jitter: float) -> None:
    rng = np.random.default_rng([4, round(100 * jitter)])
    off: list[float] = []
    off_middle: list[float] = []
    for _ in range(400):
        width = float(rng.uniform(4.0, 12.0))
        low = float(rng.uniform(-20.0, 20.0))
        play = rocking_of(rocked(low, low + width, rng, strokes=16, jitter=jitter)).play(counts_per_degree=PER_DEGREE)
        off.append((play.counts - width) / play.counts_std)
        # A floor lies half a count below; the zero and every later reading share that.
        off_middle.append((play.middle + 0.5 - low - 0.5 * width) / play.middle_std)
    for each in (np.array(off), np.array(off_middle)):
        # 400 draws give the rms to 4 % (one sigma). Exact stops give 1; of stops that vary by a fraction of a count the
        # rounding averages out a little sooner than is believed, which makes the stated error up to a third too large.
        assert 0.6 < float(np.sqrt((each**2).mean())) < 1.15
        assert abs(float(each.mean())) < 0.3  # outliers are sought after the extremes were taken
        assert float(np.abs(each).max()) < 5.0


def test_strokes_that_turn_back_half_way_are_no_stops() -> None:
    rng = np.random.default_rng(5)
    counts = [*rocked(-4.0, 4.0, rng), -4, -1, -3, 0, -4, *rocked(-4.0, 4.0, rng)]
    play = rocking_of(counts).play(counts_per_degree=PER_DEGREE)
    # Each stop of whole counts is exact here; a half-way turn taken for one would draw the mean in.
    assert play.counts == pytest.approx(8.0, abs=0.01)


def test_a_trembling_finger_and_a_rest_add_no_stops() -> None:
    rocking = Rocking()
    for _ in range(6):
        for at in [*range(-4, 5), *[4, 3] * 20, *range(4, -5, -1), *[-4, -3] * 20, *[-4] * 500]:
            rocking.add(at)
    progress = rocking.progress()
    assert (progress.low, progress.high) == (-4, 4)
    assert progress.stops in (5, 6)


def bad_rockings() -> Iterator[tuple[list[int], str]]:
    rng = np.random.default_rng(6)
    yield [7] * 100, "did not move"
    yield [], "did not move"
    yield rocked(-4.0, 4.0, rng, strokes=4), "Rock on"
    yield list(range(-15, 16)), "Rock on: the gear has come to no stops"
    yield rocked(-100.0, 100.0, rng), "which is no play: lock the catheter's gear"
    yield rocked(-3.0, 3.0, rng, strokes=14, creep=1.0), "not the same each time"
    yield rocked(-6.0, 6.0, rng, strokes=14, jitter=5.0), "not the same|Rock on"


@pytest.mark.parametrize(("counts", "sentence"), list(bad_rockings()))
def test_what_is_no_rocking_is_refused(counts: list[int], sentence: str) -> None:
    with pytest.raises(CalibrationError, match=sentence):
        rocking_of(counts).play(counts_per_degree=PER_DEGREE)


def test_a_turn_that_fits_says_so() -> None:
    check = check_turn(ROLL, 4797.0)
    assert check.is_as_stated
    assert check.sentence == "4797 counts for one turn, as the rig says."
    assert check.closure_deg == pytest.approx(-3.0 / PER_DEGREE)
    assert (check.gear_ratio, check.counts_per_turn, check.direction) == (2.0, 2400.0, 1)


@pytest.mark.parametrize(
    ("rig", "counts", "gear", "per_turn", "direction", "sentence"),
    [
        (Roll(2400.0, 1.0), 4800.0, 2.0, 2400.0, 1, "4800 counts for one turn: gear_ratio 2.0 fits, the rig says 1.0."),
        (ROLL, -4800.0, 2.0, 2400.0, -1, "4800 counts for one turn: direction -1 fits, the rig says 1."),
        (ROLL, 3600.0, 1.5, 2400.0, 1, "3600 counts for one turn: gear_ratio 1.5 fits, the rig says 2.0."),
        (ROLL, 3190.0, 4.0 / 3.0, 2400.0, 1, "gear_ratio 1.333 fits"),
        (Roll(600.0, 2.0), 4801.0, 2.0, 2400.0, 1, "counts_per_turn 2400 fits, the rig says 600"),
        (Roll(2400.0, 2.0, -1), 2400.0, 1.0, 2400.0, 1, "gear_ratio 1.0 fits, the rig says 2.0; direction 1 fits"),
    ],
)
def test_wrong_gears_are_named(
    rig: Roll, counts: float, gear: float, per_turn: float, direction: int, sentence: str
) -> None:
    check = check_turn(rig, counts)
    assert (check.gear_ratio, check.counts_per_turn, check.direction) == (gear, per_turn, direction)
    assert not check.is_as_stated
    assert sentence in check.sentence


@pytest.mark.parametrize(("counts", "sentence"), [(40.0, "That was no turn"), (5100.0, "fit no simple pair")])
def test_what_is_no_turn_is_refused(counts: float, sentence: str) -> None:
    with pytest.raises(CalibrationError, match=sentence):
        check_turn(ROLL, counts)


def test_the_roll_has_errors_date_and_method_and_keeps_what_was_not_measured() -> None:
    rng = np.random.default_rng(7)
    before = replace(
        ROLL,
        torsion_deg_per_mm=0.02,
        provenance=Provenance(std={"torsion_deg_per_mm": np.array(0.004)}, date="2020-01-01"),
    )
    play = rocking_of(rocked(10.3, 15.0, rng)).play(counts_per_degree=PER_DEGREE)
    turn = check_turn(before, 4800.0 - 0.5 * play.counts, play=play)
    assert turn.closure_deg == pytest.approx(0.0, abs=1e-9)
    result = jig_calibration(before, rested=11, play=play, turn=turn, date=DATE, jig_std_deg=0.2)
    found = result.roll
    std: dict[str, FloatArray] = dict(found.provenance.std)
    assert found.backlash_deg == pytest.approx(play.counts / PER_DEGREE)
    assert float(std["backlash_deg"]) == pytest.approx(play.counts_std / PER_DEGREE)
    assert float(std["torsion_deg_per_mm"]) == 0.004
    assert 0.2 < float(std["zero_count"]) / PER_DEGREE < 0.25
    assert (found.provenance.date, found.provenance.n) == (DATE, play.stops)
    assert "jig" in str(found.provenance.method)
    assert (found.zero_count, found.torsion_deg_per_mm) == (before.zero_count, 0.02)


def test_the_board_gets_the_middle_of_the_play_at_the_nearest_turn() -> None:
    rng = np.random.default_rng(8)
    play = rocking_of(rocked(-3.0, 3.0, rng)).play(counts_per_degree=PER_DEGREE)
    rig = replace(ROLL, zero_count=100.0)
    result = jig_calibration(rig, rested=3, play=play, turn=None, date=DATE)
    assert result.board_count(0) == 100
    assert result.board_count(3) == 103
    assert result.board_count(4797) == 97
    assert result.board_count(-4801) == 99


def test_without_rocking_the_zero_is_as_uncertain_as_the_play() -> None:
    rig = replace(ROLL, backlash_deg=1.0)
    result = jig_calibration(rig, rested=12, play=None, turn=None, date=DATE, jig_std_deg=0.0)
    assert result.zero == 12.0
    # uniform within the play, and one rounding of the count each for reading and for setting it
    assert result.zero_std == pytest.approx((PER_DEGREE**2 / 12.0 + 2.0 / 12.0) ** 0.5)
    assert result.roll.backlash_deg == 1.0


def test_where_mark_t_points() -> None:
    right, up = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    assert (side_of(right), side_of(-right), side_of(up)) == ("to the right side", "to the left side", "straight up")
    assert clock_angle_rad(right) == 0.0
    assert clock_angle_rad(up) == pytest.approx(-np.pi / 2)
    # Positive roll, right-handed about +x, is clockwise as seen along +x: a quarter turn on from the right is down.
    assert clock_angle_rad(np.cross([1.0, 0.0, 0.0], right)) == pytest.approx(np.pi / 2)
