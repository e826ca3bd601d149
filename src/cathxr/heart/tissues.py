"""What tissues do to ultrasound: impedance, attenuation and scattering, and which tissue a CT number is.

Impedance is density times speed of sound, and attenuation at 1 MHz is given per MHz (it grows about in proportion in
the band of intracardiac probes, 5 to 10 MHz). Values for 37 °C, rounded to what the sources agree on:

* Hasgall et al., "IT'IS Database for thermal and electromagnetic parameters of biological tissues", version 4.1, 2022,
  doi:10.13099/VIP21000-04-1 (density, speed of sound, attenuation constant);
* Duck, "Physical Properties of Tissues", Academic Press 1990, chapter 4 (the same, and ranges);
* Shung and Thieme (eds.), "Ultrasonic Scattering in Biological Tissues", CRC Press 1993 (backscatter).

Backscatter is the least certain: it spans decades between reports, and blood's depends on its flow. The amplitudes here
are relative to myocardium and right to the order of magnitude: blood about 25 dB below it, which is what makes chambers
nearly black in an image. Lung is what matters as a wall: nearly everything is reflected, and nothing comes back from
behind it; its attenuation (about 40 dB/cm/MHz) is cut to the scale's end, which is as black.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from cathxr.core import FloatArray

TABLE = "cathxr-tissues/1"
"""Named in heart.toml: which table an acoustic volume was made with."""


@dataclass(frozen=True)
class Tissue:
    """One tissue. density_kg_m3 and speed_m_s give the impedance.

    attenuation: dB/cm/MHz. scatter: amplitude of backscatter, myocardium is 1.
    """

    key: str
    density_kg_m3: float
    speed_m_s: float
    attenuation: float
    scatter: float

    @property
    def impedance_mrayl(self) -> float:
        """Density times speed of sound, MRayl."""
        return self.density_kg_m3 * self.speed_m_s * 1e-6


TISSUES: Mapping[str, Tissue] = MappingProxyType(
    {
        each.key: each
        for each in (
            Tissue("blood", 1050.0, 1578.0, 0.2, 0.055),
            Tissue("myocardium", 1081.0, 1561.0, 0.6, 1.0),
            Tissue("vessel_wall", 1102.0, 1569.0, 0.7, 1.2),
            Tissue("muscle", 1090.0, 1588.0, 0.7, 0.9),
            Tissue("pericardium", 1110.0, 1640.0, 1.2, 2.2),
            Tissue("fat", 911.0, 1440.0, 0.5, 1.4),
            Tissue("lung", 394.0, 949.0, 20.0, 0.5),
            Tissue("bone", 1908.0, 3515.0, 7.0, 1.0),
        )
    }
)
"""Every tissue by its key."""

_HU_KNOTS: tuple[tuple[float, str], ...] = (
    (-1024.0, "lung"),
    (-450.0, "lung"),
    (-150.0, "fat"),
    (-60.0, "fat"),
    (0.0, "muscle"),
    (110.0, "muscle"),
)
"""Between two knots the properties go over linearly: partial volumes lie there."""
_BONE_HU = 130.0
"""Where there is no contrast, bone begins well above muscle."""


def properties(tissues: list[str]) -> FloatArray:
    """Return (N, 3) of tissues by key: ln of the impedance in MRayl, attenuation dB/cm/MHz, scatter amplitude."""
    chosen = [TISSUES[each] for each in tissues]
    return np.array([[np.log(each.impedance_mrayl), each.attenuation, each.scatter] for each in chosen])


def hu_knots(blood_hu: float | None) -> tuple[FloatArray, FloatArray]:
    """Return CT numbers (N,) HU, rising, and the properties (N, 3) there; between them they are interpolated.

    blood_hu: the blood's median, None where no blood is labelled. Above muscle comes contrast-filled blood where the
    scan's blood is that bright, and bone above it. Spongy bone as bright as the blood is taken for blood: a number
    alone does not tell them apart.
    """
    knots = list(_HU_KNOTS)
    if blood_hu is None or blood_hu < _BONE_HU + 70.0:
        knots += [(_BONE_HU + 70.0, "bone")]
    else:
        low, high = 110.0 + 0.5 * (blood_hu - 110.0), 1.5 * blood_hu
        knots += [(low, "blood"), (high, "blood"), (high + 0.3 * blood_hu, "bone")]
    return np.array([each for each, _ in knots]), properties([each for _, each in knots])
