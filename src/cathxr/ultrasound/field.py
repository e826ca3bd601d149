"""The acoustic volume: four coded properties of the tissue at every voxel, and what the codes mean."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.core.arrays import checked

_MOST = 255.0


@dataclass(frozen=True)
class Scales:
    """How bytes become physical units; c = byte / 255, decoded after trilinear interpolation.

    R: ln(Z / impedance_centre) = width · sinh(low + c · (high - low)): fine steps near blood, lung and bone inside.
    G: scatter = scatter_max · c², amplitude of the speckle, myocardium is 1.
    B: attenuation = attenuation_max · c², dB/cm/MHz, one way.
    A: half the gradient of ln Z = interface_max · c², per mm: the reflection coefficient, spread over the interface.
    interface_voxels: a plane step's reflection divided by the peak of A there: how many voxels wide the volume's
    smoothing has made an interface.
    """

    impedance_centre_mrayl: float = 1.6569
    impedance_width: float = 0.03
    impedance_low: float = -4.6077
    impedance_high: float = 4.545
    scatter_max: float = 2.5
    attenuation_max_db_cm_mhz: float = 20.0
    interface_max_per_mm: float = 0.5
    interface_voxels: float = 2.35

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and (value > 0.0 or name == "impedance_low")):
                raise ValueError(f"{name}: expected a positive number, got {value}")
        if self.impedance_low >= self.impedance_high:
            raise ValueError("impedance_low: expected a number below impedance_high")

    def code_log_impedance(self, log_ratio: npt.ArrayLike) -> FloatArray:
        """Return the code c (0 to 1) of ln(Z / impedance_centre); what is off the scale goes to its end."""
        place = np.arcsinh(np.asarray(log_ratio, float) / self.impedance_width)
        return np.asarray(np.clip((place - self.impedance_low) / (self.impedance_high - self.impedance_low), 0.0, 1.0))

    def log_impedance(self, code: npt.ArrayLike) -> FloatArray:
        """Return ln(Z / impedance_centre) of a code c (0 to 1): the inverse of `code_log_impedance`."""
        place = self.impedance_low + np.asarray(code, float) * (self.impedance_high - self.impedance_low)
        return np.asarray(self.impedance_width * np.sinh(place))


@dataclass(frozen=True, eq=False)
class AcousticField:
    """An acoustic volume. rgba: uint8 (K, J, I, 4), read-only: R impedance, G scatter, B attenuation, A interface.

    ct_from_voxel (4, 4): (i, j, k, 1) of a voxel's centre to mm in `ct`. Outside, the nearest voxel holds.

    Raises:
        ValueError: another shape or type of array, or a matrix that is not finite or cannot be inverted.
    """

    rgba: npt.NDArray[np.uint8]
    ct_from_voxel: FloatArray
    scales: Scales = Scales()

    def __post_init__(self) -> None:
        if self.rgba.dtype != np.uint8 or self.rgba.ndim != 4 or self.rgba.shape[3] != 4:
            raise ValueError(f"rgba: expected uint8 (K, J, I, 4), got {self.rgba.dtype} {self.rgba.shape}")
        rgba = np.ascontiguousarray(self.rgba)
        rgba.setflags(write=False)
        object.__setattr__(self, "rgba", rgba)
        matrix = checked("ct_from_voxel", self.ct_from_voxel, (4, 4))
        if abs(float(np.linalg.det(matrix[:3, :3]))) < 1e-9:
            raise ValueError("ct_from_voxel: expected a matrix that can be inverted")
        object.__setattr__(self, "ct_from_voxel", matrix)

    @property
    def spacing_mm(self) -> FloatArray:
        """Distance between voxel centres along i, j and k: (3,) mm."""
        return np.asarray(np.linalg.norm(self.ct_from_voxel[:3, :3], axis=0))

    @property
    def interface_mm(self) -> float:
        """How wide the volume's smoothing has made an interface, mm."""
        return self.scales.interface_voxels * float(np.mean(self.spacing_mm))

    @classmethod
    def from_properties(
        cls,
        log_impedance: npt.ArrayLike,
        scatter: npt.ArrayLike,
        attenuation_db_cm_mhz: npt.ArrayLike,
        *,
        ct_from_voxel: FloatArray,
        scales: Scales | None = None,
    ) -> "AcousticField":
        """Return the volume of these properties (K, J, I); the interfaces are taken from ln(Z / impedance_centre).

        Values beyond a scale's end are clamped to it. `log_impedance` should be smooth over about two voxels.
        """
        of = scales or Scales()
        log_ratio = np.asarray(log_impedance, float)
        spacing = np.linalg.norm(np.asarray(ct_from_voxel, float)[:3, :3], axis=0)
        slopes = np.gradient(log_ratio, *spacing[::-1])
        interface = 0.5 * np.sqrt(np.sum(np.square(slopes), axis=0))
        codes = [
            of.code_log_impedance(log_ratio),
            np.sqrt(np.clip(np.asarray(scatter, float) / of.scatter_max, 0.0, 1.0)),
            np.sqrt(np.clip(np.asarray(attenuation_db_cm_mhz, float) / of.attenuation_max_db_cm_mhz, 0.0, 1.0)),
            np.sqrt(np.clip(interface / of.interface_max_per_mm, 0.0, 1.0)),
        ]
        coded = np.stack([np.broadcast_to(each, log_ratio.shape) for each in codes], axis=-1)
        return cls(np.rint(coded * _MOST).astype(np.uint8), np.asarray(ct_from_voxel, float), of)
