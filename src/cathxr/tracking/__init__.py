"""From Observations to Tracks. Pure state machines: no clock, no files, no threads."""

from cathxr.core import ConfigError, Rig, Tracker
from cathxr.tracking.model import ModelTracker
from cathxr.tracking.paper import PaperTracker
from cathxr.tracking.reading import read_and_track


def make_tracker(method: str, rig: Rig, *, points: int = 50) -> Tracker:
    """Return the tracker of a method ("model" or "paper") for a rig; its Tracks have `points` points.

    Raises:
        ConfigError: no such method. ValueError: points outside 2 to 200.
    """
    if method == "model":
        return ModelTracker(rig, points=points)
    if method == "paper":
        return PaperTracker(rig, points=points)
    raise ConfigError(f"There is no method '{method}'; choose one of model, paper.")


__all__ = ["make_tracker", "read_and_track"]
