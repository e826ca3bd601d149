"""Splits a series into cardiac phases, and chooses the end of diastole.

End-diastole is the instant of the largest ventricles, at the R wave: 0 % or 100 % of the RR interval. Where no phase
is reconstructed there, the latest diastolic one stands for it; 75 % is the usual surrogate (Isma'eel et al., 2009,
doi 10.1007/s10554-009-9481-y: end-diastolic volumes at 95 %, 75 % as the surrogate of prospectively triggered scans).
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from cathxr.core import DataError
from cathxr.heart.reading.frames import Frame

_DIASTOLE_FROM, _R_WAVE_UNTIL = 65.0, 5.0
_SAME_PERCENT = 2.5
_NEAR_R_MS = 30.0
_COVERED = 0.5
_POSITION_STEP_MM = 0.01


@dataclass(frozen=True, eq=False)
class Phase:
    """The frames of one instant of the cycle. percent: of the RR interval, None where the series does not say."""

    label: str
    percent: float | None
    frames: tuple[Frame, ...]
    trigger_ms: float | None = None

    @property
    def from_end_diastole(self) -> float | None:
        """Return how far from the R wave it is in per cent; None for systole, early diastole, and where unknown."""
        if self.percent is None:
            near = self.trigger_ms is not None and self.trigger_ms <= _NEAR_R_MS
            return 0.0 if near else None
        if _R_WAVE_UNTIL < self.percent < _DIASTOLE_FROM:
            return None
        return min(self.percent, 100.0 - self.percent)


def split(frames: Sequence[Frame]) -> list[Phase]:
    """Return the phases of the frames of one series and orientation, in the order of the cycle.

    One phase holds at most one frame at a position, as far as any element tells frames at one position apart; copies
    that nothing tells apart stay in one phase.
    """
    places = [_place(each) for each in frames]
    repeats = Counter(places)
    if max(repeats.values()) == 1:
        return [_named(tuple(frames), "")]
    for what, parts in _ways(frames, places):
        if len(parts) > 1 and all(_is_one_phase(part, len(repeats)) for part in parts):
            named = [_named(tuple(part), f"{what} {n}") for n, part in enumerate(parts, start=1)]
            named.sort(key=lambda each: (each.percent is None, each.percent or 0.0))
            return named
    return [_named(tuple(frames), "")]


def choose(phases: Sequence[Phase], asked: str | float | None) -> tuple[Phase, str]:
    """Return the phase that is asked for, else the end of diastole, and in words how it was chosen.

    Raises:
        DataError: nothing is asked for and the series does not tell which phase is end-diastole, or there is none such.
    """
    if asked is not None:
        found = _asked(phases, asked)
        return found, f"{found.label or 'the only phase'}, as asked"
    if len(phases) == 1:
        return phases[0], phases[0].label
    known = [(distance, each) for each in phases if (distance := each.from_end_diastole) is not None]
    if not known:
        raise DataError(
            f"The series has {len(phases)} phases and does not tell which one is end-diastole; "
            f"choose with --phase one of: {_listed(phases)}."
        )
    best = min(known, key=lambda each: (each[0], -(each[1].percent or 0.0)))[1]
    return best, f"{best.label}, taken as end-diastole of {len(phases)} phases ({_listed(phases)})"


def percent_of(frame: Frame) -> float | None:
    """Return the per cent of the RR interval that a frame says it shows."""
    timing = frame.timing
    if timing.percent is not None:
        return timing.percent
    if timing.described_percent is not None:
        return timing.described_percent
    if timing.trigger_ms is not None and timing.interval_ms:
        return min(100.0 * timing.trigger_ms / timing.interval_ms, 100.0)
    return None


def _asked(phases: Sequence[Phase], asked: str | float) -> Phase:
    text = str(asked).strip().lower()
    if exact := [each for each in phases if each.label.lower() == text]:
        return exact[0]
    number = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(%|ms)?", text)
    if number:
        value, of_ms = float(number[1]), number[2] == "ms"
        offers = [(each.trigger_ms if of_ms else each.percent, each) for each in phases]
        near = [(abs(at - value), each) for at, each in offers if at is not None]
        if near and min(near, key=lambda each: each[0])[0] <= (25.0 if of_ms else _SAME_PERCENT):
            return min(near, key=lambda each: each[0])[1]
        if not near and not number[2] and value == int(value) and 1 <= value <= len(phases):
            return phases[int(value) - 1]
    raise DataError(f"The phase {asked} is not in the series; choose with --phase one of: {_listed(phases)}.")


def _listed(phases: Sequence[Phase]) -> str:
    return ", ".join(each.label or "one phase without a name" for each in phases)


def _place(frame: Frame) -> tuple[int, ...]:
    assert frame.position is not None, "frames without positions are set aside before"
    return tuple(int(each) for each in np.rint(frame.position / _POSITION_STEP_MM))


def _ways(frames: Sequence[Frame], places: Sequence[tuple[int, ...]]) -> list[tuple[str, list[list[Frame]]]]:
    """Return the ways of telling phases apart, the surest first: what a part is called, and the parts."""
    return [
        ("phase", _by(frames, lambda each: each.timing.percent)),
        ("phase", _by(frames, lambda each: each.timing.described_percent)),
        ("phase", _by_rank(frames, places, lambda each: each.timing.trigger_ms)),
        ("time", _by(frames, lambda each: each.timing.temporal)),
        ("acquisition", _by(frames, lambda each: each.timing.acquisition)),
    ]


def by_instance(frames: Sequence[Frame]) -> list[Phase]:
    """Return the frames at each position in the order of their instance numbers, as times; [] where they do not say."""
    parts = _by_rank(frames, [_place(each) for each in frames], lambda each: each.timing.instance)
    return [_named(tuple(part), f"time {number}") for number, part in enumerate(parts, start=1)]


def _by(frames: Sequence[Frame], key: Callable[[Frame], float | None]) -> list[list[Frame]]:
    """Return the frames in parts of equal key, in the key's order; [] where one has none."""
    parts: dict[float, list[Frame]] = defaultdict(list)
    for each in frames:
        value = key(each)
        if value is None:
            return []
        parts[value].append(each)
    return [parts[value] for value in sorted(parts)]


