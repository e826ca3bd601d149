"""Reads a session folder: what was recorded, in the order of its instants, whole or cut off by a crash."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from cathxr.core import DataError, Event, Health, Image, Observation, Reading, Rig, Track
from cathxr.storage.mcap_log import McapLog
from cathxr.storage.rig_file import rig_from_table
from cathxr.storage.session_json import Item, Picture, decoded
from cathxr.storage.session_schemas import TOPICS
from cathxr.storage.session_writer import DESCRIPTION, LOG, SCHEMA
from cathxr.storage.toml_table import Table, parsed, read_text

_Kind = TypeVar("_Kind", Reading, Observation, Track, Event, Health, Picture)


@dataclass(frozen=True)
class SessionItem:
    """One recorded value and its topic: the topic tells a /track from a /truth."""

    topic: str
    value: Item


class SessionReader:
    """A recorded session.

    rig, config, versions, registration (None without one), clock_pair (monotonic ns, UTC), videos: what session.toml
    says. is_whole: False when the recording process was killed, whose last moment is then missing.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Read session.toml and look into session.mcap.

        Raises:
            DataError: no session there, or damaged; ConfigError: session.toml does not say what it must.
        """
        self.folder = Path(folder)
        if not (self.folder / DESCRIPTION).is_file() or not (self.folder / LOG).is_file():
            raise DataError(
                f"{self.folder}: expected a session folder ({DESCRIPTION} and {LOG}), got none; check the path."
            )
        path = self.folder / DESCRIPTION
        root = Table(parsed(read_text(path, what="a session's description"), name=str(path)), file=str(path))
        if root.asked("schema", example=f'schema = "{SCHEMA}"') != SCHEMA:
            raise root.error("schema", f'expected "{SCHEMA}", got another; read it with the version that recorded it.')
        root.know("registration")
        self.videos = bool(root.asked("videos", example="videos = false"))
        self.versions: Mapping[str, Any] = root.table("versions").values
        self.config: Mapping[str, Any] = root.table("config").values
        self.registration: Mapping[str, Any] | None = (
            root.table("registration").values if "registration" in root else None
        )
        clock = root.table("clock")
        monotonic_ns = clock.integer("monotonic_ns", example="monotonic_ns = 0", minimum=0, maximum=2**63 - 1)
        self.clock_pair = (monotonic_ns, clock.text("utc", example='utc = "2025-05-08T10:00:00Z"'))
        self.rig: Rig = rig_from_table(root.table("rig"))
        root.finish()
        self._log = McapLog(self.folder / LOG)
        self.is_whole = self._log.is_whole

    def items(self, *topics: str) -> Iterator[SessionItem]:
        """Yield what was recorded on `topics` (all without any), by instant and then as written.

        Raises:
            DataError: damaged; ValueError: no such topic.
        """
        unknown = [each for each in topics if each not in TOPICS]
        if unknown:
            raise ValueError(f"topics: expected some of {', '.join(TOPICS)}, got {unknown[0]!r}")
        for topic, t_ns, data in self._log.messages(topics or TOPICS):
            try:
                value = decoded(topic, data)
            except (ValueError, KeyError, TypeError) as error:
                raise DataError(
                    f"{self.folder}: cannot understand what was recorded on {topic} at {t_ns} ns ({error}); "
                    "it was made by another version or is damaged."
                ) from error
            yield SessionItem(topic, value)

    def __iter__(self) -> Iterator[SessionItem]:
        return self.items()

    def readings(self) -> Iterator[Reading]:
        """Yield the encoder's reports."""
        return self._values("/reading", Reading)

    def observations(self) -> Iterator[Observation]:
        """Yield the Observations: what the tracker was given."""
        return self._values("/observation", Observation)

    def tracks(self) -> Iterator[Track]:
        """Yield the Tracks as they were made."""
        return self._values("/track", Track)

    def truths(self) -> Iterator[Track]:
        """Yield the digital twin's exact Tracks; none in a session of real cameras."""
        return self._values("/truth", Track)

    def events(self) -> Iterator[Event]:
        """Yield the Events."""
        return self._values("/event", Event)

    def health(self) -> Iterator[Health]:
        """Yield the sources' states."""
        return self._values("/health", Health)

    def pictures(self) -> Iterator[Picture]:
        """Yield where each recorded picture is."""
        return self._values("/picture", Picture)

    def images(self, camera: str) -> Iterator[Image]:
        """Yield a camera's recorded pictures with the seq and instant of each; none where none were recorded.

        After a crash the video and its index may differ by the last moment: what both have is given.

        Raises:
            DataError: the video is damaged.
        """
        path = self.folder / f"{camera}.mkv"
        if not path.is_file():
            return
        from cathxr.storage.video import Video  # here: FFmpeg takes a while to load

        by_frame = {each.frame: each for each in self.pictures() if each.camera == camera}
        try:
            for frame, pixels in enumerate(Video(path, is_steady=True)):
                place = by_frame.get(frame)
                if place is not None:
                    yield Image(camera, place.seq, place.t_ns, pixels)
        except DataError:
            if self.is_whole:
                raise

    def _values(self, topic: str, kind: type[_Kind]) -> Iterator[_Kind]:
        for item in self.items(topic):
            assert isinstance(item.value, kind)
            yield item.value
