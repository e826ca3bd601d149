"""Reads the labels.nii.gz of a heart folder, which `cathxr heart build` has written, with nothing but NumPy."""

import gzip
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from cathxr.core import DataError, FloatArray
from cathxr.heart.volume import Grid, LabelVolume

_HEADER_BYTES = 348
_TYPES: Mapping[int, str] = MappingProxyType({2: "<u1", 256: "<i1", 4: "<i2", 512: "<u2"})
"""NIfTI's codes of the types that labels come in."""
_MOST_VOXELS = 1024**3
_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def read_labels(path: Path, names: Mapping[int, str]) -> LabelVolume:
    """Return the label volume of a heart folder. names: each structure's key by its label.

    Values without a name become 0, as nothing is known of them.

    Raises:
        DataError: the file is missing, damaged, or not of the kind that this program writes.
    """
    try:
        with gzip.open(path) as stream:
            header = stream.read(_HEADER_BYTES)
            shape, kind, offset, ct_from_voxel = _understood(header, path)
            stream.seek(offset)
            expected = int(np.prod(shape)) * kind.itemsize
            data = stream.read(expected)
    except OSError as error:
        reason = error.strerror or "it is not gzip"
        raise DataError(f"{path} cannot be read ({reason}); build the heart again.") from error
    except (EOFError, zlib.error) as error:
        raise DataError(f"{path} is damaged or cut short; build the heart again.") from error
    if len(data) != expected:
        raise DataError(f"{path} ends before its last voxel; build the heart again.")
    stored = np.frombuffer(data, dtype=kind).reshape(shape)
    try:
        return LabelVolume(
            _named(stored, names), Grid(shape, ct_from_voxel), {k: v for k, v in names.items() if k < 256}
        )
    except ValueError as error:
        raise DataError(f"{path} has axes that no grid has ({error}); build the heart again.") from error


def _understood(header: bytes, path: Path) -> tuple[tuple[int, int, int], np.dtype[np.generic], int, FloatArray]:
    """Return shape (K, J, I), type, offset of the voxels, and ct_from_voxel (4, 4)."""
    ours = "this program reads only the labels that it has written itself; build the heart again."
    if len(header) < _HEADER_BYTES or header[:4] != struct.pack("<i", _HEADER_BYTES) or header[344:348] != b"n+1\0":
        raise DataError(f"{path} is no NIfTI-1 file in one piece: {ours}")
    dimensions = struct.unpack_from("<8h", header, 40)
    (code,) = struct.unpack_from("<h", header, 70)
    offset, slope, intercept = struct.unpack_from("<3f", header, 108)
    (affine_code,) = struct.unpack_from("<h", header, 254)
    sizes = dimensions[1:4]
    if dimensions[0] < 3 or any(each != 1 for each in dimensions[4 : dimensions[0] + 1]) or min(sizes) < 1:
        raise DataError(f"{path} holds {dimensions[0]} dimensions, not three: {ours}")
    if code not in _TYPES or slope not in (0.0, 1.0) or intercept != 0.0 or affine_code < 1:
        raise DataError(f"{path} holds other values than labels, or does not say where they are: {ours}")
    if not _HEADER_BYTES <= offset <= 2**20 or int(np.prod(sizes, dtype=np.int64)) > _MOST_VOXELS:
        raise DataError(f"{path} is larger than any label volume: {ours}")
    matrix = np.eye(4)
    matrix[:3] = np.array(struct.unpack_from("<12f", header, 280), float).reshape(3, 4)
    i, j, k = sizes
    return (k, j, i), np.dtype(_TYPES[code]), int(offset), _LPS_FROM_RAS @ matrix


def _named(stored: npt.NDArray[np.generic], names: Mapping[int, str]) -> npt.NDArray[np.uint8]:
    """Return the values as uint8; what has no name is 0."""
    known = np.zeros(65536, dtype=np.uint8)
    for label in names:
        if 0 < label < 256:
            known[label] = label
    return known[stored.astype(np.uint16)]
