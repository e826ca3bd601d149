"""Starts and stops recordings while the system is live."""

import re
import threading
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cathxr.core import Clock, ConfigError, Event, Rig
from cathxr.runtime.commands import only
from cathxr.runtime.moment import RecordingState
from cathxr.runtime.recorder import Recorder, RecorderReport, Writer
from cathxr.storage.session import SessionWriter

OpenSession = Callable[[str], Writer]
"""Opens a new session of that folder name; raises a CathxrError where it cannot."""

_NAME = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9 _.-]{0,78}[A-Za-z0-9_-])?")
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
_STOP_S = 1.5


def session_opener(
    folder: Path,
    *,
    rig: Rig,
    config: Mapping[str, Any],
    clock: Clock,
    videos: bool,
    registration: Mapping[str, Any] | None = None,
) -> OpenSession:
    """Return what opens sessions inside `folder`, each with a copy of the rig, the configuration, the registration."""

    def open_session(name: str) -> Writer:
        clock_pair = (clock.now_ns(), datetime.now(UTC).isoformat())
        return SessionWriter(
            folder / name, rig=rig, config=config, clock_pair=clock_pair, videos=videos, registration=registration
        )

    return open_session


class Recordings:
    """At most one recording at a time. Any thread may call.

    open_session: None where this system cannot record, with `refusal` saying why.
    announce: told what happened, as an Event.
    """

    def __init__(
        self,
        open_session: OpenSession | None,
        *,
        clock: Clock,
        request_reset: Callable[[], None],
        announce: Callable[[Event], None],
        refusal: str = "This system records nothing: it was started without a folder for recordings.",
        videos: bool = False,
    ) -> None:
        self._open_session, self._refusal, self._videos = open_session, refusal, videos
        self._clock, self._request_reset, self._announce = clock, request_reset, announce
        self._lock = threading.RLock()
        self._recorder: Recorder | None = None
        self._name: str | None = None
        self._started_ns = 0
        self._last: Recorder | None = None

    @property
    def recorder(self) -> Recorder | None:
        """The recorder that runs, None when none does."""
        return self._recorder

    def state(self) -> RecordingState:
        """Return whether a recording runs, which, and for how long."""
        with self._lock:
            if self._recorder is None:
                return RecordingState(False)
            return RecordingState(True, self._name, (self._clock.now_ns() - self._started_ns) / 1e9)

    def start(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """Begin a recording: {name?}; without a name it is called by date and time. Returns its name.

        Raises:
            ConfigError: a recording runs already, nothing can be recorded here, or the name is not one.
            CathxrError: the session cannot be opened.
        """
        only("record_start", args, ("name",))
        if self._open_session is None:
            raise ConfigError(self._refusal)
        name = _checked_name(args.get("name"))
        self.begin(name)
        return {"name": name}

    def begin(self, name: str) -> None:
        """Begin a recording in a folder of that name.

        Raises:
            CathxrError: as `start`; a name is taken as it is.
        """
        open_session = self._open_session
        if open_session is None:
            raise ConfigError(self._refusal)
        with self._lock:
            if self._recorder is not None:
                raise ConfigError(f"The recording {self._name} runs already: stop it first.")
            recorder = Recorder(
                lambda: open_session(name),
                clock=self._clock,
                request_reset=self._request_reset,
                failed=self._failed,
                videos=self._videos,
            )
            recorder.start()
            self._recorder, self._name, self._started_ns = recorder, name, self._clock.now_ns()
            self._request_reset()  # only now: whoever is told of the reset finds the recorder
        self._announce(Event(self._clock.now_ns(), "recording_started", {"name": name}))

    def stop(self, args: Mapping[str, Any]) -> Mapping[str, Any]:
        """End the recording; returns its name, length, pairs and losses, and whether all is written already.

        A slow disk or lossless video may take longer than the second and a half that this waits: see `wait`.

        Raises:
            ConfigError: no recording runs.
        """
        only("record_stop", args, ())
        with self._lock:
            state, recorder = self.state(), self._recorder
            if recorder is None:
                raise ConfigError("No recording runs: there is nothing to stop.")
            self._recorder, self._name, self._last = None, None, recorder
        summary = {**_summary(state, recorder.stop(_STOP_S)), "written": recorder.wait(0.0)}
        self._announce(Event(self._clock.now_ns(), "recording_stopped", summary))
        return summary

    def wait(self, timeout_s: float) -> bool:
        """Wait until the recording that was stopped last is on the disk; return whether it is."""
        last = self._last
        return last is None or last.wait(timeout_s)

    def close(self) -> None:
        """End the recording if one runs."""
        if self._recorder is not None:
            try:
                self.stop({})
            except ConfigError:
                return  # it ended by itself in between

    def _failed(self, text: str) -> None:
        """Forget a recording that broke, and say so; runs in its thread."""
        with self._lock:
            state, recorder = self.state(), self._recorder
            self._recorder, self._name = None, None
        payload = {"sentence": text} if recorder is None else {"sentence": text, **_summary(state, recorder.report())}
        self._announce(Event(self._clock.now_ns(), "recording_failed", payload))


def _summary(state: RecordingState, report: RecorderReport) -> dict[str, Any]:
    return {
        "name": state.name,
        "seconds": round(state.seconds, 3),
        "pairs": report.pairs,
        "lost_pairs": report.lost_pairs,
        "lost_items": report.lost_items,
        "lost_pictures": report.lost_pictures,
        **({} if report.error is None else {"error": report.error}),
    }


def _checked_name(name: Any) -> str:
    """Return a name for a folder that every system takes."""
    if name is None:
        return datetime.now(UTC).astimezone().strftime("%Y-%m-%d_%H-%M-%S")
    if not isinstance(name, str) or not _NAME.fullmatch(name) or _RESERVED.fullmatch(name):
        raise ConfigError(
            f"{str(name)[:90]!r} cannot name a recording: use up to 80 letters, digits, spaces, dots, '_' and '-'."
        )
    return name
