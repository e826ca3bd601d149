"""Tracking without a live system: picture pairs in, Tracks out, as fast as they go."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from cathxr.core import Detector, Image, Observation, Rig, Status, Track, Tracker


class Counts(Protocol):
    """Where the encoder's count at an instant comes from."""

    def at(self, t_ns: int) -> float | None:
        """Return the count, None where it is unknown."""
        ...


@dataclass(frozen=True, eq=False)
class TrackedPair:
    """One pair and what came of it."""

    top: Image
    front: Image
    observation: Observation
    track: Track


def track_pairs(
    rig: Rig,
    pairs: Iterable[tuple[Image, Image]],
    detectors: Mapping[str, Detector],
    tracker: Tracker,
    *,
    counts: Counts | None = None,
) -> Iterator[TrackedPair]:
    """Yield a Track for each (top, front) pair of pictures, in order; `seq` is the pair's 0-based index.

    detectors: one for "top", one for "front"; they and the tracker are reset first. While tracking, the detectors are
    given the last Track, as live. counts: the encoder on the pictures' clock, None where there is none.
    """
    # Imported here: the compiled methods take seconds to load, which --help and a wrong path need not wait for.
    from cathxr.tracking import read_and_track

    for detector in detectors.values():
        detector.reset()
    tracker.reset()
    last: Track | None = None
    for seq, (top, front) in enumerate(pairs):
        look = partial(_seen, seq, top, front, detectors, _roll_rad(rig, counts, top.t_ns))
        observation, track = read_and_track(look, tracker, last)
        last = None if track.status is Status.LOST else track
        yield TrackedPair(top, front, observation, track)


def _seen(
    seq: int, top: Image, front: Image, detectors: Mapping[str, Detector], roll_rad: float | None, last: Track | None
) -> Observation:
    """Return what a pair shows, read near what `last` predicts, or whole without it."""
    detections = (detectors["top"].detect(top, last), detectors["front"].detect(front, last))
    return Observation(seq, top.t_ns, detections, front.t_ns - top.t_ns, roll_rad)


def _roll_rad(rig: Rig, counts: Counts | None, t_ns: int) -> float | None:
    count = None if counts is None or rig.roll is None else counts.at(t_ns)
    return None if count is None or rig.roll is None else rig.roll.angle_rad(count)
