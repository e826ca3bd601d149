"""Reads and writes the file of an acoustic volume: the texture's bytes, compressed as browsers take them (gzip)."""

import gzip
import zlib
from pathlib import Path

import numpy as np

from cathxr.core import DataError
from cathxr.heart.acoustic_codes import AcousticVolume
from cathxr.heart.model import AcousticFile

ACOUSTIC = "acoustic.bin.gz"
_LEVEL = 6
"""The highest level makes the file 2 % smaller and takes five times as long."""


def write_acoustic(path: Path, volume: AcousticVolume) -> AcousticFile:
    """Write the bytes (K, J, I, 4) to `path`, and return what heart.toml says about them; same volume, same bytes."""
    path.write_bytes(gzip.compress(volume.rgba.tobytes(), compresslevel=_LEVEL, mtime=0))
    shape = volume.rgba.shape
    return AcousticFile(path, (shape[0], shape[1], shape[2]), volume.ct_from_voxel, volume.scales, volume.table)


def read_acoustic(file: AcousticFile) -> AcousticVolume:
    """Return the acoustic volume that a heart folder's heart.toml describes.

    Raises:
        DataError: the file is missing, damaged, or not as long as heart.toml says.
    """
    expected = int(np.prod(file.shape)) * 4
    try:
        with gzip.open(file.file) as stream:
            data = stream.read(expected + 1)  # and no more, whatever the file would unpack to
    except OSError as error:
        reason = error.strerror or "it is not gzip"
        raise DataError(f"{file.file} cannot be read ({reason}); build the heart again.") from error
    except (EOFError, zlib.error) as error:
        raise DataError(f"{file.file} is damaged or cut short; build the heart again.") from error
    if len(data) != expected:
        found = f"{len(data)} bytes" if len(data) < expected else "more bytes"
        raise DataError(f"{file.file} holds {found} where heart.toml says {expected}; build the heart again.")
    rgba = np.frombuffer(data, dtype=np.uint8).reshape(*file.shape, 4)
    return AcousticVolume(rgba, file.ct_from_voxel, file.scales, file.table)
