"""Plants names, dates and identifiers in every text-like element of a data set, to look for them in all output."""

from dataclasses import dataclass

from pydicom.datadict import DicomDictionary
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

# What the reader has to have is left alone; everything that is text beside it is planted, technical words included.
_KEPT = {
    0x00080005,  # SpecificCharacterSet
    0x00080008,  # ImageType
    0x00080016,  # SOPClassUID
    0x00080060,  # Modality
    0x0020000E,  # SeriesInstanceUID: planted by `plant` with one value for the series
    0x00200032,  # ImagePositionPatient
    0x00200037,  # ImageOrientationPatient
    0x00280004,  # PhotometricInterpretation
    0x00280030,  # PixelSpacing
    0x00280008,  # NumberOfFrames
    0x00281052,  # RescaleIntercept
    0x00281053,  # RescaleSlope
}


@dataclass(frozen=True)
class Planted:
    """What is planted: none of it may be found in any output, in any upper or lower case."""

    name: str = "Quodlibetius"
    word: str = "XYLOPHANT"
    date: str = "19470523"
    date_written: str = "1947-05-23"
    age: str = "079Y"
    time: str = "231759.123456"
    uid: str = "1.2.826.0.1.3680043.8.498.77665544332211"
    number: str = "31337.25"
    whole_number: str = "1867530928"
    folder: str = "Quodlibetius_Xylophant_19470523"
    url: str = "https://xylophant.example/quodlibetius"

    @property
    def needles(self) -> tuple[str, ...]:
        """Return what to search for; not the age, whose four letters turn up in packed pictures by themselves."""
        return (
            self.name, self.word, self.date, self.date_written, self.time, self.uid, "77665544332211",
            self.number, self.whole_number, "xylophant.example",
        )  # fmt: skip

    def value(self, vr: str) -> str | bytes | None:
        """Return what an element of the value representation `vr` is given, or None for one that is not text-like."""
        return {
            "AE": self.word, "AS": self.age, "CS": self.word, "DA": self.date, "DT": f"{self.date}{self.time}",
            "DS": self.number, "IS": self.whole_number, "LO": f"{self.name} {self.word}",
            "LT": f"{self.name} {self.date_written}", "PN": f"{self.name}^{self.word}", "SH": self.name,
            "ST": f"{self.name} {self.date}", "TM": self.time, "UC": self.name, "UI": self.uid, "UR": self.url,
            "UT": f"{self.name} {self.word} {self.date}", "UN": f"{self.name} {self.word} ".encode(),
            "OB": f"{self.name} {self.word} ".encode(), "OB or OW": f"{self.name} {self.word} ".encode(),
        }.get(vr)  # fmt: skip


# What every slice of a scanner says; 2500 elements in each of hundreds of slices would only take time.
_COMMON_GROUPS = (0x0008, 0x0010, 0x0020)
_COMMON = 0x00181210  # ConvolutionKernel, and the acquisition's elements before it


def plant(data: Dataset, planted: Planted, *, everywhere: bool = True) -> None:
    """Put `planted` into every text-like element of the DICOM dictionary, nested ones and private ones, but `_KEPT`.

    everywhere: False leaves out what images seldom have.
    """
    for tag, (vr, _, _, retired, _) in DicomDictionary.items():
        group = tag >> 16
        if tag in _KEPT or retired or group in (0x0000, 0x0002, 0x0004) or group >= 0x5000 or tag & 0xFFFF == 0:
            continue
        if not everywhere and group not in _COMMON_GROUPS and not (group == 0x0018 and tag <= _COMMON):
            continue
        value = planted.value(vr)
        if value is not None and not vr.startswith("O"):
            data.add_new(tag, vr, value)
    nested = Dataset()
    nested.PatientName, nested.CodeMeaning, nested.StudyDate = planted.value("PN"), planted.name, planted.date
    nested.SOPInstanceUID = planted.uid
    for keyword in ("RequestAttributesSequence", "ReferencedStudySequence", "ProcedureCodeSequence"):
        setattr(data, keyword, Sequence([nested]))
    for group in (0x0009, 0x0019, 0x0029):
        block = data.private_block(group, f"{planted.name} 1", create=True)
        for offset, vr in enumerate(("LO", "PN", "UN", "OB", "UI", "DA")):
            block.add_new(offset, vr, planted.value(vr))
    data.SeriesInstanceUID = f"{planted.uid}.1"
    data.preamble = f"{planted.name} {planted.word}".encode().ljust(128, b"\0")
