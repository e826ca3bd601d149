"""Pairing under jitter, drops, skew and different rates: nothing used twice, nothing goes back, nothing missed."""

from dataclasses import dataclass
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from cathxr.runtime.pairing import JITTER_PERIODS, STICKINESS_PERIODS, TOLERANCE_PERIODS, Pair, Pairer

PERIOD_NS = 16_666_667
OTHER_NS = 33_333_333


@dataclass(frozen=True)
class Stamp:
    camera: int
    seq: int
    t_ns: int


@dataclass(frozen=True)
class Scene:
    """Two cameras' pictures and when each arrived, in order of arrival."""

    arrivals: list[tuple[int, Stamp]]
    stamps: tuple[list[Stamp], list[Stamp]]


@st.composite
def scenes(
    draw: st.DrawFn,
    *,
    periods: tuple[int, int] = (PERIOD_NS, PERIOD_NS),
    phase: tuple[float, float] = (-0.5, 0.5),
    jitter: float = JITTER_PERIODS,
    drops: bool = True,
) -> Scene:
    """Draw two regular cameras: the second's phase in periods, jitter of each stamp, drops, delays of arrival."""
    shift = draw(st.floats(*phase))
    count = draw(st.integers(2, 60))
    delays_ns = [draw(st.integers(0, 2 * PERIOD_NS)) for _ in range(2)]
    stamps: tuple[list[Stamp], list[Stamp]] = ([], [])
    arrivals = []
    for camera, period_ns in enumerate(periods):
        number = max(2, count * PERIOD_NS // period_ns)
        wobble = draw(st.lists(st.floats(-jitter, jitter), min_size=number, max_size=number))
        lost = draw(st.sets(st.integers(0, number - 1), max_size=number // 3 if drops else 0))
        for seq in range(number):
            if seq not in lost:
                t_ns = 10**9 + round((seq + wobble[seq]) * period_ns + camera * shift * PERIOD_NS)
                stamps[camera].append(Stamp(camera, seq, t_ns))
                arrivals.append((t_ns + delays_ns[camera], stamps[camera][-1]))
    arrivals.sort(key=lambda each: (each[0], each[1].camera))
    return Scene(arrivals, stamps)


def run(scene: Scene, periods: tuple[int, int] = (PERIOD_NS, PERIOD_NS)) -> tuple[list[Pair[Stamp]], Pairer[Stamp]]:
    """Play a scene into a pairer in small steps of time, as a live thread would."""
    pairer: Pairer[Stamp] = Pairer(*periods)
    found: list[Pair[Stamp]] = []
    now_ns = scene.arrivals[0][0] if scene.arrivals else 0
    for arrival_ns, stamp in scene.arrivals:
        while (poll_ns := pairer.next_poll_ns()) is not None and now_ns < poll_ns < arrival_ns:
            now_ns = poll_ns
            found += pairer.poll(now_ns)
        now_ns = arrival_ns
        found += pairer.offer(stamp.camera, stamp, now_ns)
    found += pairer.flush()
    return found, pairer


def complete(found: list[Pair[Stamp]]) -> list[tuple[Stamp, Stamp]]:
    return [(each.first, each.second) for each in found if each.first is not None and each.second is not None]


def most_pairs(first: list[Stamp], second: list[Stamp], tolerance_ns: float) -> int:
    """Return the largest number of pairs in order that any method could make (dynamic programming)."""
    best = [[0] * (len(second) + 1) for _ in range(len(first) + 1)]
    for i, one in enumerate(first):
        for j, other in enumerate(second):
            fits = abs(one.t_ns - other.t_ns) <= tolerance_ns
            best[i + 1][j + 1] = max(best[i][j + 1], best[i + 1][j], best[i][j] + 1 if fits else 0)
    return best[-1][-1]


@given(scenes(jitter=0.9))
def test_no_picture_is_used_twice_and_time_never_goes_back(scene: Scene) -> None:
    # Jitter of almost a period: far beyond any camera, stamps may even swap places.
    found, pairer = run(scene)
    for camera in (0, 1):
        used = [each for pair in found if (each := (pair.first, pair.second)[camera]) is not None]
        assert len({each.seq for each in used}) == len(used)
        assert [each.t_ns for each in used] == sorted(each.t_ns for each in used)
        assert len(used) + pairer.unpaired[camera] == len(scene.stamps[camera])  # each is used or counted
    assert all(one.t_ns < other.t_ns for one, other in pairwise(found))


@given(scenes(jitter=0.9))
def test_every_pair_is_within_the_tolerance(scene: Scene) -> None:
    found, pairer = run(scene)
    longest_ns = max(PERIOD_NS, pairer.period_ns, 2 * PERIOD_NS)  # measured periods differ under such a jitter
    for one, other in complete(found):
        assert abs(one.t_ns - other.t_ns) <= TOLERANCE_PERIODS * longest_ns


@given(scenes(phase=(-0.35, 0.35), drops=False))
def test_steady_cameras_lose_nothing(scene: Scene) -> None:
    # Phase 0.35 and jitter of 0.1 on each side stay below half a period plus nothing: each has one nearest partner.
    found, _ = run(scene)
    seqs = [(one.seq, other.seq) for one, other in complete(found)]
    assert seqs == [(seq, seq) for seq in range(len(scene.stamps[0]))]


@given(scenes(phase=(-0.28, 0.28), jitter=0.05))
def test_with_drops_the_pairs_are_the_best_there_are(scene: Scene) -> None:
    # |phase| + 2 * jitter = 0.38: partners are never further than 0.4 of a period, strangers never nearer than 0.6,
    # so that the best pairing is known: the same number on both sides, wherever both exist.
    found, _ = run(scene)
    both = {each.seq for each in scene.stamps[0]} & {each.seq for each in scene.stamps[1]}
    assert {(one.seq, other.seq) for one, other in complete(found)} == {(seq, seq) for seq in both}


@given(scenes(drops=False, jitter=0.05))
def test_at_half_a_period_of_skew_at_most_two_pairs_fewer_than_possible_are_made(scene: Scene) -> None:
    # At the turn jitter decides who is nearest; the stickiness lets the pairing change sides once, not at every jitter.
    found, _ = run(scene)
    assert len(complete(found)) >= most_pairs(*scene.stamps, TOLERANCE_PERIODS * PERIOD_NS) - 2


@given(scenes(jitter=0.05))
def test_no_unused_picture_would_have_been_much_nearer(scene: Scene) -> None:
    found, _ = run(scene)
    pairs = complete(found)
    used = {(each.camera, each.seq) for pair in pairs for each in pair}
    # Beyond the stickiness: one jitter on either side of the measured period (the median of 15).
    margin_ns = (STICKINESS_PERIODS + 4 * 0.05) * PERIOD_NS
    for pair in pairs:
        skew_ns = abs(pair[0].t_ns - pair[1].t_ns)
        for camera in (0, 1):
            rivals = [each for each in scene.stamps[1 - camera] if (1 - camera, each.seq) not in used]
            assert all(abs(each.t_ns - pair[camera].t_ns) >= skew_ns - margin_ns for each in rivals)


@given(scenes(periods=(PERIOD_NS, OTHER_NS), phase=(-0.35, 0.35), drops=False, jitter=0.02))
def test_cameras_of_different_rates_pair_each_picture_of_the_slower(scene: Scene) -> None:
    found, _ = run(scene, (PERIOD_NS, OTHER_NS))
    slower_and_faster = [(other, one) for one, other in complete(found)]
    for slow, fast in slower_and_faster:
        assert fast.seq == 2 * slow.seq
    inside = [each for each in scene.stamps[1] if each.t_ns <= scene.stamps[0][-1].t_ns]
    assert len(slower_and_faster) >= len(inside) - 1  # the last may stand at the very end of the other stream
