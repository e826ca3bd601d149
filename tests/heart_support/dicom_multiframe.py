"""Writes DICOM objects of many frames for the tests: enhanced CT, and segmentations."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import EnhancedCTImageStorage, SegmentationStorage, generate_uid

from cathxr.heart.volume import Grid, LabelVolume, Volume

from .encoders import SYNTAXES, encode


def write_enhanced(
    path: Path,
    volumes: Mapping[float | None, Volume],
    *,
    shuffle: int = 0,
    slopes: Sequence[float] = (1.0,),
    syntax: str = "explicit",
) -> Path:
    """Write one enhanced CT of every volume by its phase, per cent of the RR interval (None: no phase), shuffled.

    slopes: of the frames in turn, so that no two neighbours share their rescale.
    """
    frames = [(percent, volume, k) for percent, volume in volumes.items() for k in range(volume.grid.shape[0])]
    np.random.default_rng(shuffle).shuffle(frames)
    data = _whole(EnhancedCTImageStorage, "CT", next(iter(volumes.values())).grid, len(frames))
    items, stored = [], []
    for number, (percent, volume, k) in enumerate(frames):
        slope = slopes[number % len(slopes)]
        item = _placed(volume.grid, k)
        transformation = Dataset()
        transformation.RescaleSlope, transformation.RescaleIntercept = str(slope), "-1024"
        transformation.RescaleType = "HU"
        item.PixelValueTransformationSequence = [transformation]
        if percent is not None:
            beat = Dataset()
            beat.NominalPercentageOfCardiacPhase = float(percent)
            item.CardiacSynchronizationSequence = [beat]
        items.append(item)
        stored.append(np.rint((volume.hu[k] + 1024.0) / slope).astype(np.uint16))
    data.PerFrameFunctionalGroupsSequence = items
    data.BitsAllocated, data.BitsStored, data.HighBit = 16, 16, 15
    data.add_new(0x7FE00010, "OW", np.stack(stored).astype("<u2").tobytes())
    return _save(data, path, syntax)


def write_segmentation(
    path: Path, labels: LabelVolume, *, texts: Mapping[int, str], codes: Mapping[int, str] | None = None,
    fractional: bool = False, syntax: str = "explicit",
) -> Path:  # fmt: skip
    """Write a segmentation: one segment for each label, frames only where it has voxels. texts: segments' labels."""
    data = _whole(SegmentationStorage, "SEG", labels.grid, 0)
    data.SegmentationType = "FRACTIONAL" if fractional else "BINARY"
    segments, items, planes = [], [], []
    for number, (label, text) in enumerate(texts.items(), start=1):
        segment, kind = Dataset(), Dataset()
        segment.SegmentNumber, segment.SegmentLabel, segment.SegmentAlgorithmType = number, text, "MANUAL"
        kind.CodeValue, kind.CodingSchemeDesignator = (codes or {}).get(label, "0"), "SCT"
        kind.CodeMeaning = "A part"
        segment.SegmentedPropertyTypeCodeSequence = [kind]
        segments.append(segment)
        for k in np.flatnonzero((labels.labels == label).any(axis=(1, 2))):
            item, which = _placed(labels.grid, int(k)), Dataset()
            which.ReferencedSegmentNumber = number
            item.SegmentIdentificationSequence = [which]
            items.append(item)
            planes.append(labels.labels[k] == label)
    data.SegmentSequence, data.PerFrameFunctionalGroupsSequence = segments, items
    data.NumberOfFrames = len(planes)
    stack = np.stack(planes)
    if fractional:
        data.MaximumFractionalValue, data.SegmentationFractionalType = 200, "PROBABILITY"
        data.BitsAllocated, data.BitsStored, data.HighBit = 8, 8, 7
        # Between a little and nearly all: the reader's threshold is half of the maximum.
        pixels = np.where(stack, 150, 60).astype(np.uint8).tobytes()
    else:
        data.BitsAllocated, data.BitsStored, data.HighBit = 1, 1, 0
        pixels = np.packbits(stack.ravel(), bitorder="little").tobytes()
    data.add_new(0x7FE00010, "OB", pixels + b"\0" * (len(pixels) % 2))
    return _save(data, path, syntax)


def _whole(sop_class: str, modality: str, grid: Grid, frames: int) -> Dataset:
    data = Dataset()
    data.SOPClassUID, data.SOPInstanceUID = sop_class, generate_uid()
    data.SeriesInstanceUID, data.Modality = generate_uid(), modality
    data.ImageType = ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
    data.NumberOfFrames = frames
    data.Rows, data.Columns = grid.shape[1:]
    data.SamplesPerPixel, data.PhotometricInterpretation, data.PixelRepresentation = 1, "MONOCHROME2", 0
    shared, measures, plane = Dataset(), Dataset(), Dataset()
    measures.PixelSpacing = [f"{grid.spacing_mm[1]:.9g}", f"{grid.spacing_mm[0]:.9g}"]
    measures.SliceThickness = "3"
    axes = grid.ct_from_voxel[:3, :3] / grid.spacing_mm
    plane.ImageOrientationPatient = [f"{each:.10f}"[:16] for each in (*axes[:, 0], *axes[:, 1])]
    shared.PixelMeasuresSequence, shared.PlaneOrientationSequence = [measures], [plane]
    data.SharedFunctionalGroupsSequence = [shared]
    return data


def _placed(grid: Grid, k: int) -> Dataset:
    item, place = Dataset(), Dataset()
    place.ImagePositionPatient = [f"{each:.6f}"[:16] for each in grid.to_ct([0.0, 0.0, k])]
    item.PlanePositionSequence = [place]
    return item


def _save(data: Dataset, path: Path, syntax: str) -> Path:
    data.file_meta = FileMetaDataset()
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
    data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
    data.file_meta.TransferSyntaxUID = SYNTAXES[syntax]
    encode(data, syntax)
    path.parent.mkdir(parents=True, exist_ok=True)
    pydicom.dcmwrite(path, data, enforce_file_format=True)
    return path
