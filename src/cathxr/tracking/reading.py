"""How a pair is read: near the prediction first, and where that makes no good Track, in the whole pictures."""

from collections.abc import Callable

from cathxr.core import Observation, Status, Track, Tracker


def read_and_track(
    look: Callable[[Track | None], Observation], tracker: Tracker, last: Track | None
) -> tuple[Observation, Track]:
    """Return what a pair shows, and its Track: what a recording has to hold of it, and nothing of a first try.

    look: reads the pair, only near the curve that the given Track predicts, or whole where it is given None. last: the
    Track before, None where there is none to go by.
    """
    observation = look(last)
    track = tracker.update(observation)
    if observation.predicted and track.status is not Status.TRACKED:
        observation = look(None)
        track = tracker.update(observation)
    return observation, track
