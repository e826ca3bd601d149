"""Decodes frames to Hounsfield units. A codec is given the pixels alone, never the header they came with."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pydicom
import SimpleITK as sitk
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.encaps import encapsulate, generate_frames
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    SecondaryCaptureImageStorage,
)

from cathxr.core import DataError
from cathxr.heart.reading.elements import UNREADABLE
from cathxr.heart.reading.frames import NATIVE_IN_PLACE, Frame, Layout

FILL_HU = -1024
"""What a voxel without a picture takes: air."""

NATIVE = (*NATIVE_IN_PLACE, DeflatedExplicitVRLittleEndian)
ENCAPSULATED = frozenset(
    f"1.2.840.10008.1.2.{each}" for each in ("5", "4.50", "4.51", "4.57", "4.70", "4.80", "4.81", "4.90", "4.91")
)
"""RLE, JPEG (baseline, extended, lossless), JPEG-LS, JPEG 2000: what the codec knows."""

Stored = npt.NDArray[Any]


class PixelSource:
    """Reads frames one after another; holds the compressed frames of the file that it read last."""

    def __init__(self) -> None:
        self._path: Path | None = None
        self._pieces: list[bytes] = []

    def hu(self, frame: Frame) -> npt.NDArray[np.int16]:
        """Return a frame (rows, columns) in HU, padding as `FILL_HU`.

        Raises:
            DataError: the frame's pixels are missing, cut off, or in a form that cannot be decoded.
        """
        layout = frame.layout
        stored = self._stored(frame)
        is_padding = None
        if layout.padding is not None:
            is_padding = (stored >= layout.padding[0]) & (stored <= layout.padding[1])
        values = _without_overlays(stored, layout)
        if frame.slope == 1.0 and frame.intercept == int(frame.intercept):
            # The sum of a 16-bit value and any sane intercept fits 32 bits.
            hu = values.astype(np.int32) + np.int32(np.clip(frame.intercept, -1e6, 1e6))
        else:
            hu = np.rint(values * frame.slope + frame.intercept)
        if is_padding is not None:
            hu[is_padding] = FILL_HU
        return np.asarray(np.clip(hu, -32768, 32767).astype(np.int16))

    def _stored(self, frame: Frame) -> Stored:
        """Return the stored values (rows, columns), as integers of the file's own width."""
        layout = frame.layout
        if layout.samples != 1 or layout.bits_allocated not in (8, 16, 32):
            raise DataError(f"{_which(frame)} is not a grey picture of 8, 16 or 32 bits; choose another series.")
        try:
            if layout.syntax in NATIVE:
                return _native(frame)
            if layout.syntax in ENCAPSULATED:
                return decode_piece(self._piece(frame), layout)
        except (*UNREADABLE, OSError, RuntimeError):
            raise DataError(
                f"The pixels of {_which(frame)} are damaged or cut off; copy the series again from where it came from."
            ) from None
        raise DataError(
            f"{_which(frame)} is compressed in a form that is not supported ({syntax_name(layout)}); export the series "
            "again without compression (Explicit VR Little Endian)."
        )

    def _piece(self, frame: Frame) -> bytes:
        if self._path != frame.path:
            dataset = pydicom.dcmread(frame.path, force=True, specific_tags=["PixelData", "NumberOfFrames"])
            count = int(dataset.get("NumberOfFrames") or 1)
            self._pieces = list(generate_frames(dataset.PixelData, number_of_frames=count))
            self._path = frame.path
        return self._pieces[frame.index]


def syntax_name(layout: Layout) -> str:
    """Return the standard's name of a transfer syntax, "unknown" for one that the standard does not have."""
    return layout.syntax.name if layout.syntax.is_transfer_syntax and not layout.syntax.is_private else "unknown"


def is_decodable(layout: Layout) -> bool:
    """Return whether the transfer syntax is one that can be read."""
    return layout.syntax in NATIVE or layout.syntax in ENCAPSULATED


def _which(frame: Frame) -> str:
    return f"file {frame.number} in name order"


def _native(frame: Frame) -> Stored:
    """Return an uncompressed frame, read from its place in the file."""
    layout = frame.layout
    kind = np.dtype(f"{'i' if layout.is_signed else 'u'}{layout.bits_allocated // 8}")
    kind = kind.newbyteorder(">" if layout.syntax == ExplicitVRBigEndian else "<")
    start = frame.index * layout.frame_bytes
    if layout.syntax == DeflatedExplicitVRLittleEndian:
        data = pydicom.dcmread(frame.path, force=True, specific_tags=["PixelData"]).PixelData[
            start : start + layout.frame_bytes
        ]
    else:
        with frame.path.open("rb") as file:
            file.seek(frame.start + start)
            data = file.read(layout.frame_bytes)
    values = np.frombuffer(data, kind).reshape(layout.rows, layout.columns)
    return values.astype(kind.newbyteorder("="))


def decode_piece(piece: bytes, layout: Layout) -> Stored:
    """Return a compressed frame (rows, columns), decoded by ITK from a file that holds nothing but the pixels."""
    data = Dataset()
    data.file_meta = FileMetaDataset()
    data.file_meta.TransferSyntaxUID = layout.syntax
    data.SOPClassUID = data.file_meta.MediaStorageSOPClassUID = SecondaryCaptureImageStorage
    data.SOPInstanceUID = data.file_meta.MediaStorageSOPInstanceUID = "2.25.1"
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.Rows, data.Columns = layout.rows, layout.columns
    data.BitsAllocated, data.BitsStored, data.HighBit = layout.bits_allocated, layout.bits_stored, layout.high_bit
    data.PixelRepresentation = int(layout.is_signed)
    data.add_new(0x7FE00010, "OB", encapsulate([piece]))
    data["PixelData"].is_undefined_length = True
    with tempfile.TemporaryDirectory(prefix="cathxr-") as folder:
        path = Path(folder) / "frame.dcm"
        pydicom.dcmwrite(path, data, enforce_file_format=True)
        image = sitk.ReadImage(str(path), imageIO="GDCMImageIO")
    values = np.asarray(sitk.GetArrayFromImage(image)).reshape(layout.rows, layout.columns)
    return values


def _without_overlays(stored: Stored, layout: Layout) -> Stored:
    """Return the values without what old scanners keep in the bits above them; sign and all."""
    if layout.bits_stored == layout.bits_allocated:
        return stored
    low = -(1 << (layout.bits_stored - 1)) if layout.is_signed else 0
    high = low + (1 << layout.bits_stored) - 1
    if layout.high_bit == layout.bits_stored - 1 and stored.min() >= low and stored.max() <= high:
        return stored
    if layout.is_signed and layout.high_bit == layout.bits_stored - 1:
        return stored  # values beyond the bits that are said to be used, as a scanner's own padding is: not overlays
    shifted = stored.astype(np.int64) >> (layout.high_bit + 1 - layout.bits_stored)
    return np.asarray((shifted - low) % (1 << layout.bits_stored) + low)
