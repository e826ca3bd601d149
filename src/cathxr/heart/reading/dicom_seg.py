"""DICOM segmentations: binary, fractional and label-map ones. Segments are known by their labels or coded concepts."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pydicom
from pydicom.dataset import Dataset
from pydicom.encaps import generate_frames
from pydicom.uid import UID, ExplicitVRLittleEndian

from cathxr.core import DataError, FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.reading.elements import UNREADABLE, Elements
from cathxr.heart.reading.frames import Frame, Layout, frames_of, looks_like_dicom
from cathxr.heart.reading.inflating import check_swelling
from cathxr.heart.reading.painting import Canvas, onto
from cathxr.heart.reading.pixels import decode_piece
from cathxr.heart.reading.structure_names import CODES, key_of
from cathxr.heart.volume import Grid, LabelVolume, Progress

_CLASSES = ("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7")
_ON_PLANE = 0.1
_MAX_VOXELS = 1 << 30


@dataclass(frozen=True, eq=False)
class _Planes:
    """Where the frames lie: the grid that all of them fill, and the slice of each."""

    grid: Grid
    slices: npt.NDArray[np.int_]


def is_segmentation(path: Path) -> bool:
    """Return whether a file is a DICOM segmentation."""
    try:
        if not looks_like_dicom(path):
            return False
        check_swelling(path)
        found = pydicom.dcmread(path, stop_before_pixels=True, force=True, specific_tags=["SOPClassUID", "Modality"])
    except (*UNREADABLE, OSError):
        return False
    return found.get("SOPClassUID") in _CLASSES or found.get("Modality") == "SEG"


def read_segmentation(file: Path, path: Path, *, like: Grid | None, progress: Progress) -> LabelVolume:
    """Return a DICOM segmentation with the catalogue's labels, on the grid of `like` or its own.

    Raises:
        DataError: it is damaged, has no regular slices, or none of its segments is a structure of the catalogue.
    """
    try:
        data = pydicom.dcmread(file, force=True)
        syntax = UID(str(data.file_meta.get("TransferSyntaxUID") or ExplicitVRLittleEndian))
        frames = frames_of(data, file, 1, syntax=syntax)
        keys = _keys(data)
        pictures = _pictures(data, frames)
        numbers = _segments_of_frames(data, len(frames))
    except UNREADABLE:
        raise DataError(f"{path} is a damaged DICOM segmentation; copy or export it again.") from None
    if not keys:
        raise DataError(
            f"{path} names none of its segments as a structure of a heart; label them as one of {', '.join(CATALOGUE)}."
        )
    planes = _planes(frames, data, path)
    is_label_map = str(data.get("SegmentationType", "")).upper() == "LABELMAP"
    half = 0.5 * float(data.get("MaximumFractionalValue") or 1)
    target = like or planes.grid
    canvas = Canvas(target)
    for done, (segment, key) in enumerate(keys.items()):
        progress(f"Reading the segment of the {CATALOGUE[key].name.lower()}", done / len(keys))
        mask = np.zeros(planes.grid.shape, np.uint8)
        for picture, number, k in zip(pictures, numbers, planes.slices, strict=True):
            if is_label_map:
                mask[k] |= picture == segment
            elif number == segment:
                mask[k] |= picture >= half
        canvas.paint(key, onto(mask, planes.grid, target) != 0)
    labels = canvas.finished()
    if not labels.labels.any():
        raise DataError(f"{path}: all segments of the heart are empty on the scan's grid; check that they fit it.")
    return labels


def _keys(data: Dataset) -> Mapping[int, str]:
    """Return the structure's key by segment number, of those segments that are one."""
    keys = {}
    for item in Elements([data]).items("SegmentSequence"):
        segment = Elements([item])
        number = segment.whole("SegmentNumber")
        types = [Elements([each]) for each in segment.items("SegmentedPropertyTypeCodeSequence")[:1]]
        names = [segment.text("SegmentLabel"), *(each.text("CodeMeaning") for each in types)]
        codes = [each.text("CodeValue") for each in types]
        found = [key for name in names if (key := key_of(name))] + [CODES[each] for each in codes if each in CODES]
        if number is not None and found:
            keys[number] = found[0]
    return keys


