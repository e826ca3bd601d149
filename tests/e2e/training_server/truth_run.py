"""`cathxr run` on the twin, but with its exact Tracks instead of rendered pictures: for machines that are busy."""

import time
from dataclasses import replace
from typing import Any, Self

from cathxr.app import live_parts, run_command
from cathxr.core import Clock, Detection, Health, Observation, Track
from cathxr.runtime.fanout import Fanout
from cathxr.runtime.moment import Moment
from cathxr.twin import TwinWorld

_PERIOD_S = 0.04


class TruthSource:
    """A MomentSource of the twin's exact Tracks, 25 a second."""

    skew_ns = None

    def __init__(self, world: TwinWorld, clock: Clock) -> None:
        self._world, self._clock, self._seq, self._wanted = world, clock, 0, False
        self.resets: Fanout[int] = Fanout()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def request_reset(self) -> None:
        self._wanted = True

    def health(self, now_ns: int) -> tuple[Health, ...]:
        return ()

    def read(self, timeout_s: float) -> Track | None:
        return self.read_moment(timeout_s).track

    def read_moment(self, timeout_s: float) -> Moment:
        time.sleep(_PERIOD_S)
        if self._wanted:
            self._wanted = False
            self.resets.write(self._seq)
        t_ns, seq = self._clock.now_ns(), self._seq
        self._seq += 1
        missing = tuple(Detection(name, seq, t_ns, reason="not rendered") for name in ("top", "front"))
        return Moment(self._world.truth(t_ns, seq=seq, points=20), Observation(seq, t_ns, missing))


_parts = live_parts.live_parts


def _with_truth(source: str, config: Any, *, clock: Clock) -> live_parts.LiveParts:
    parts = _parts(source, config, clock=clock)
    assert parts.world is not None
    return replace(parts, source=TruthSource(parts.world, clock), optical=None)


if __name__ == "__main__":
    live_parts.live_parts = _with_truth
    run_command.prepare = lambda *_: None
    run_command.run()
