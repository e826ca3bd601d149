"""Deflated DICOM, with a limit on how far it may swell."""

import zlib
from pathlib import Path

MAX_BYTES = 2 << 30
"""More than the largest multi-frame CT; a file that inflates to more is a bomb."""

_SYNTAX = b"1.2.840.10008.1.2.1.99"
_META = 144
_STEP = 1 << 24


def check_swelling(path: Path, *, max_bytes: int = MAX_BYTES) -> None:
    """Refuse a deflated file that swells beyond `max_bytes`; every other file passes.

    Raises:
        ValueError: it does, or its file meta information has no length.
        zlib.error: it is damaged.
    """
    with path.open("rb") as file:
        start = file.read(4096)
        if _SYNTAX not in start:
            return
        if start[132:136] != b"\x02\x00\x00\x00":
            raise ValueError("no group length")
        file.seek(_META + int.from_bytes(start[140:144], "little"))
        inflater, total = zlib.decompressobj(-zlib.MAX_WBITS), 0
        while (piece := inflater.unconsumed_tail or file.read(1 << 20)) and not inflater.eof:
            total += len(inflater.decompress(piece, _STEP))
            if total > max_bytes:
                raise ValueError("swells beyond the limit")
