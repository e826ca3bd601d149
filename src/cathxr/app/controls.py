"""Tells clients where the twin's controls stand, so that their sliders follow a running script."""

from collections.abc import Callable
from dataclasses import asdict

from cathxr.core import Event
from cathxr.runtime.moment import Moment
from cathxr.twin import TwinWorld

PERIOD_NS = 200_000_000


class ControlsPublisher:
    """A taker of Moments that publishes an event of kind `controls` five times a second."""

    def __init__(self, world: TwinWorld, publish: Callable[[Event], None]) -> None:
        self._world, self._publish = world, publish
        self._due_ns = 0

    def __call__(self, moment: Moment) -> None:
        """Publish the controls at the Moment's instant, when it is time to."""
        t_ns = moment.track.t_ns
        if t_ns < self._due_ns:
            return
        self._due_ns = t_ns + PERIOD_NS
        values = {name: round(float(value), 3) for name, value in asdict(self._world.controls(t_ns)).items()}
        self._publish(Event(t_ns, "controls", values))
