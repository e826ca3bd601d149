"""A trial's motion as arrays, cut into segments at everything that is not known: nothing is bridged."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray, Track
from cathxr.core.arrays import checked
from cathxr.core.track import Status
from cathxr.training.watch import GAP_NS

CUTOFF_HZ = 6.0
"""Tremor and the tracker's noise lie above, what a hand does on purpose below."""
_ORDER = 2
_EVEN = 0.05
_SETTLE = 3.0
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of the tip. Where `seen` is False tip and rotation say nothing, and where `rolled` is False the roll.

    t_s (N,): increasing, of the host's clock from any origin. tip_box (N, 3) mm. rotation (N, 3, 3): box_from_tip's.
    roll_rad (N,): unwrapped. seen, rolled (N,). stretch (N,): a number that changes at every pause.
    """

    t_s: FloatArray
    tip_box: FloatArray
    rotation: FloatArray
    roll_rad: FloatArray
    seen: BoolArray
    rolled: BoolArray
    stretch: npt.NDArray[np.int64]

    def __post_init__(self) -> None:
        n = len(self.t_s)
        for name, shape in (("t_s", (n,)), ("tip_box", (n, 3)), ("rotation", (n, 3, 3)), ("roll_rad", (n,))):
            object.__setattr__(self, name, checked(name, getattr(self, name), shape))
        if not len(self.seen) == len(self.rolled) == len(self.stretch) == n:
            raise ValueError(f"Motion: expected {n} samples of everything")
        if n > 1 and not (np.diff(self.t_s) > 0).all():
            raise ValueError("t_s: expected increasing instants")
        if (self.rolled & ~self.seen).any():
            raise ValueError("rolled: expected a roll only where the tip is seen")

    @classmethod
    def of(cls, t_s: FloatArray, tip_box: FloatArray, rotation: FloatArray | None = None) -> "Motion":
        """Return a motion that is seen throughout. rotation: the identity unless given; roll is not known."""
        n = len(t_s)
        turned = np.tile(np.eye(3), (n, 1, 1)) if rotation is None else rotation
        yes, no = np.ones(n, bool), np.zeros(n, bool)
        return cls(t_s, tip_box, turned, np.zeros(n), yes, no, np.zeros(n, np.int64))

    def between(self, from_s: float, to_s: float) -> "Motion":
        """Return the samples from one instant to another, both included."""
        return self.taken((self.t_s >= from_s) & (self.t_s <= to_s))

    def taken(self, which: BoolArray) -> "Motion":
        """Return some of the samples."""
        return Motion(**{name: value[which] for name, value in vars(self).items()})

    def segments(self) -> Iterator["Segment"]:
        """Yield the runs of seen samples without a gap of over 0.25 s and without a pause; two samples at least."""
        for start, stop in _runs(self.seen, np.diff(self.t_s), self.stretch):
            yield Segment(self, start, stop)

    def rolled_runs(self) -> Iterator[FloatArray]:
        """Yield the roll (M,) of each run of samples that have one; two samples at least."""
        for start, stop in _runs(self.rolled, np.diff(self.t_s), self.stretch):
            yield self.roll_rad[start:stop]

    @property
    def whole(self) -> bool:
        """Whether every sample belongs to one segment: nothing is missing in between."""
        return len(self.t_s) > 1 and next(iter(_runs(self.seen, np.diff(self.t_s), self.stretch)), None) == (
            0,
            len(self.t_s),
        )


@dataclass(frozen=True, eq=False)
class Segment:
    """A run of samples in which the tip was seen throughout, from `start` to before `stop` of its motion."""

    motion: Motion
    start: int
    stop: int

    @property
    def t_s(self) -> FloatArray:
        """Instants (M,), s."""
        return self.motion.t_s[self.start : self.stop]

    @property
    def tip_box(self) -> FloatArray:
        """The tip (M, 3), mm."""
        return self.motion.tip_box[self.start : self.stop]

    @property
    def rotation(self) -> FloatArray:
        """The tip's orientation (M, 3, 3)."""
        return self.motion.rotation[self.start : self.stop]

    @property
    def duration_s(self) -> float:
        """Its length in time."""
        return float(self.t_s[-1] - self.t_s[0])

    @property
    def speed_mm_s(self) -> FloatArray:
        """The tip's speed (M - 1,) from each sample to the next."""
        return np.asarray(np.linalg.norm(np.diff(self.tip_box, axis=0), axis=1) / np.diff(self.t_s))

    @property
    def turn_deg_s(self) -> FloatArray:
        """The orientation's angular speed (M - 1,) from each sample to the next, degrees/s."""
        return np.degrees(turns_rad(self.rotation)) / np.diff(self.t_s)


