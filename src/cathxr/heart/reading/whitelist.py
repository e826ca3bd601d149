"""What of a header may leave the reader: numbers in a plausible range, and words of a known vocabulary."""

import re

from cathxr.heart.reading.elements import Elements

MODALITIES = frozenset(
    ["CT", "MR", "PT", "NM", "US", "CR", "DX", "XA", "RF", "MG", "OT", "SC", "SEG", "SR", "PR", "KO", "REG", "DOC"]
)
"""Codes of modalities that are shown as they stand."""

_KERNEL_PATTERNS = (
    re.compile(r"[BHDTUSIJQ][rvfbqsw]?\d{2}[a-z]{0,2}"),  # Siemens: B26f, Bv38d, Qr40, I26f
    re.compile(r"FC\d{2}"),  # Canon and Toshiba
    re.compile(r"IMR[1-3]"),  # Philips
)
_KERNEL_WORDS = (
    {"STANDARD", "STND", "SOFT", "DETAIL", "BONE", "BONEPLUS", "LUNG", "CHEST", "EDGE", "ULTRA"}  # GE
    | {
        "A",
        "B",
        "C",
        "D",
        "E",
        "F",
        "L",
        "UB",
        "YA",
        "YB",
        "YC",
        "CA",
        "CB",
        "CC",
        "XCA",
        "XCB",
        "XCC",
        "XCD",
    }  # Philips
)


def modality_of(elements: Elements) -> str:
    """Return the modality's code, or "unknown" for one that is not in `MODALITIES`."""
    word = elements.text("Modality").upper()
    return word if word in MODALITIES else "unknown"


def kernel_of(elements: Elements) -> str:
    """Return the reconstruction kernel, where it is a name that scanners give to kernels; else ""."""
    for word in elements.words("ConvolutionKernel"):
        if word in _KERNEL_WORDS or any(each.fullmatch(word) for each in _KERNEL_PATTERNS):
            return word
    return ""


def thickness_of(elements: Elements) -> float | None:
    """Return the nominal thickness of a slice, mm. It is not the distance of slices."""
    return elements.number("SliceThickness", low=0.05, high=50.0)


def voltage_of(elements: Elements) -> float | None:
    """Return the tube's voltage, kV."""
    return elements.number("KVP", low=20.0, high=200.0)
