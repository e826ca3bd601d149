"""One frame of a DICOM file, as far as the reader looks at it: what is not in `READ` is not even held in memory."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pydicom
from pydicom.dataset import Dataset
from pydicom.uid import UID, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

from cathxr.core import FloatArray
from cathxr.heart.reading.descriptions import described_percent
from cathxr.heart.reading.elements import Elements
from cathxr.heart.reading.inflating import check_swelling
from cathxr.heart.reading.whitelist import kernel_of, modality_of, thickness_of, voltage_of

READ = (
    "SOPClassUID", "SOPInstanceUID", "StudyInstanceUID", "SeriesInstanceUID", "FrameOfReferenceUID", "Modality",
    "ImageType", "SeriesNumber", "AcquisitionNumber", "InstanceNumber", "SeriesDescription", "SliceThickness",
    "KVP", "ConvolutionKernel", "ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing",
    "NumberOfFrames", "Rows", "Columns", "SamplesPerPixel", "BitsAllocated", "BitsStored", "HighBit",
    "PixelRepresentation", "PixelPaddingValue", "PixelPaddingRangeLimit", "RescaleSlope", "RescaleIntercept",
    "RescaleType", "TriggerTime", "NominalInterval", "HeartRate", "NominalPercentageOfCardiacPhase",
    "NominalCardiacTriggerDelayTime", "TemporalPositionIdentifier", "TemporalPositionIndex",
    "SharedFunctionalGroupsSequence", "PerFrameFunctionalGroupsSequence",
)  # fmt: skip

_IMAGE_CLASSES = {
    "1.2.840.10008.5.1.4.1.1.2": "image",  # CT
    "1.2.840.10008.5.1.4.1.1.2.1": "image",  # enhanced CT
    "1.2.840.10008.5.1.4.1.1.2.2": "image",  # legacy converted enhanced CT
    "1.2.840.10008.5.1.4.1.1.4": "image",  # MR, and its enhanced ones
    "1.2.840.10008.5.1.4.1.1.4.1": "image",
    "1.2.840.10008.5.1.4.1.1.128": "image",  # PET
    "1.2.840.10008.5.1.4.1.1.66.4": "segmentation",
}
_SECONDARY = "1.2.840.10008.5.1.4.1.1.7"
_OTHER_UNITS = ("OD", "MGML", "Z_EFF", "ED", "EDW", "PCT")  # what dual-energy CT stores beside HU
NATIVE_IN_PLACE = (ImplicitVRLittleEndian, ExplicitVRLittleEndian, ExplicitVRBigEndian)
"""Transfer syntaxes whose pixels lie in the file as they are."""

_DEFERRED = 4096
_SANE_MM = 100.0
_ORTHOGONAL = 0.01


@dataclass(frozen=True)
class Layout:
    """How a frame's pixels are stored. padding: the range of stored values that mean "no picture here"."""

    syntax: UID
    rows: int
    columns: int
    samples: int
    bits_allocated: int
    bits_stored: int
    high_bit: int
    is_signed: bool
    padding: tuple[int, int] | None

    @property
    def frame_bytes(self) -> int:
        """Size of one frame, decoded."""
        return self.rows * self.columns * self.samples * max(self.bits_allocated, 8) // 8


@dataclass(frozen=True)
class Timing:
    """What a frame says about its instant in the heart's cycle; each None where it does not."""

    percent: float | None
    described_percent: float | None
    trigger_ms: float | None
    interval_ms: float | None
    temporal: int | None
    acquisition: int | None
    instance: int | None


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture. path, identity, series: for the reader's own use, never shown.

    number: of the file, from 1, in name order. kind: "image", "localiser", "secondary", "segmentation" or "other".
    position (3,) mm in `ct` of the first pixel's centre; axes (3, 2): along a row, along a column. spacing_mm: between
    columns, between rows. Each None where the frame does not say. slope, intercept: stored value to HU.
    start: where in the file the pixels begin, 0 where they are packed.
    """

    path: Path
    number: int
    index: int
    identity: str
    series: tuple[str, ...]
    order: int
    kind: str
    modality: str
    is_hounsfield: bool
    layout: Layout
    position: FloatArray | None
    axes: FloatArray | None
    spacing_mm: tuple[float, float] | None
    slope: float
    intercept: float
    timing: Timing
    kernel: str
    thickness_mm: float | None
    voltage_kv: float | None
    start: int = 0


def frames_of(dataset: Dataset, path: Path, number: int, *, syntax: UID) -> list[Frame]:
    """Return the frames of a data set that has pixels; [] for one that has none (a report, a directory)."""
    whole = Elements([dataset])
    if whole.whole("Rows", low=1) is None or whole.whole("Columns", low=1) is None:
        return []
    layout = _layout(whole, syntax)
    count = whole.whole("NumberOfFrames", low=1, high=100_000) or 1
    shared = _groups(whole.items("SharedFunctionalGroupsSequence")[:1])
    each_frame = whole.items("PerFrameFunctionalGroupsSequence")
    frames = []
    for index in range(count):
        own = _groups(each_frame[index : index + 1])
        frames.append(_frame(Elements([*own, *shared, dataset]), layout, path, number=number, index=index))
    return frames


def _groups(items: list[Dataset]) -> list[Dataset]:
    """Return the functional groups' own items, one level below."""
    found = []
    for item in items:
        found += [element.value[0] for element in item if element.VR == "SQ" and element.value]
    return found


