"""The score card's comparisons, and how practice went."""

from cathxr.core.trials import Outcome, TargetResult, TrialRecord
from cathxr.training import familiarisation, score_card
from cathxr.training.state import Offer, TrialResult


def record(
    who: str, day: int, t: float | None, *, condition: str = "3d", invalid: str = "", sparc: float = -2.0
) -> TrialRecord:
    return TrialRecord(
        id=f"{who}-{day}-{condition}", participant=who, task="six_targets", condition=condition, number=1, period=1,
        began=f"2026-01-{day:02d}T10:00:00Z", active_s=t or 300.0,
        outcome=Outcome.COMPLETED if t else Outcome.TIMED_OUT,
        measures={"sparc": sparc} | ({} if t is None else {"t": t}), invalid=invalid,
    )  # fmt: skip


OWN = [record("P01", 1, 90.0), record("P01", 2, 60.0, sparc=-1.8), record("P01", 3, 70.0, sparc=-1.6)]
OTHERS = [record(f"Q{i:02d}", 1, 50.0 + 10.0 * i) for i in range(1, 6)]  # 60, 70, 80, 90, 100 s


def line(card, key: str):
    return next(each for each in card.lines if each.metric.key == key)


def test_own_best_and_progress() -> None:
    card = score_card(OWN[2], OWN + OTHERS)
    time, smooth = line(card, "t"), line(card, "sparc")
    assert (time.best_before, time.is_best, time.history) == (60.0, False, ((1, 90.0), (2, 60.0), (3, 70.0)))
    assert (smooth.best_before, smooth.is_best) == (-1.8, True)
    first = line(score_card(OWN[0], OWN + OTHERS), "t")
    assert (first.best_before, first.is_best) == (None, False)


def test_percentile_counts_who_does_worse() -> None:
    time = line(score_card(OWN[2], OWN + OTHERS), "t")
    # Worse: 80, 90, 100; the same: 70.
    assert (time.percentile, time.others) == (70.0, 5)
    # By each one's median: further trials of one person weigh no more.
    more = [*OTHERS, record("Q05", 2, 20.0), record("Q05", 3, 95.0)]
    assert line(score_card(OWN[2], OWN + more), "t").percentile == 70.0
    assert line(score_card(OWN[2], OWN + OTHERS[1:]), "t").percentile is None


def test_what_must_not_be_compared_is_not() -> None:
    odd = [record("P01", 1, 1.0, condition="2d"), record("P01", 1, 1.0, invalid="the box was moved")]
    card = score_card(OWN[2], [*odd, OWN[1], OWN[2], record("P01", 9, 1.0)])
    assert line(card, "t").best_before == 60.0  # nor what came later
    censored = record("P01", 4, None)
    time = line(score_card(censored, OWN + OTHERS), "t")
    assert (time.value, time.is_best, time.percentile) == (None, False, None)


def test_familiarisation() -> None:
    def offer(reached: bool) -> Offer:
        return Offer(TargetResult("a", 0.0, 1.0 if reached else None, 0.0), 0, 1)

    offers = tuple(offer(each) for each in (True, True, False, True))
    result = TrialResult("x", Outcome.TIMED_OUT, 0, 10, 600.0, offers, 0.0, ((0, 10),))
    how = familiarisation(result, 3)
    assert (how.met, how.longest_row, how.reached, how.offered) == (False, 2, 3, 4)
    assert how.sentence == "Practice: criterion not met after 600 s: 2 of 3 targets in a row, 3 reached of 4 offered."
