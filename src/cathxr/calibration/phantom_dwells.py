"""Where a tip came to rest in a recorded session, and which hole of a phantom each rest was in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray, Status, Track
from cathxr.core.phantom import Phantom

RADIUS_MM = 1.0
"""A tip that stays within this of where it is rests."""
LEAST_S = 0.6
LONGEST_GAP_S = 0.7
"""Tracking may be lost for this long within a rest: a hand in front of the light, a hole that hides the tip."""
_FEWEST = 5
_TRIM = 0.15
_GATE = 0.45
_SKIP, _REPEAT, _BACK, _ELSEWHERE = 2.0, 2.5, 5.0, 6.0


@dataclass(frozen=True, eq=False)
class Dwell:
    """One rest of the tip: from start_s to end_s, mean (3,) mm in `box`, std (3,) mm of the single Tracks, their count.

    sigma_mm: what the Tracks themselves state, median.
    """

    start_s: float
    end_s: float
    mean_box: FloatArray
    std_mm: FloatArray
    count: int
    sigma_mm: float


@dataclass(frozen=True)
class Visit:
    """A dwell in a hole: both by index."""

    dwell: int
    hole: int


def find_dwells(tracks: Sequence[Track]) -> tuple[Dwell, ...]:
    """Return where the tip rested, in order of time.

    Grown from each Track on while the tip stays within RADIUS_MM of the rest's running median; the first and the last
    seventh, in which a tip settles and leaves, do not count. Short losses are bridged.
    """
    seen = [each for each in tracks if each.status is Status.TRACKED and each.shape_box is not None]
    if len(seen) < _FEWEST:
        return ()
    t_s = np.array([each.t_ns for each in seen]) * 1e-9
    tips = np.stack([each.shape_box[0] for each in seen if each.shape_box is not None])
    sigmas = np.array([each.sigma_mm or 0.0 for each in seen])
    found: list[tuple[int, int]] = []
    start = 0
    while start < len(seen) - 1:
        end = _grown(t_s, tips, start)
        if t_s[end - 1] - t_s[start] >= LEAST_S and end - start >= _FEWEST:
            found.append((start, end))
            start = end
        else:
            start += 1
    return tuple(_dwell(t_s, tips, sigmas, *each) for each in _merged(t_s, tips, found))


def _grown(t_s: FloatArray, tips: FloatArray, start: int) -> int:
    """Return the index after the last Track that still rests where the Track `start` does."""
    centre = tips[start].copy()
    end = start + 1
    while end < len(tips) and t_s[end] - t_s[end - 1] <= LONGEST_GAP_S:
        if np.linalg.norm(tips[end] - centre) > RADIUS_MM:
            # one wild Track does not end a rest; two do
            after = end + 1
            if after >= len(tips) or np.linalg.norm(tips[after] - centre) > RADIUS_MM:
                break
        end += 1
        centre += (tips[end - 1] - centre) / min(end - start, 30)
    return end


def _merged(t_s: FloatArray, tips: FloatArray, found: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the rests with those joined that a twitch or a short loss split."""
    result: list[tuple[int, int]] = []
    for start, end in found:
        if result:
            first, last = result[-1]
            near = np.linalg.norm(np.median(tips[first:last], axis=0) - np.median(tips[start:end], axis=0)) < RADIUS_MM
            if near and t_s[start] - t_s[last - 1] <= LONGEST_GAP_S:
                result[-1] = (first, end)
                continue
        result.append((start, end))
    return result


def _dwell(t_s: FloatArray, tips: FloatArray, sigmas: FloatArray, start: int, end: int) -> Dwell:
    duration = t_s[end - 1] - t_s[start]
    inner = (t_s[start:end] >= t_s[start] + _TRIM * duration) & (t_s[start:end] <= t_s[end - 1] - _TRIM * duration)
    own = tips[start:end][inner]
    off = np.linalg.norm(own - np.median(own, axis=0), axis=1)
    own = own[off <= max(5.0 * float(np.median(off)), 0.05)]
    return Dwell(
        float(t_s[start]), float(t_s[end - 1]), own.mean(axis=0), own.std(axis=0, ddof=min(1, len(own) - 1)), len(own),
        float(np.median(sigmas[start:end])),
    )  # fmt: skip


def matched(phantom: Phantom, dwells: Sequence[Dwell]) -> tuple[Visit, ...]:
    """Return which dwell was in which hole, in order of time; dwells elsewhere are left out.

    The best sequence by dynamic programming (Viterbi): nearness to the hole, against the cost of leaving the order:
    skipping holes, staying for a second time, going back. After the last hole the round may begin again.
    """
    if not dwells:
        return ()
    holes, gate = len(phantom.holes), _GATE * phantom.least_spacing_mm
    apart = np.linalg.norm(np.stack([each.mean_box for each in dwells])[:, None] - phantom.positions_mm[None], axis=-1)
    fit = np.where(apart <= gate, np.square(3.0 * apart / gate), np.inf)
    steps = (np.arange(holes)[None] - np.arange(holes)[:, None]) % holes
    move = np.where(steps == 0, _REPEAT, np.minimum(_SKIP * (steps - 1.0), _BACK))
    cost = np.concatenate([np.minimum(_SKIP * np.arange(holes), _BACK), [0.0]])  # the last state: none yet
    came = np.empty((len(dwells), holes + 1), dtype=int)
    taken = np.zeros((len(dwells), holes + 1), dtype=bool)
    start = cost[:holes].copy()
    state = np.concatenate([np.full(holes, np.inf), [0.0]])
    for index in range(len(dwells)):
        stay = state + _ELSEWHERE
        arrive = np.concatenate([state[:holes, None] + move, (state[holes] + start)[None]])
        best = arrive.argmin(axis=0)
        total = np.concatenate([arrive[best, np.arange(holes)] + fit[index], [np.inf]])
        taken[index] = total < stay
        came[index] = np.where(taken[index], np.concatenate([best, [holes]]), np.arange(holes + 1))
        state = np.where(taken[index], total, stay)
    visits: list[Visit] = []
    at = int(state.argmin())
    for index in range(len(dwells) - 1, -1, -1):
        if taken[index, at]:
            visits.append(Visit(index, at))
        at = int(came[index, at])
    return tuple(reversed(visits))
