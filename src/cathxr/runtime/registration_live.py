"""Touching landmarks, running: one thread reads the tracker, another gives all Tracks that came to the session."""

from cathxr.core import Clock, Source, Track
from cathxr.runtime.calibration_running import Outlet, RunningCalibration
from cathxr.runtime.queues import Queue
from cathxr.runtime.registration_touch import TouchSession
from cathxr.runtime.supervisor import DeviceThread

TRACKER = "tracker"
_STEP_S = 0.05
"""How often the page is told: a hand is slower than that."""
_HELD = 1024


class LiveTouching(RunningCalibration):
    """Runs a TouchSession. A context manager: entering starts it, leaving stops it."""

    _what = "a Track"

    def __init__(self, session: TouchSession, source: Source[Track], *, outlet: Outlet, clock: Clock) -> None:
        self._tracks: Queue[Track] = Queue(_HELD)
        device = DeviceThread(TRACKER, source, self._tracks.put, clock=clock)
        super().__init__(session, {TRACKER: device}, outlet=outlet, clock=clock)
        self._session = session

    def _look_once(self) -> None:
        self._stopping.wait(_STEP_S)
        tracks = []
        while (track := self._tracks.get(0.0)) is not None:
            tracks.append(track)
        if tracks and not self._stopping.is_set():
            self._guarded(lambda: self._give(tracks))

    def _give(self, tracks: list[Track]) -> None:
        with self._lock:
            if self._session.ending is None:
                self._session.take(tracks)
                self._after_change()
