"""Where every other thread hands over what the clients shall see, and from where each client's outbox is filled."""

import asyncio
import logging
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cathxr.core import ConfigError, Event, Health, Image, RollStatus, Track
from cathxr.wire.calibration_messages import CalibrationState
from cathxr.wire.clients import Clients
from cathxr.wire.convert import encode, event_message, health_message, roll_message, settings_of, track_message
from cathxr.wire.heart_messages import HeartSeedsState
from cathxr.wire.messages import HealthMessage, SessionMessage
from cathxr.wire.outbox import Outbox
from cathxr.wire.pictures import Pictures
from cathxr.wire.results import Results
from cathxr.wire.setup_messages import SetupState
from cathxr.wire.training_messages import TrainingOffer, TrainingState
from cathxr.wire.view_messages import LockMessage

_log = logging.getLogger(__name__)

_EVENTS_LIMIT = 1024
"""Events on their way from the publishing threads to the loop; only a loop that hangs fills this."""


@dataclass(frozen=True)
class _HealthReport:
    sources: tuple[Health, ...]
    t_ns: int
    skew_ns: int | None


class Hub:
    """Takes Tracks, Events, Health, session states and pictures from any thread; publishing never blocks.

    Works before, during and after the server runs: what is published while no server runs is kept as the newest, and
    the first clients get it.
    """

    def __init__(self) -> None:
        self.pictures = Pictures()
        self.results = Results()
        self.people = Clients()
        self._lock = threading.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._woken = False
        self._new_track: Track | None = None
        self._superseded = 0  # Tracks that newer ones replaced before the loop came to them
        self._new_events: deque[str] = deque(maxlen=_EVENTS_LIMIT)
        self._new_health: _HealthReport | None = None
        self._new_session: SessionMessage | None = None
        self._new_states: dict[str, str] = {}
        # Below: the loop's thread only.
        self._outboxes: set[Outbox] = set()
        self._track: Track | None = None
        self._health: _HealthReport | None = None
        self._session = SessionMessage(recording=False, name=None, seconds=0.0)
        self._states: dict[str, str] = {}

    # --- from any thread ----------------------------------------------------------------------------------------------

    def publish_track(self, track: Track) -> None:
        """Make `track` the one that every client gets next."""
        with self._lock:
            self._superseded += self._new_track is not None
            self._new_track = track
            self._wake()

    def publish_event(self, event: Event) -> None:
        """Send an event to every client.

        Raises:
            ValueError: the payload holds something that JSON has no form for.
        """
        text = encode(event_message(event))
        with self._lock:
            self._new_events.append(text)
            self._wake()

    def publish_health(self, sources: Sequence[Health], *, t_ns: int, skew_ns: int | None = None) -> None:
        """Send the state of every source to every client. `skew_ns`: front minus top of the latest pair.

        Raises:
            ValueError: a number is not finite.
        """
        report = _HealthReport(tuple(sources), t_ns, skew_ns)
        _health_for(report, clients=0, skipped=0)  # what cannot be sent is the caller's to know
        with self._lock:
            self._new_health = report
            self._wake()

    def publish_session(self, *, recording: bool, name: str | None = None, seconds: float = 0.0) -> None:
        """Send the state of the recording to every client.

        Raises:
            ValueError: `seconds` is not finite.
        """
        message = SessionMessage(recording=recording, name=name, seconds=round(seconds, 3))
        with self._lock:
            self._new_session = message
            self._wake()

    def publish_roll(self, status: RollStatus, *, predicted: bool) -> None:
        """Send the roll's validity to every client. `predicted`: whether a Track since the last call had one."""
        message = roll_message(status, predicted=predicted)
        self._publish_state(message.type, encode(message))

    def publish_calibration(self, state: CalibrationState) -> None:
        """Send the state of a calibration to every client; a newer one of its type replaces it."""
        self._publish_state(state.type, encode(state))

    def publish_heart_seeds(self, state: HeartSeedsState) -> None:
        """Send the state of the seeds' page to every client; a newer one replaces it."""
        self._publish_state(state.type, encode(state))

    def publish_training(self, state: TrainingState) -> None:
        """Send how training stands to every client; a newer one replaces it."""
        self._publish_state(state.type, encode(state))

    def publish_training_offer(self, offer: TrainingOffer) -> None:
        """Send what can be trained to every client; a newer one replaces it."""
        self._publish_state(offer.type, encode(offer))

    def publish_setup(self, state: SetupState) -> None:
        """Send how the set-up stands to every client; a newer one replaces it."""
        self._publish_state(state.type, encode(state))

    def publish_lock(self, values: Mapping[str, Any], sentence: str) -> None:
        """Hold settings of the scene fast for every client, and for whoever joins; empty values let go of all.

        sentence: why, for the person who would like to change them.

        Raises:
            ConfigError: the values are too many, nest too deep, or are nothing that JSON has a form for.
        """
        try:
            message = LockMessage(values=settings_of(values), sentence=sentence if values else "")
        except ValueError as error:
            raise ConfigError(f"These settings cannot be locked: {error}.") from error
        self._publish_state("lock", encode(message))

    def _publish_state(self, kind: str, text: str) -> None:
        """Send what only the newest of its kind matters of, and keep it for whoever joins."""
        with self._lock:
            self._new_states[kind] = text
            self._wake()

    def publish_picture(self, image: Image, *, seq: int) -> None:
        """Make `image` the newest of its camera. `seq`: the index of its pair, the same as its Track's."""
        self.pictures.publish(image, seq=seq)

    def publish_result(self, name: str, png: bytes) -> str:
        """Keep a picture of a result, and return its path on the server.

        Raises:
            ValueError: a name that is not lower-case letters, digits, - and _.
        """
        return self.results.put(name, png)

    def _wake(self) -> None:
        """Have the loop deliver, unless it is about to. Under the lock."""
        if self._loop is not None and not self._woken:
            self._woken = True
            self._loop.call_soon_threadsafe(self._deliver)

    # --- from the loop's thread ---------------------------------------------------------------------------------------

    def bind(self, loop: asyncio.AbstractEventLoop) -> None:
        """Deliver in `loop` from now on."""
        self.pictures.bind(loop)
        self.people.bind(loop)
        with self._lock:
            self._loop = loop
            self._wake()

    def unbind(self) -> None:
        """Deliver no more. Publishing goes on, and is kept as the newest."""
        with self._lock:
            self._loop = None
            self._woken = False
        self.pictures.unbind()
        self.people.clear()
        self._outboxes.clear()

    @property
    def clients(self) -> int:
        """How many clients are connected."""
        return len(self._outboxes)

    @property
    def session(self) -> SessionMessage:
        """The last state of the recording."""
        return self._session

    def join(self, outbox: Outbox) -> None:
        """Fill a new client's outbox from now on, beginning with the present state."""
        outbox.put(encode(self._session))
        if self._track is not None and (text := _encoded_track(self._track)) is not None:
            outbox.put(text)
        for kind, state in self._states.items():
            outbox.replace(kind, state)
        self._outboxes.add(outbox)
        if self._health is not None:
            outbox.put(encode(self.health(skipped=0)))

    def leave(self, outbox: Outbox) -> None:
        """Fill that outbox no more."""
        self._outboxes.discard(outbox)

    def health(self, *, skipped: int) -> HealthMessage:
        """Return the last health for a client that skipped so many messages. Before the first: no sources, t = 0."""
        report = self._health or _HealthReport((), 0, None)
        return _health_for(report, clients=len(self._outboxes), skipped=skipped)

    def _deliver(self) -> None:
        with self._lock:
            self._woken = False
            track, self._new_track = self._new_track, None
            superseded, self._superseded = self._superseded, 0
            health, self._new_health = self._new_health, None
            session, self._new_session = self._new_session, None
            states, self._new_states = self._new_states, {}
            events = list(self._new_events)
            self._new_events.clear()
        if track is not None:
            self._track = track
            # Encoded here, once for all clients, so that the publishing thread does not wait for it.
            text = _encoded_track(track) if self._outboxes else None
            if text is not None:
                for outbox in self._outboxes:
                    outbox.skipped += superseded
                    outbox.offer_track(track.seq, text)
        for event in events:
            for outbox in self._outboxes:
                outbox.put(event)
        if session is not None:
            self._session = session
            text = encode(session)
            for outbox in self._outboxes:
                outbox.replace("session", text)
        self._states |= states
        for kind, text in states.items():
            for outbox in self._outboxes:
                outbox.replace(kind, text)
        if health is not None:
            self._health = health
            for outbox in self._outboxes:
                outbox.replace("health", encode(self.health(skipped=outbox.skipped)))


def _encoded_track(track: Track) -> str | None:
    try:
        return encode(track_message(track))
    except ValueError:
        _log.exception("Track %d cannot be sent", track.seq)
        return None


def _health_for(report: _HealthReport, *, clients: int, skipped: int) -> HealthMessage:
    return health_message(report.sources, t_ns=report.t_ns, skew_ns=report.skew_ns, clients=clients, skipped=skipped)