def _segments_of_frames(data: Dataset, count: int) -> list[int | None]:
    """Return which segment each frame belongs to; None where the frame does not say."""
    shared = Elements([data]).items("SharedFunctionalGroupsSequence")[:1]
    numbers: list[int | None] = []
    for item in Elements([data]).items("PerFrameFunctionalGroupsSequence")[:count]:
        found = None
        for group in (item, *shared):
            for identification in Elements([group]).items("SegmentIdentificationSequence"):
                found = found or Elements([identification]).whole("ReferencedSegmentNumber")
        numbers.append(found)
    return numbers + [None] * (count - len(numbers))


def _pictures(data: Dataset, frames: list[Frame]) -> list[npt.NDArray[Any]]:
    """Return every frame's values (rows, columns)."""
    layout = frames[0].layout
    size, count = layout.rows * layout.columns, len(frames)
    if size * count > _MAX_VOXELS * 4:
        raise ValueError("too large")
    if layout.syntax.is_encapsulated:
        pieces = generate_frames(data.PixelData, number_of_frames=count)
        return [decode_piece(each, layout) for each in pieces]
    values: npt.NDArray[Any]
    if layout.bits_allocated == 1:
        # One bit a pixel, and frames do not begin at whole bytes: all of them together.
        values = np.unpackbits(np.frombuffer(data.PixelData, np.uint8), count=size * count, bitorder="little")
    else:
        values = np.frombuffer(data.PixelData, _kind(layout))[: size * count]
    return list(values.reshape(count, layout.rows, layout.columns))


def _kind(layout: Layout) -> np.dtype[np.generic]:
    return np.dtype(f"<u{layout.bits_allocated // 8}")


def _planes(frames: list[Frame], data: Dataset, path: Path) -> _Planes:
    """Return the regular grid of the frames' planes, empty ones between them included.

    Raises:
        DataError: the frames do not say where they lie, or not in regular, parallel planes.
    """
    first = frames[0]
    if first.axes is None or first.spacing_mm is None or any(each.position is None for each in frames):
        raise DataError(f"{path} does not say where its pictures lie; export the segmentation again.")
    axes = np.column_stack([first.axes, np.cross(first.axes[:, 0], first.axes[:, 1])])
    positions = np.array([each.position for each in frames]) @ axes
    along = positions[:, 2]
    steps = np.diff(np.unique(np.round(along, 3)))
    pitch = float(steps.min()) if len(steps) else _stated_pitch(data)
    if stated := _stated_pitch(data):
        ratio = pitch / stated
        pitch = stated if abs(ratio - round(ratio)) < _ON_PLANE and round(ratio) >= 1 else pitch
    planes = (along - along.min()) / (pitch or 1.0)
    slide = np.abs(positions[:, :2] - positions[0, :2]).max() if len(positions) else 0.0
    if np.abs(planes - np.rint(planes)).max() > _ON_PLANE or slide > _ON_PLANE * min(first.spacing_mm):
        raise DataError(f"{path} does not lie in regular, parallel planes; export it as a label map (NIfTI or NRRD).")
    slices = np.rint(planes).astype(int)
    lowest = positions[int(np.argmin(along))]
    matrix: FloatArray = np.eye(4)
    matrix[:3, :3] = axes * np.array([*first.spacing_mm, pitch or 1.0])
    matrix[:3, 3] = axes @ lowest
    shape = (int(slices.max()) + 1, first.layout.rows, first.layout.columns)
    if float(np.prod([float(each) for each in shape])) > _MAX_VOXELS:
        raise DataError(f"{path} declares {shape} voxels, more than a scan has; check the file.")
    return _Planes(Grid(shape, matrix), slices)


def _stated_pitch(data: Dataset) -> float:
    """Return the distance of slices that the shared groups state, mm, or 0."""
    for item in Elements([data]).items("SharedFunctionalGroupsSequence")[:1]:
        for measures in Elements([item]).items("PixelMeasuresSequence")[:1]:
            return Elements([measures]).number("SpacingBetweenSlices", low=0.01, high=100.0) or 0.0
    return 0.0
