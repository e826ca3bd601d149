"""How a pair is read: near the prediction first, and where that makes no good Track, in the whole pictures."""

from collections.abc import Callable

from cathxr.core import Observation, Status, Track, Tracker
from cathxr.tracking.judge import GUESSED_MM, UNRESOLVED


def read_and_track(
    look: Callable[[Track | None], Observation], tracker: Tracker, last: Track | None
) -> tuple[Observation, Track]:
    """Return what a pair shows, and its Track: what a recording has to hold of it, and nothing of a first try.

    look: reads the pair, only near the curve that the given Track predicts, or whole where it is given None. last: the
    Track before, None where there is none to go by.
    """
    observation = look(last if last is not None and _worth_following(last) else None)
    track = tracker.update(observation)
    if observation.predicted and track.status is not Status.TRACKED:
        observation = look(None)
        track = tracker.update(observation)
    return observation, track


def _worth_following(last: Track) -> bool:
    """Return whether a catheter may be looked for near a Track: where it is not known, it would be missed for good."""
    return not last.reason.startswith(UNRESOLVED) or (last.sigma_mm is not None and last.sigma_mm < GUESSED_MM)
