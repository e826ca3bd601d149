"""Acoustic volumes whose echoes are known: planes, blocks and cylinders in front of a transducer at the origin.

The transducer is at (0, 0, 0) of `ct` and looks along x; the catheter's axis is z.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from cathxr.core import FloatArray
from cathxr.ultrasound import AcousticField, IceSettings

EDGE_VOXELS = 0.6
"""Standard deviation of an interface's profile, in voxels: what Scales.interface_voxels stands for."""
SPACING_MM = 1.0
COUNT = 96
_BEHIND_MM = 10.0

QUIET = IceSettings(noise_db=-200.0, ring_db=-200.0, slices=1, tgc_slope_db_cm_mhz=0.0, depth_mm=80.0)
"""Neither noise nor ring nor amplification nor thickness: what is left is the physics of one thin plane."""


def voxel_centres() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, y and z (K, J, I) mm of the voxels' centres."""
    k, j, i = np.mgrid[0:COUNT, 0:COUNT, 0:COUNT].astype(float)
    half = COUNT * SPACING_MM / 2.0
    return i * SPACING_MM - _BEHIND_MM, j * SPACING_MM - half, k * SPACING_MM - half


def ct_from_voxel() -> FloatArray:
    """Return the phantoms' matrix."""
    matrix = np.diag([SPACING_MM, SPACING_MM, SPACING_MM, 1.0])
    half = COUNT * SPACING_MM / 2.0
    matrix[:3, 3] = (-_BEHIND_MM, -half, -half)
    return matrix


def phantom(
    log_impedance: FloatArray | float = 0.0,
    scatter: FloatArray | float = 0.0,
    attenuation: FloatArray | float = 0.0,
) -> AcousticField:
    """Return a field of these properties (arrays (K, J, I) or numbers)."""
    shape = (COUNT, COUNT, COUNT)
    given = [np.broadcast_to(np.asarray(each, float), shape) for each in (log_impedance, scatter, attenuation)]
    return AcousticField.from_properties(*given, ct_from_voxel=ct_from_voxel())


def share_within(distance_mm: FloatArray) -> FloatArray:
    """Return 0 to 1 of a signed distance, inside positive, with the profile that an interface has in the volume."""
    return np.asarray(ndtr(distance_mm / (EDGE_VOXELS * SPACING_MM)))


def plane(ratio: float, at_mm: float, tilt_rad: float = 0.0) -> AcousticField:
    """Return a plane that meets the centre line at `at_mm`, behind which the impedance is `ratio` times as great."""
    x, _, z = voxel_centres()
    distance = (x - at_mm) * np.cos(tilt_rad) + z * np.sin(tilt_rad)
    return phantom(np.log(ratio) * share_within(distance))


def moved(x_mm: float = 0.0, z_mm: float = 0.0, y_mm: float = 0.0) -> FloatArray:
    """Return the pose of a transducer that was moved from the origin without turning."""
    pose = np.eye(4)
    pose[:3, 3] = (x_mm, y_mm, z_mm)
    return pose


def with_settings(**changes: object) -> IceSettings:
    """Return QUIET with changes."""
    change: Callable[..., IceSettings] = replace
    return change(QUIET, **changes)


def decibel(amplitude: FloatArray | float) -> FloatArray:
    """Return 20 log10."""
    return np.asarray(20.0 * np.log10(np.maximum(amplitude, 1e-30)))


def rms(values: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
