"""Writes DICOM series for the tests: a `Volume` as the files that a scanner's archive would hold.

What a test asks for is added on top of an ordinary axial CT: shuffled names, tilt, gaps, syntaxes, planted names.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, generate_uid
from scipy import ndimage

from cathxr.heart.volume import Grid, Technical, Volume

from .encoders import SYNTAXES, encode
from .planted import Planted, plant

TILT_FILL_HU = -1000
_EVERYWHERE = 8
"""Every eighth slice has every element there is planted; the others those that images commonly have."""


@dataclass(frozen=True)
class SeriesOptions:
    """How `write_series` departs from an ordinary series.

    shuffle: seed that shuffles names and instance numbers, None keeps the order. tilt_deg: gantry tilt about the rows.
    missing: indices of slices that are not written. moved_mm: by slice index, how far along the normal it is written
    from its place. slope, intercept: one number, or one for each slice. padding: a stored value that pixels outside
    the circle of reconstruction take. syntax: one of `encoders.SYNTAXES`. tags: elements by keyword, for every slice.
    tags_of: elements by slice index. planted: names put in every text-like element, file name and folder name.
    """

    shuffle: int | None = 0
    tilt_deg: float = 0.0
    missing: Sequence[int] = ()
    moved_mm: Mapping[int, float] = field(default_factory=dict)
    slope: float | Sequence[float] = 1.0
    intercept: float | Sequence[float] = -1024.0
    padding: int | None = None
    syntax: str = "explicit"
    modality: str = "CT"
    series: str = "a"
    study: str = "study"
    image_type: Sequence[str] = ("ORIGINAL", "PRIMARY", "AXIAL")
    description: str = ""
    tags: Mapping[str, Any] = field(default_factory=dict)
    tags_of: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    planted: Planted | None = None


def volume_of(hu: np.ndarray, *, spacing: Sequence[float] = (0.7, 0.7, 1.0), rotation: np.ndarray | None = None,
              origin: Sequence[float] = (-40.0, -55.0, -120.0)) -> Volume:  # fmt: skip
    """Return a volume of `hu` (K, J, I), spacing along i, j, k, axes in the columns of `rotation`."""
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if rotation is None else rotation) * np.asarray(spacing)
    matrix[:3, 3] = origin
    return Volume(np.ascontiguousarray(hu, np.int16), Grid(hu.shape, matrix), Technical("CT"))


def write_series(folder: Path, volume: Volume, options: SeriesOptions | None = None, **changes: Any) -> list[Path]:
    """Write `volume` as single-frame DICOM files into `folder`; return their paths in the order of the slices.

    options, changes: see `SeriesOptions`; `write_series(folder, volume, tilt_deg=12, missing=[3])`.
    """
    chosen = SeriesOptions(**{**(vars(options) if options else {}), **changes})
    if chosen.planted is not None:
        folder = folder / chosen.planted.folder
    folder.mkdir(parents=True, exist_ok=True)
    kept = [k for k in range(volume.grid.shape[0]) if k not in chosen.missing]
    in_order = chosen.shuffle is None
    order = np.arange(len(kept)) if in_order else np.random.default_rng(chosen.shuffle).permutation(len(kept))
    paths = []
    for number, k in zip(order, kept, strict=True):
        data = slice_dataset(volume, k, chosen, number=int(number) + 1)
        stem = f"IM{number:05d}_{chosen.series}"
        name = stem if chosen.planted is None else f"{chosen.planted.folder}_{stem}.dcm"
        paths.append(folder / name)
        save(data, paths[-1], chosen.syntax)
    return paths


def slice_dataset(volume: Volume, k: int, options: SeriesOptions, *, number: int) -> Dataset:
    """Return slice k of `volume` as a CT image, its pixels still native."""
    grid = volume.grid
    axes = grid.ct_from_voxel[:3, :3] / grid.spacing_mm
    position = grid.to_ct([0.0, 0.0, k]) + axes[:, 2] * options.moved_mm.get(k, 0.0)
    hu = volume.hu[k].astype(float)
    if options.tilt_deg:
        # Slices stay where they are along their normal and slide along their columns, as the table does under a tilt.
        slide_mm = k * grid.spacing_mm[2] * np.tan(np.deg2rad(options.tilt_deg))
        position = position + axes[:, 1] * slide_mm
        hu = ndimage.shift(hu, (-slide_mm / grid.spacing_mm[1], 0.0), order=3, cval=TILT_FILL_HU)
    data = _header(volume, options, number=number, k=k)
    data.ImagePositionPatient = [f"{each:.6f}"[:16] for each in position]
    data.ImageOrientationPatient = [f"{each:.10f}"[:16] for each in (*axes[:, 0], *axes[:, 1])]
    data.SliceLocation = f"{position @ axes[:, 2]:.4f}"
    _pixels(data, hu, k, options)
    for each in (options.tags, options.tags_of.get(k, {})):
        for keyword, value in each.items():
            setattr(data, keyword, value)
    if options.planted is not None:
        plant(data, options.planted, everywhere=k % _EVERYWHERE == 0)
    return data


def save(data: Dataset, path: Path, syntax: str) -> None:
    """Write a data set to `path` in one of `SYNTAXES`, its pixels encoded as that syntax says."""
    data.file_meta = FileMetaDataset()
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID or CTImageStorage
    data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID or generate_uid()
    data.file_meta.TransferSyntaxUID = SYNTAXES[syntax]
    encode(data, syntax)
    pydicom.dcmwrite(path, data, enforce_file_format=True)


def _header(volume: Volume, options: SeriesOptions, *, number: int, k: int) -> Dataset:
    data = Dataset()
    data.SpecificCharacterSet = "ISO_IR 192"
    data.SOPClassUID = CTImageStorage
    data.SOPInstanceUID = generate_uid(entropy_srcs=[options.study, options.series, str(k), options.description])
    data.StudyInstanceUID = generate_uid(entropy_srcs=[options.study])
    data.SeriesInstanceUID = generate_uid(entropy_srcs=[options.study, options.series])
    data.FrameOfReferenceUID = generate_uid(entropy_srcs=[options.study, "frame"])
    data.Modality = options.modality
    data.ImageType = list(options.image_type)
    data.SeriesDescription = options.description
    data.SeriesNumber = sum(options.series.encode())
    data.InstanceNumber = number
    data.SliceThickness = "3"  # not the distance of slices: no reader may take it for that
    data.KVP = "100"
    data.ConvolutionKernel = "Bv38d"
    data.Manufacturer = "SIEMENS"
    data.PixelSpacing = [f"{volume.grid.spacing_mm[1]:.9g}", f"{volume.grid.spacing_mm[0]:.9g}"]
    return data


def _pixels(data: Dataset, hu: np.ndarray, k: int, options: SeriesOptions) -> None:
    """Put the slice's values in, unsigned 16 bit, as its slope and intercept store them."""
    slope, intercept = _of_slice(options.slope, k), _of_slice(options.intercept, k)
    stored = np.rint((hu - intercept) / slope)
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.Rows, data.Columns = hu.shape
    data.BitsAllocated, data.BitsStored, data.HighBit = 16, 16, 15
    data.PixelRepresentation = int(stored.min() < 0 or (options.padding is not None and options.padding < 0))
    data.RescaleSlope, data.RescaleIntercept = f"{slope:.9g}", f"{intercept:.9g}"
    kind = np.int16 if data.PixelRepresentation else np.uint16
    values = np.clip(stored, np.iinfo(kind).min, np.iinfo(kind).max).astype(kind)
    if options.padding is not None:
        rows, columns = np.indices(hu.shape)
        centre = (np.array(hu.shape) - 1) / 2.0
        outside = np.hypot((rows - centre[0]) / hu.shape[0], (columns - centre[1]) / hu.shape[1]) > 0.5
        values[outside] = options.padding
        data.add_new(0x00280120, "SS" if data.PixelRepresentation else "US", options.padding)
    data.add_new(0x7FE00010, "OW", values.astype(values.dtype.newbyteorder("<")).tobytes())


def _of_slice(value: float | Sequence[float], k: int) -> float:
    return float(value) if isinstance(value, (int, float)) else float(value[k])
