"""The trial at hand, from ready to its end: countdown, the trial itself, and the pause where no Tracks come. Pure."""

from collections.abc import Sequence

from cathxr.core import ConfigError, Event, Track
from cathxr.runtime.training_choice import folder_name
from cathxr.runtime.training_nouns import Chosen
from cathxr.training import Phase, Trial
from cathxr.wire.training_messages import TrainingPhase

COUNTDOWN_NS = 3_000_000_000
STALL_NS = 10_000_000_000
"""After so long without any Track a trial pauses itself: a closed lid, a lost camera."""


class TrialAtHand:
    """One trial that was prepared. Every instant is the host's clock, ns; what happens comes back as Events.

    events, tracks: what came out of it and was given to it so far. session: its recording. sentence: what the operator
    should know.
    """

    def __init__(self, chosen: Chosen) -> None:
        self.chosen = chosen
        self.session = folder_name(chosen) if chosen.start is None else chosen.start.session
        self.trial = Trial(chosen.placed, chosen.order, trial=chosen.id, carried=chosen.carried)
        self.events: list[Event] = []
        self.tracks: list[Track] = []
        self.sentence = ""
        self._counting_from_ns: int | None = None
        self._heard_ns = 0

    @property
    def phase(self) -> TrainingPhase:
        """Where it stands."""
        match self.trial.state.phase:
            case Phase.WAITING:
                return "ready" if self._counting_from_ns is None else "countdown"
            case Phase.RUNNING:
                return "running"
            case Phase.PAUSED:
                return "paused"
        return "ended"

    @property
    def is_on(self) -> bool:
        """Whether it counts down, runs or is paused: its recording runs."""
        return self.phase in ("countdown", "running", "paused")

    def countdown_s(self, now_ns: int) -> float | None:
        """Return how long until it begins, None when it does not count down."""
        if self.phase != "countdown" or self._counting_from_ns is None:
            return None
        return max(0.0, (self._counting_from_ns + COUNTDOWN_NS - now_ns) / 1e9)

    def count_down(self, now_ns: int) -> None:
        """Begin in three seconds."""
        self._expect("begin", "ready")
        self._counting_from_ns, self.sentence = now_ns, ""

    def stop_counting(self) -> None:
        """Be ready again."""
        self._expect("stop", "countdown")
        self._counting_from_ns = None

    def pause(self, now_ns: int) -> Sequence[Event]:
        """Stop the time."""
        self._expect("pause", "running")
        return self._kept(self.trial.pause(now_ns))

    def resume(self, now_ns: int) -> Sequence[Event]:
        """Let the time run again."""
        self._expect("go on", "paused")
        self.sentence, self._heard_ns = "", now_ns
        return self._kept(self.trial.resume(now_ns))

    def abort(self, now_ns: int) -> Sequence[Event]:
        """End it."""
        self._expect("abort", "running", "paused")
        return self._kept(self.trial.abort(now_ns))

    def due(self, now_ns: int) -> bool:
        """Return whether the countdown is over, and `begin` is to be called."""
        return self.countdown_s(now_ns) == 0.0

    def begin(self, now_ns: int) -> Sequence[Event]:
        """Begin the trial itself."""
        self._expect("begin", "countdown")
        self._heard_ns = now_ns
        return self._kept(self.trial.begin(now_ns))

    def look(self, now_ns: int) -> Sequence[Event]:
        """Pause where no Track has come for too long."""
        if self.phase != "running" or now_ns <= self._heard_ns + STALL_NS:
            return ()
        events = self._kept(self.trial.pause(self._heard_ns + STALL_NS))
        if self.trial.state.phase is Phase.PAUSED:
            self.sentence = (
                f"Paused by itself: no picture came for {STALL_NS // 1_000_000_000} s. Resume when the "
                "pictures are back, or mark the trial invalid."
            )
        return events

    def take(self, track: Track) -> Sequence[Event]:
        """Take the next Track. One after a long gap finds the trial paused, as if the gap had been noticed in time."""
        events = tuple(self.look(track.t_ns))
        if self.phase in ("running", "paused"):
            self.tracks.append(track)
        self._heard_ns = max(self._heard_ns, track.t_ns)
        return (*events, *self._kept(self.trial.take(track)))

    def _kept(self, events: Sequence[Event]) -> Sequence[Event]:
        self.events += events
        return events

    def _expect(self, act: str, *phases: str) -> None:
        if self.phase not in phases:
            words = {"countdown": "counts down", "running": "runs", "paused": "is paused", "ended": "has ended"}
            raise ConfigError(f"This trial cannot {act} now: it {words.get(self.phase, 'has not begun')}.")
