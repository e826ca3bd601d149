"""How physical values become the bytes of an acoustic volume, and back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.core.arrays import checked
from cathxr.heart.resample import Float32
from cathxr.heart.tissues import TABLE, TISSUES
from cathxr.heart.volume import Grid

CHANNELS = ("impedance", "scatter", "attenuation", "interface")
"""In the order R, G, B, A."""


@dataclass(frozen=True)
class Scale:
    """How a channel's byte gives a value; c is the byte / 255.

    square: value = high * c². asinh: value = centre * exp(width * sinh(low + c * (high - low))): about even steps of
    `width` in the logarithm near `centre`, and ever larger ones away from it.
    """

    curve: Literal["square", "asinh"]
    unit: str
    high: float
    low: float = 0.0
    centre: float = 1.0
    width: float = 1.0

    def value(self, byte: npt.ArrayLike) -> FloatArray:
        """Return the physical values of bytes."""
        code = np.asarray(byte, dtype=np.float64) / 255.0
        if self.curve == "square":
            return np.asarray(self.high * code**2)
        return np.asarray(self.centre * np.exp(self.width * np.sinh(self.low + code * (self.high - self.low))))

    def code(self, value: npt.ArrayLike) -> FloatArray:
        """Return the codes (0 to 1) of physical values; what is off the scale goes to its end."""
        values = np.asarray(value, dtype=np.float64)
        if self.curve == "square":
            return np.sqrt(np.clip(values / self.high, 0.0, 1.0))
        place = np.arcsinh(np.log(values / self.centre) / self.width)
        return np.clip((place - self.low) / (self.high - self.low), 0.0, 1.0)


def _impedance() -> Scale:
    """Return the scale of impedance: fine steps where soft tissues are, which differ by a few per cent only."""
    centre, width = TISSUES["blood"].impedance_mrayl, 0.03
    low, high = (float(np.arcsinh(np.log(TISSUES[key].impedance_mrayl / centre) / width)) for key in ("lung", "bone"))
    return Scale("asinh", "MRayl", round(high + 0.01, 4), round(low - 0.01, 4), round(centre, 4), width)


SCALES: Mapping[str, Scale] = MappingProxyType(
    {
        "impedance": _impedance(),
        "scatter": Scale("square", "amplitude, myocardium is 1", 2.5),
        "attenuation": Scale("square", "dB/cm/MHz", 20.0),
        "interface": Scale("square", "1/mm: half the gradient of ln(impedance)", 0.5),
    }
)
"""Every channel's scale: the same for every heart, and written into every heart.toml."""


@dataclass(frozen=True, eq=False)
class AcousticVolume:
    """An acoustic volume. rgba: uint8 (K, J, I, 4), read-only. ct_from_voxel (4, 4): (i, j, k, 1) to mm in `ct`.

    scales: by channel, see CHANNELS. table: which tissue table was used.
    """

    rgba: npt.NDArray[np.uint8]
    ct_from_voxel: FloatArray
    scales: Mapping[str, Scale]
    table: str = TABLE

    def __post_init__(self) -> None:
        if self.rgba.dtype != np.uint8 or self.rgba.ndim != 4 or self.rgba.shape[3] != 4:
            raise ValueError(f"rgba: expected uint8 (K, J, I, 4), got {self.rgba.dtype} {self.rgba.shape}")
        if set(self.scales) != set(CHANNELS):
            raise ValueError(f"scales: expected {', '.join(CHANNELS)}, got {', '.join(self.scales)}")
        self.rgba.setflags(write=False)
        object.__setattr__(self, "ct_from_voxel", checked("ct_from_voxel", self.ct_from_voxel, (4, 4)))
        object.__setattr__(self, "scales", MappingProxyType(dict(self.scales)))

    @property
    def grid(self) -> Grid:
        """The volume's grid."""
        shape = self.rgba.shape
        return Grid((shape[0], shape[1], shape[2]), self.ct_from_voxel)

    def physical(self, channel: str) -> FloatArray:
        """Return a channel's values (K, J, I) in its physical unit."""
        return self.scales[channel].value(self.rgba[..., CHANNELS.index(channel)])


def codes_of(properties: FloatArray) -> FloatArray:
    """Return (N, 4) of properties (N, 3; see `tissues.properties`): the codes of R, G and B, and ln(impedance)."""
    return np.stack(
        [
            SCALES["impedance"].code(np.exp(properties[:, 0])),
            SCALES["scatter"].code(properties[:, 2]),
            SCALES["attenuation"].code(properties[:, 1]),
            properties[:, 0],
        ],
        axis=1,
    )


def encoded(fields: Sequence[Float32], grid: Grid) -> AcousticVolume:
    """Return the acoustic volume of four fields (K, J, I) each: the codes of R, G and B, and ln(impedance)."""
    steps = [float(each) for each in grid.spacing_mm[::-1]]
    along = [np.gradient(fields[3], step, axis=axis) for axis, step in enumerate(steps)]
    steep = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2) / 2.0
    codes: list[npt.NDArray[np.floating]] = [*fields[:3], SCALES["interface"].code(steep)]
    rgba = np.stack([np.round(np.clip(each, 0.0, 1.0) * 255.0) for each in codes], axis=-1).astype(np.uint8)
    return AcousticVolume(rgba, grid.ct_from_voxel, SCALES)