def _by_rank(
    frames: Sequence[Frame], places: Sequence[Hashable], key: Callable[[Frame], float | None]
) -> list[list[Frame]]:
    """Return the first of each position, the second, …, ordered by key; [] where positions hold unequal numbers.

    Trigger times differ a little from slice to slice of one phase, so that equal values cannot be asked for.
    """
    columns: dict[Hashable, list[tuple[float, Frame]]] = defaultdict(list)
    for each, place in zip(frames, places, strict=True):
        value = key(each)
        if value is None:
            return []
        columns[place].append((value, each))
    counts = {len(each) for each in columns.values()}
    if len(counts) != 1 or any(len({value for value, _ in each}) != len(each) for each in columns.values()):
        return []
    ordered = [sorted(each, key=lambda pair: pair[0]) for each in columns.values()]
    return [[each[rank][1] for each in ordered] for rank in range(counts.pop())]


def _is_one_phase(part: Sequence[Frame], positions: int) -> bool:
    places = Counter(_place(each) for each in part)
    return max(places.values()) == 1 and len(places) >= _COVERED * positions


def _named(frames: tuple[Frame, ...], fallback: str) -> Phase:
    """Return a phase by its per cent, else its delay after the R wave, else `fallback`."""
    percents = [each for each in map(percent_of, frames) if each is not None]
    triggers = [each.timing.trigger_ms for each in frames if each.timing.trigger_ms is not None]
    trigger = float(np.median(triggers)) if triggers else None
    if percents and np.ptp(percents) <= 10.0:
        percent = float(np.median(percents))
        return Phase(f"{percent:.3g} %", percent, frames, trigger)
    if trigger is not None and (fallback or np.ptp(triggers) <= 50.0):
        return Phase(f"{trigger:.0f} ms", None, frames, trigger)
    return Phase(fallback, None, frames, trigger)
