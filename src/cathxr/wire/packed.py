"""A file that is served from memory, as gzip: browsers unpack it by themselves."""

import gzip
import hashlib
from dataclasses import dataclass, field
from functools import cached_property

_LEVEL = 6


@dataclass(frozen=True)
class Packed:
    """Bytes as gzip. size: how many they are unpacked."""

    data: bytes
    size: int
    tag: str = field(init=False)
    """The content's entity tag."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "tag", f'"{hashlib.sha256(self.data).hexdigest()[:32]}"')

    @classmethod
    def of(cls, content: bytes) -> "Packed":
        """Return some bytes packed."""
        return cls(gzip.compress(content, compresslevel=_LEVEL, mtime=0), len(content))

    @cached_property
    def unpacked(self) -> bytes:
        """The bytes, for a client that takes no gzip."""
        return gzip.decompress(self.data)
