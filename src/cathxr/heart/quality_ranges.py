"""Volumes of the chambers of healthy adults, from the literature: to compare with, not to judge by."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class UsualVolume:
    """What is usual in healthy adults, in words. when: the phase that it is for."""

    men: str
    women: str
    when: str
    source: int


SOURCES = (
    "Hudsmith et al., “Normal human left and right ventricular and left atrial dimensions using steady state free "
    "precession magnetic resonance imaging”, J Cardiovasc Magn Reson 2005; 7: 775–782 (108 adults; mean ± 2 standard "
    "deviations).",
    "Fuchs et al., “Normal values of left ventricular mass and cardiac chamber volumes assessed by 320-detector "
    "computed tomography angiography in the Copenhagen General Population Study”, Eur Heart J Cardiovasc Imaging 2016; "
    "17: 1009–1017 (569 adults; 97.5th percentile, for each square metre of body surface).",
)
"""Where the figures are from, counted from 1."""

USUAL: Mapping[str, UsualVolume] = MappingProxyType(
    {
        "left_ventricle": UsualVolume("102–218 mL", "83–187 mL", "end diastole", 1),
        "right_ventricle": UsualVolume("124–256 mL", "78–218 mL", "end diastole", 1),
        "left_atrium": UsualVolume("43–163 mL", "47–131 mL", "at its largest, end systole", 1),
        "right_atrium": UsualVolume("up to 85 mL/m²", "up to 73 mL/m²", "in the phase that was scanned", 2),
    }
)
"""By structure."""
