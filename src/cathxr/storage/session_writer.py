"""Writes a session folder: session.toml, session.mcap, and the cameras' lossless videos where asked for."""

import os
import platform
import time
from collections.abc import Mapping
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import tomli_w
from mcap.writer import CompressionType, Writer

from cathxr import __version__
from cathxr.core import DataError, Event, Health, Image, Observation, Reading, Rig, Track
from cathxr.storage import session_json as to
from cathxr.storage.atomic import os_reason, written_whole
from cathxr.storage.rig_file import rig_to_text
from cathxr.storage.session_schemas import SCHEMAS
from cathxr.storage.toml_table import parsed

if TYPE_CHECKING:
    from cathxr.storage.video import LosslessVideo

SCHEMA = "cathxr-session/1"
DESCRIPTION, LOG = "session.toml", "session.mcap"

_FLUSH_S = 0.25
"""How often what was written is handed to the operating system: a killed process loses less than a second."""
_CHUNK_BYTES = 512 * 1024
_PACKAGES = ("av", "mcap", "numba", "numpy", "opencv-contrib-python-headless", "scipy")


class SessionWriter:
    """Appends to one new session. For one thread only, the recording thread; every method may wait for the disk."""

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        rig: Rig,
        config: Mapping[str, Any],
        clock_pair: tuple[int, str],
        videos: bool,
        registration: Mapping[str, Any] | None = None,
    ) -> None:
        """Make the session. clock_pair: one instant as monotonic nanoseconds and as UTC in ISO 8601.

        config: what a person chose (texts, numbers, truth values, lists, tables; None is left out). videos: whether
        `write_image` keeps pictures. registration: a copy of registration.toml's content.

        Raises:
            DataError: there is a session already, or the disk refuses.
        """
        self.folder = Path(folder)
        self._rig, self._videos = rig, videos
        self._cameras: dict[str, LosslessVideo] = {}
        self._refused: DataError | None = None
        self._closed = False
        description = _description(rig, config, clock_pair, videos=videos, registration=registration)
        try:
            if self.folder.exists() and any(self.folder.iterdir()):
                raise DataError(
                    f"{self.folder}: expected a new or empty folder for the session, got one with files in it; "
                    "choose another name."
                )
            self.folder.mkdir(parents=True, exist_ok=True)
            with written_whole(self.folder / DESCRIPTION) as part:
                part.write_bytes(description)
            self._stream: BinaryIO = (self.folder / LOG).open("xb")
            self._log = Writer(self._stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
            self._log.start(profile="", library=f"cathxr {__version__}")
            self._channels = {topic: self._channel(topic) for topic in SCHEMAS}
            self._stream.flush()
        except OSError as error:
            raise self._refusal(error) from error
        self._flushed_s = time.monotonic()

    def write_reading(self, reading: Reading) -> None:
        """Append an encoder report. Raises DataError when the disk refuses, like all of these."""
        self._write("/reading", to.reading_json(reading))

    def write_observation(self, observation: Observation) -> None:
        """Append an Observation."""
        self._write("/observation", to.observation_json(observation))

    def write_track(self, track: Track) -> None:
        """Append a Track."""
        self._write("/track", to.track_json(track))

    def write_truth(self, truth: Track) -> None:
        """Append the digital twin's exact Track."""
        self._write("/truth", to.track_json(truth))

    def write_event(self, event: Event) -> None:
        """Append an Event."""
        self._write("/event", to.event_json(event))

    def write_health(self, health: Health) -> None:
        """Append a Health."""
        self._write("/health", to.health_json(health))

    def write_image(self, image: Image) -> None:
        """Append a picture to its camera's video and note where it is; without `videos` do nothing."""
        if not self._videos:
            return
        self._check_usable()
        try:
            video = self._cameras.get(image.camera) or self._begin_video(image)
            frame = video.write(image.pixels)
        except DataError as error:
            self._refused = error
            raise
        self._write("/picture", to.picture_json(to.Picture(image.camera, image.seq, image.t_ns, frame)))

    def flush_if_due(self) -> None:
        """Hand what was written to the operating system when a quarter of a second has passed. Call it when idle."""
        if not self._closed and self._refused is None and time.monotonic() - self._flushed_s >= _FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system: it survives the end of this process.

        Raises:
            DataError: the disk refuses.
        """
        self._check_usable()
        try:
            self._log.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise self._refusal(error) from error
        self._flushed_s = time.monotonic()

    def close(self) -> None:
        """Finish every file. Calling it again does nothing.

        Raises:
            DataError: the disk refuses; what was written before stays readable.
        """
        if self._closed:
            return
        self._closed = True
        problem = self._refused
        for video in self._cameras.values():
            try:
                video.close()
            except DataError as error:
                problem = problem or error
        try:
            if self._refused is None:
                self._log.finish()  # type: ignore[no-untyped-call]
                self._stream.flush()
                os.fsync(self._stream.fileno())
        except OSError as error:
            problem = problem or self._refusal(error)
        finally:
            with suppress(OSError):
                self._stream.close()
        if problem is not None and problem is not self._refused:
            raise problem

    def _write(self, topic: str, values: dict[str, Any]) -> None:
        self._check_usable()
        t_ns = values["t_ns"]
        if t_ns < 0:
            raise ValueError(f"t_ns: expected an instant of at least 0, got {t_ns}")
        data = to.encoded(values)
        try:
            self._log.add_message(self._channels[topic], t_ns, data, t_ns, values.get("seq", 0) & 0xFFFFFFFF)
        except OSError as error:
            raise self._refusal(error) from error
        self.flush_if_due()

    def _channel(self, topic: str) -> int:
        title = SCHEMAS[topic]["title"]
        schema = self._log.register_schema(f"cathxr.{title}", "jsonschema", to.encoded(SCHEMAS[topic]))
        return self._log.register_channel(topic, "json", schema)

    def _begin_video(self, image: Image) -> "LosslessVideo":
        # Imported here: FFmpeg takes a while to load, and most sessions have no video.
        from cathxr.storage.video import LosslessVideo

        camera = self._rig.cameras.get(image.camera)
        if camera is None:
            raise DataError(f"{self.folder}: expected pictures of the rig's cameras, got one of {image.camera!r}.")
        path = self.folder / f"{image.camera}.mkv"
        grey = image.pixels.ndim == 2
        video = LosslessVideo(path, size_px=image.size_px, is_grey=grey, rate_hz=camera.rate_hz)
        self._cameras[image.camera] = video
        return video

    def _check_usable(self) -> None:
        if self._closed:
            raise ValueError("SessionWriter: expected an open session, got a closed one")
        if self._refused is not None:
            raise self._refused

    def _refusal(self, error: OSError) -> DataError:
        self._refused = DataError(
            f"{self.folder}: cannot write the session ({os_reason(error)}); check the folder and the space on the disk."
        )
        return self._refused


def _description(
    rig: Rig,
    config: Mapping[str, Any],
    clock_pair: tuple[int, str],
    *,
    videos: bool,
    registration: Mapping[str, Any] | None,
) -> bytes:
    """Return the content of session.toml."""
    packages = {}
    for name in _PACKAGES:
        with suppress(metadata.PackageNotFoundError):
            packages[name] = metadata.version(name)
    values: dict[str, Any] = {
        "schema": SCHEMA,
        "videos": videos,
        "versions": {
            "cathxr": __version__,
            "python": platform.python_version(),
            "system": f"{platform.system()} {platform.machine()}",
            "packages": packages,
        },
        "clock": {"monotonic_ns": int(clock_pair[0]), "utc": clock_pair[1]},
        "config": _plain(config),
        "rig": parsed(rig_to_text(rig), name="rig"),
    }
    if registration is not None:
        values["registration"] = _plain(registration)
    return tomli_w.dumps(values).encode("utf-8")


def _plain(value: Any) -> Any:
    """Return a value as TOML holds it: None left out of tables, paths and other things as text."""
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items() if each is not None}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value if each is not None]
    return value if isinstance(value, bool | int | float | str) else str(value)
