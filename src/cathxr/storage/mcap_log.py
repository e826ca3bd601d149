"""Reads an MCAP file that may end anywhere: a recording whose process was killed has no index and half a last chunk."""

import heapq
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message
from mcap.stream_reader import breakup_chunk
from zstandard import ZstdError

from cathxr.core import DataError
from cathxr.storage.atomic import os_reason

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
_TIMES = struct.Struct("<QQ")


@dataclass(frozen=True)
class _ChunkPlace:
    start_ns: int
    offset: int
    length: int


class McapLog:
    """The messages of an MCAP file in the order of their log times, from whatever part of the file is whole.

    is_whole: the file was finished. Otherwise its process ended before, and the last moment is missing.
    """

    def __init__(self, path: Path) -> None:
        """Find the file's chunks, without unpacking any.

        Raises:
            DataError: missing, or no MCAP file.
        """
        self._path = path
        try:
            size = path.stat().st_size
            with path.open("rb") as file:
                if file.read(len(_MAGIC)) != _MAGIC:
                    raise DataError(f"{path}: expected an MCAP file, got something else; the session is damaged.")
                self._chunks, self.is_whole = _chunk_places(file, size)
        except OSError as error:
            raise DataError(f"{path}: cannot read the session ({os_reason(error)}); check the path.") from error

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, log time and content of each message on `topics`, by log time and then as written.

        Chunks overlap in time, so a chunk's messages wait until no later chunk can begin before them.

        Raises:
            DataError: a chunk in the middle is damaged.
        """
        names: dict[int, str] = {}
        waiting: list[tuple[int, int, int, str, bytes]] = []
        in_time = sorted(range(len(self._chunks)), key=lambda index: self._chunks[index].start_ns)
        try:
            with self._path.open("rb") as file:
                if self._chunks:
                    self._records(file, 0, names)
                for index in in_time:
                    start_ns = self._chunks[index].start_ns
                    while waiting and waiting[0][0] < start_ns:
                        yield _told(heapq.heappop(waiting))
                    for number, message in enumerate(self._records(file, index, names)):
                        topic = names.get(message.channel_id, "")
                        if topic in topics:
                            heapq.heappush(waiting, (message.log_time, index, number, topic, message.data))
                while waiting:
                    yield _told(heapq.heappop(waiting))
        except OSError as error:
            raise DataError(f"{self._path}: cannot read the session ({os_reason(error)}); check the disk.") from error

    def _records(self, file: BinaryIO, index: int, names: dict[int, str]) -> list[Message]:
        """Return a chunk's messages and note its channels' names."""
        place = self._chunks[index]
        file.seek(place.offset)
        try:
            chunk = Chunk.read(ReadDataStream(BytesIO(file.read(place.length))))
            records: list[McapRecord] = breakup_chunk(chunk, validate_crc=True)
        except (McapError, ZstdError, ValueError, struct.error) as error:
            if index == len(self._chunks) - 1 and not self.is_whole:
                return []  # the end of a recording that was killed
            raise DataError(
                f"{self._path}: the session is damaged in its middle (part {index + 1} of {len(self._chunks)}: "
                f"{error}); copy it again from where it was recorded."
            ) from error
        names.update({each.id: each.topic for each in records if isinstance(each, Channel)})
        return [each for each in records if isinstance(each, Message)]


def _told(entry: tuple[int, int, int, str, bytes]) -> tuple[str, int, bytes]:
    return entry[3], entry[0], entry[4]


def _chunk_places(file: BinaryIO, size: int) -> tuple[list[_ChunkPlace], bool]:
    """Return where each whole chunk's content is, and whether the file has its end."""
    places: list[_ChunkPlace] = []
    at = len(_MAGIC)
    while at + _HEAD.size <= size:
        file.seek(at)
        opcode, length = _HEAD.unpack(file.read(_HEAD.size))
        content = at + _HEAD.size
        if content + length > size:
            break
        if opcode == Opcode.CHUNK and length >= _TIMES.size:
            start_ns, _ = _TIMES.unpack(file.read(_TIMES.size))
            places.append(_ChunkPlace(start_ns, content, length))
        at = content + length
        if opcode == Opcode.FOOTER:
            return places, file.seek(at) == at and file.read(len(_MAGIC)) == _MAGIC
    return places, False
