"""Encodes the pixels of a written slice: every transfer syntax that CT archives commonly hold."""

import tempfile
from pathlib import Path

import av
import numpy as np
import pydicom
import SimpleITK as sitk
from pydicom.dataset import Dataset
from pydicom.encaps import encapsulate
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
)

SYNTAXES = {
    "implicit": ImplicitVRLittleEndian,
    "explicit": ExplicitVRLittleEndian,
    "big_endian": ExplicitVRBigEndian,
    "deflated": DeflatedExplicitVRLittleEndian,
    "rle": RLELossless,
    "jpeg_lossless": JPEGLosslessSV1,
    "jpeg_ls": JPEGLSLossless,
    "jpeg_2000": JPEG2000Lossless,
}
"""Transfer syntaxes by the names that `write_series` takes."""


def encode(data: Dataset, syntax: str) -> None:
    """Replace the native little-endian pixels of a one-frame or many-frame data set by those of `syntax`."""
    if syntax == "big_endian":
        data.PixelData = np.frombuffer(data.PixelData, "<u2").astype(">u2").tobytes()
    if syntax not in ("rle", "jpeg_lossless", "jpeg_ls", "jpeg_2000"):
        return
    frames = np.frombuffer(data.PixelData, "<i2" if data.PixelRepresentation else "<u2")
    frames = frames.reshape(-1, data.Rows, data.Columns)
    if syntax == "rle":
        data.compress(RLELossless, frames.squeeze(), generate_instance_uid=False)
        return
    make = _jpeg_ls if syntax == "jpeg_ls" else (lambda each: _by_itk(each, syntax))
    data.add_new(0x7FE00010, "OB", encapsulate([make(each) for each in frames]))
    data["PixelData"].is_undefined_length = True


def _by_itk(frame: np.ndarray, syntax: str) -> bytes:
    """Return one frame as ITK's DICOM writer compresses it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.dcm"
        writer = sitk.ImageFileWriter()
        writer.SetImageIO("GDCMImageIO")
        writer.SetUseCompression(True)
        writer.SetCompressor({"jpeg_lossless": "JPEG", "jpeg_2000": "JPEG2000"}[syntax])
        writer.SetFileName(str(path))
        writer.Execute(sitk.GetImageFromArray(frame[None]))
        return next(pydicom.encaps.generate_frames(pydicom.dcmread(path).PixelData, number_of_frames=1))


def _jpeg_ls(frame: np.ndarray) -> bytes:
    """Return one frame as JPEG-LS without loss; its bits as they are, signed ones too."""
    encoder = av.CodecContext.create("jpegls", "w")
    encoder.height, encoder.width = frame.shape
    encoder.pix_fmt, encoder.time_base = "gray16le", 1
    picture = av.VideoFrame.from_ndarray(frame.view(np.uint16), format="gray16le")
    packets = [*encoder.encode(picture), *encoder.encode(None)]
    return b"".join(bytes(each) for each in packets)