def _frame(of_frame: Elements, layout: Layout, path: Path, *, number: int, index: int) -> Frame:
    spacing = of_frame.numbers("PixelSpacing", 2)
    is_sane = spacing is not None and all(0.0 < each < _SANE_MM for each in spacing)
    position = of_frame.numbers("ImagePositionPatient", 3)
    rescale = of_frame.text("RescaleType").upper()
    slope = of_frame.number("RescaleSlope")
    identity = of_frame.text("SOPInstanceUID")
    return Frame(
        path=path,
        number=number,
        index=index,
        identity=f"{identity}/{index}" if identity else "",
        series=_series(of_frame),
        order=of_frame.whole("SeriesNumber") or 0,
        kind=_kind(of_frame),
        modality=modality_of(of_frame),
        is_hounsfield=rescale not in _OTHER_UNITS,
        layout=layout,
        position=None if position is None else np.array(position),
        axes=_axes(of_frame.numbers("ImageOrientationPatient", 6)),
        spacing_mm=(spacing[1], spacing[0]) if spacing is not None and is_sane else None,
        slope=1.0 if slope is None or slope == 0.0 else slope,
        intercept=of_frame.number("RescaleIntercept") or 0.0,
        timing=_timing(of_frame),
        kernel=kernel_of(of_frame),
        thickness_mm=thickness_of(of_frame),
        voltage_kv=voltage_of(of_frame),
    )


def _series(elements: Elements) -> tuple[str, ...]:
    """Return what frames of one series share. Where its UID is blank, as after careless de-identification, the rest."""
    series = elements.text("SeriesInstanceUID")
    if series:
        return (series,)
    names = ("StudyInstanceUID", "SeriesNumber", "FrameOfReferenceUID", "SeriesDescription")
    return ("", *(elements.text(each) for each in names), kernel_of(elements))


def _kind(elements: Elements) -> str:
    """Return what sort of picture it is."""
    words = {each.upper() for keyword in ("ImageType", "FrameType") for each in elements.words(keyword)}
    sop_class = elements.text("SOPClassUID")
    if words & {"LOCALIZER", "LOCALISER", "SCOUT", "TOPOGRAM"}:
        return "localiser"
    if sop_class.startswith(_SECONDARY) or (elements.whole("SamplesPerPixel") or 1) != 1:
        return "secondary"
    if not sop_class:
        return "image"
    return _IMAGE_CLASSES.get(sop_class, "other")


def _layout(whole: Elements, syntax: UID) -> Layout:
    allocated = whole.whole("BitsAllocated", low=1, high=64) or 16
    stored = whole.whole("BitsStored", low=1, high=64) or allocated
    signed = bool(whole.whole("PixelRepresentation") or 0)
    return Layout(
        syntax=syntax,
        rows=whole.whole("Rows") or 0,
        columns=whole.whole("Columns") or 0,
        samples=whole.whole("SamplesPerPixel", low=1, high=4) or 1,
        bits_allocated=allocated,
        bits_stored=min(stored, allocated),
        high_bit=whole.whole("HighBit", low=0, high=63) or stored - 1,
        is_signed=signed,
        padding=_padding(whole, allocated=allocated, is_signed=signed),
    )


