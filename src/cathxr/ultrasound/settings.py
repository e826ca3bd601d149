"""What the user of the machine sets, and what follows from it. web/src/ultrasound/settings.ts is its twin."""

import math
from dataclasses import dataclass

import numpy as np

from cathxr.core import FloatArray

SOUND_MM_US = 1.54
"""Speed of sound that every scanner assumes in tissue, mm/µs."""
FWHM = 2.3548200450309493
"""Full width at half maximum of a Gaussian, in standard deviations."""
LARGEST_RADIUS = 15
"""A point spread function never reaches further than this many samples or lines to a side."""
MOST_PARTS = 4
ELEVATION_LAYERS = {1: 1, 3: 4}
"""How many layers of scatterers across the image plane add up to a speckle, by the number of slices."""
TGC_STOPS = 8
_CORRELATION = 0.6198
"""Area of the scatterer field's mean autocorrelation, as the standard deviation of a Gaussian, in cells.

The integral is 1.5536 cells; divided by √(2π). tests/unit/ultrasound integrates it again.
"""


@dataclass(frozen=True)
class IceSettings:
    """Knobs of the machine. Angles in radians, lengths in mm.

    sector_rad: the whole sector. depth_mm: from the transducer's face. apex_mm: how far behind the face the lines meet.
    aperture_mm: length of the array, which sets the beam's width. gain_db: 0 shows myocardium near the transducer
    as mid-grey. tgc_slope_db_cm_mhz: amplification with depth, for the way there and back. tgc_db: the eight sliders,
    equally spaced from the face to the depth. myocardium_db: speckle of myocardium (scatter 1), relative to a perfect
    plane reflector (integrated backscatter is measured so). white_db: the echo, on the same scale, that is white at
    gain 0. incidence_power: n of cos^n in a wall's echo. noise_db, ring_db: of the receiver and of the near-field
    ring, on that scale too. slices: 1, or 3 for the beam's thickness across the image plane.
    """

    sector_rad: float = math.pi / 2.0
    depth_mm: float = 90.0
    frequency_mhz: float = 7.5
    gain_db: float = 0.0
    tgc_slope_db_cm_mhz: float = 0.4
    tgc_db: tuple[float, ...] = (0.0,) * TGC_STOPS
    dynamic_range_db: float = 50.0
    myocardium_db: float = -50.0
    white_db: float = -25.0
    noise_db: float = -102.0
    ring_db: float = -14.0
    incidence_power: float = 3.0
    apex_mm: float = 3.0
    aperture_mm: float = 7.0
    slices: int = 3
    lines: int = 192
    samples: int = 448
    loss_lines: int = 96
    loss_samples: int = 64

    def __post_init__(self) -> None:
        limits = {
            "sector_rad": (0.1, math.pi),
            "depth_mm": (10.0, 300.0),
            "frequency_mhz": (1.0, 20.0),
            "dynamic_range_db": (20.0, 120.0),
            "incidence_power": (1.0, 16.0),
            "apex_mm": (0.5, 100.0),
            "aperture_mm": (1.0, 30.0),
            "lines": (16, 1024),
            "samples": (32, 2048),
            "loss_lines": (8, 1024),
            "loss_samples": (8, 1024),
        }
        for name, (low, high) in limits.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name}: expected {low:g} to {high:g}, got {getattr(self, name)}")
        if self.slices not in (1, 3):
            raise ValueError(f"slices: expected 1 or 3, got {self.slices}")
        if len(self.tgc_db) != TGC_STOPS:
            raise ValueError(f"tgc_db: expected {TGC_STOPS} numbers, got {len(self.tgc_db)}")


@dataclass(frozen=True, eq=False)
class Resolved:
    """What follows from the settings; the shader gets the same numbers.

    line_rad, sample_mm: from one line or sample to the next. sigma_lateral_rad, sigma_axial_mm: the point spread
    function's standard deviations, of amplitude. cell_mm: the scatterers' lattice. lateral, axial: weights of the
    point spread function from its middle outwards, in lines and samples, not normalised.
    """

    line_rad: float
    sample_mm: float
    sigma_lateral_rad: float
    sigma_axial_mm: float
    cell_mm: float
    layers: int
    correlation_mm: float
    wall_mm: float
    lateral: FloatArray
    axial: FloatArray

    @classmethod
    def of(cls, settings: IceSettings) -> "Resolved":
        """Return what follows from the settings.

        Lateral: two-way beam of an unapodised array, full width at half maximum 0.9 wavelengths over the aperture.
        Axial: 1.5 wavelengths full width, and never so fine that the samples would miss it.
        """
        wavelength_mm = SOUND_MM_US / settings.frequency_mhz
        line_rad = settings.sector_rad / settings.lines
        sample_mm = settings.depth_mm / settings.samples
        lateral_rad = max(0.9 * wavelength_mm / settings.aperture_mm / FWHM, 0.7 * line_rad)
        axial_mm = max(1.5 * wavelength_mm / FWHM, 0.7 * sample_mm)
        cell_mm = max(1.5 * axial_mm, sample_mm)
        return cls(
            line_rad=line_rad,
            sample_mm=sample_mm,
            sigma_lateral_rad=lateral_rad,
            sigma_axial_mm=axial_mm,
            cell_mm=cell_mm,
            layers=ELEVATION_LAYERS[settings.slices],
            correlation_mm=_CORRELATION * cell_mm,
            wall_mm=max(0.45, 1.2 * sample_mm),
            lateral=_weights(lateral_rad / line_rad),
            axial=_weights(axial_mm / sample_mm),
        )


def _weights(sigma: float) -> FloatArray:
    """Return a Gaussian from its middle to three standard deviations, or to the largest radius."""
    radius = min(LARGEST_RADIUS, math.ceil(3.0 * sigma))
    return np.exp(-0.5 * np.square(np.arange(radius + 1) / sigma))