def motion_of(tracks: Sequence[Track], stretches: Sequence[tuple[int, int]]) -> Motion:
    """Return the motion in the Tracks whose instants lie in one of the active stretches (from, to), ns.

    Only tracked Tracks are seen. Instants are counted from the first stretch's beginning.
    """
    rows: list[tuple[Track, int]] = []
    last = -1
    for track in tracks:
        at = next((number for number, (start, end) in enumerate(stretches) if start <= track.t_ns <= end), None)
        if at is not None and track.t_ns > last:
            rows.append((track, at))
            last = track.t_ns
    n, origin = len(rows), stretches[0][0] if stretches else 0
    tip, rotation, roll = np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1)), np.zeros(n)
    seen, rolled = np.zeros(n, bool), np.zeros(n, bool)
    for i, (track, _) in enumerate(rows):
        if track.status is Status.TRACKED and track.tip_box is not None and track.box_from_tip is not None:
            tip[i], rotation[i], seen[i] = track.tip_box, track.box_from_tip.rotation, True
            if track.roll_rad is not None:
                roll[i], rolled[i] = track.roll_rad, True
    t_s = np.array([(track.t_ns - origin) / 1e9 for track, _ in rows], dtype=np.float64)
    return Motion(t_s, tip, rotation, roll, seen, rolled, np.array([at for _, at in rows], dtype=np.int64))


def smoothed(motion: Motion, *, cutoff_hz: float = CUTOFF_HZ) -> Motion:
    """Return the motion with the tip of each segment low-passed: Butterworth of order 2, forwards and back, no delay.

    A segment that is too short for the filter, or sampled at under 4 times the cut-off, stays as it is. Samples that
    are not even in time are filtered as if they were (jitter of some ms is small against the cut-off).
    """
    from scipy.signal import butter, sosfiltfilt  # a second to load, which a start of the live system need not wait for

    tip = motion.tip_box.copy()
    for segment in motion.segments():
        rate = rate_hz(segment)
        if rate >= 4.0 * cutoff_hz and segment.stop - segment.start > 3 * (2 * _ORDER + 1):
            sections: Any = butter(_ORDER, cutoff_hz, fs=rate, output="sos")
            # Half a second of the motion, mirrored through its end, lets the filter settle before the segment begins.
            pad = min(segment.stop - segment.start - 1, int(np.ceil(_SETTLE * rate / cutoff_hz)))
            tip[segment.start : segment.stop] = sosfiltfilt(sections, segment.tip_box, axis=0, padlen=pad)
    return Motion(motion.t_s, tip, motion.rotation, motion.roll_rad, motion.seen, motion.rolled, motion.stretch)


def rate_hz(segment: Segment) -> float:
    """Return how many samples a second a segment has, by the median of its steps."""
    return float(1.0 / np.median(np.diff(segment.t_s)))


def even(segment: Segment) -> tuple[FloatArray, float]:
    """Return the tip (M, 3) at even steps and their rate, Hz: as sampled when even to 5 %, else interpolated."""
    steps = np.diff(segment.t_s)
    rate = rate_hz(segment)
    if (np.abs(steps * rate - 1.0) <= _EVEN).all():
        return segment.tip_box, (len(steps)) / segment.duration_s
    count = max(2, round(segment.duration_s * rate) + 1)
    wanted = np.linspace(segment.t_s[0], segment.t_s[-1], count)
    tip = np.column_stack([np.interp(wanted, segment.t_s, axis) for axis in segment.tip_box.T])
    return tip, (count - 1) / segment.duration_s


def turns_rad(rotation: FloatArray) -> FloatArray:
    """Return the angle (M - 1,) from each orientation of (M, 3, 3) to the next, exact for small ones too."""
    relative = np.swapaxes(rotation[:-1], 1, 2) @ rotation[1:]
    # |R - I| (Frobenius) is 2 sqrt(2) sin(angle / 2): no cancellation, unlike the trace's arc cosine.
    chord = np.linalg.norm(relative - np.eye(3), axis=(1, 2)) / (2.0 * np.sqrt(2.0))
    return np.asarray(2.0 * np.arcsin(np.clip(chord, 0.0, 1.0)))


def _runs(good: BoolArray, steps: FloatArray, stretch: npt.NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    if len(good) < 2:
        return
    joined = good[:-1] & good[1:] & (steps <= GAP_NS / 1e9) & (stretch[:-1] == stretch[1:])
    edges = np.diff(np.concatenate([[False], joined, [False]]).astype(np.int8))
    for start, last in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        yield int(start), int(last) + 1