def _padding(whole: Elements, *, allocated: int, is_signed: bool) -> tuple[int, int] | None:
    """Return the range of padding; a value whose sign was written the wrong way is brought into the pixels' range."""
    ends = [whole.whole("PixelPaddingValue"), whole.whole("PixelPaddingRangeLimit")]
    known = [each for each in ends if each is not None]
    if ends[0] is None:
        return None
    turn, low = 1 << allocated, -(1 << (allocated - 1)) if is_signed else 0
    inside = [(each - low) % turn + low for each in known]
    return min(inside), max(inside)


def _axes(cosines: tuple[float, ...] | None) -> FloatArray | None:
    """Return the axes (3, 2) along a row and a column, exactly orthogonal; None where they are nothing like that."""
    if cosines is None:
        return None
    row, column = np.array(cosines[:3]), np.array(cosines[3:])
    lengths = np.linalg.norm(row), np.linalg.norm(column)
    if min(lengths) < 1.0 - _ORTHOGONAL or max(lengths) > 1.0 + _ORTHOGONAL or abs(row @ column) > _ORTHOGONAL:
        return None
    row = row / np.linalg.norm(row)
    column = column - row * (row @ column)
    return np.column_stack([row, column / np.linalg.norm(column)])


def _timing(elements: Elements) -> Timing:
    rate = elements.number("HeartRate", low=20.0, high=250.0)
    interval = elements.number("NominalInterval", low=240.0, high=3000.0)
    trigger = elements.number("NominalCardiacTriggerDelayTime", low=0.0, high=3000.0)
    return Timing(
        percent=elements.number("NominalPercentageOfCardiacPhase", low=0.0, high=100.0),
        described_percent=described_percent(elements.text("SeriesDescription")),
        trigger_ms=elements.number("TriggerTime", low=0.0, high=3000.0) if trigger is None else trigger,
        interval_ms=60_000.0 / rate if interval is None and rate else interval,
        temporal=elements.whole("TemporalPositionIndex") or elements.whole("TemporalPositionIdentifier"),
        acquisition=elements.whole("AcquisitionNumber"),
        instance=elements.whole("InstanceNumber"),
    )


def read_frames(path: Path, number: int) -> list[Frame] | None:
    """Return the frames of a DICOM file, [] where it holds no picture, None where it is not DICOM.

    Raises:
        UNREADABLE: the header is damaged; the caller says so, as the library's words may quote the header.
        OSError: the file cannot be read.
    """
    if not looks_like_dicom(path):
        return None
    check_swelling(path)
    dataset = pydicom.dcmread(path, defer_size=_DEFERRED, force=True, specific_tags=[*READ, "PixelData"])
    syntax = dataset.file_meta.get("TransferSyntaxUID")
    if syntax is None:
        syntax = ImplicitVRLittleEndian if dataset.original_encoding[0] else ExplicitVRLittleEndian
    if not dataset.get("SOPClassUID"):
        dataset.SOPClassUID = dataset.file_meta.get("MediaStorageSOPClassUID", "")
    frames = frames_of(dataset, path, number, syntax=UID(syntax))
    start = _pixels_start(dataset, path, frames)
    return [replace(each, start=start) for each in frames]


def _pixels_start(dataset: Dataset, path: Path, frames: list[Frame]) -> int:
    """Return where in the file the pixels begin; 0 where they have to be unpacked first.

    Raises:
        EOFError: the file ends before its pixels do. The library itself says nothing of that.
    """
    sop_class = dataset.get("SOPClassUID")
    is_picture = sop_class in _IMAGE_CLASSES or (bool(frames) and not sop_class)
    element = dataset.get_item("PixelData", keep_deferred=True)
    if element is None:
        if is_picture:
            raise EOFError
        return 0
    if not frames or frames[0].layout.syntax not in NATIVE_IN_PLACE:
        return 0
    start, needed = int(element.value_tell), len(frames) * frames[0].layout.frame_bytes
    if element.length < needed or path.stat().st_size < start + needed:
        raise EOFError
    return start


def looks_like_dicom(path: Path) -> bool:
    """Return whether a file begins as DICOM does: with its mark, or (old files) with an element of the first groups."""
    with path.open("rb") as file:
        start = file.read(132)
    if start[128:132] == b"DICM":
        return True
    group, element = int.from_bytes(start[:2], "little"), int.from_bytes(start[2:4], "little")
    return len(start) == 132 and group in (0x0002, 0x0008) and element in (0, 1, 2, 5, 8, 0x16)
