"""How much of the sound comes back: attenuation and interfaces along each line, for the way there and back."""

import math

import numba as nb
import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.ultrasound.field import AcousticField
from cathxr.ultrasound.plane import Beams
from cathxr.ultrasound.sampling import codes_at, packed
from cathxr.ultrasound.settings import IceSettings

_DB = 20.0 / math.log(10.0)


def two_way_loss_db(field: AcousticField, beams: Beams, settings: IceSettings) -> FloatArray:
    """Return the loss (loss_lines, loss_samples) in dB of an echo's amplitude from the middle of each range cell.

    Attenuation: 2 · alpha · f · dr. Interfaces: of an amplitude, 1 - R² passes both ways, R = tanh(change of ln Z / 2);
    the loss is spread over the width that the volume's smoothing gives the interface (its squared Gaussian slope has
    the area interface_mm / √2), whatever the angle of incidence.
    """
    out = np.zeros((settings.loss_lines, settings.loss_samples))
    _march(
        field.rgba,
        beams.packed,
        packed(field.scales),
        np.array([settings.sector_rad, settings.depth_mm, settings.apex_mm, settings.frequency_mhz]),
        field.interface_mm,
        out,
    )
    return out


@nb.njit(cache=True, nogil=True)
def _march(
    rgba: npt.NDArray[np.uint8],
    beams: FloatArray,
    scales: FloatArray,
    knobs: FloatArray,
    interface_mm: float,
    out: FloatArray,
) -> None:
    sector, depth, apex, frequency = knobs[0], knobs[1], knobs[2], knobs[3]
    lines, samples = out.shape
    step = depth / samples
    code = np.empty(4)
    for line in range(lines):
        angle = ((line + 0.5) / lines - 0.5) * sector
        across, along = math.sin(angle), math.cos(angle)
        passed = 0.0
        for sample in range(samples):
            reach = apex + (sample + 0.5) * step
            x, z = reach * along - apex, reach * across
            codes_at(
                rgba,
                beams[0] + x * beams[3] + z * beams[9],
                beams[1] + x * beams[4] + z * beams[10],
                beams[2] + x * beams[5] + z * beams[11],
                code,
            )
            attenuation = 0.2 * scales[1] * code[2] * code[2] * frequency
            half_jump = scales[2] * code[3] * code[3] * interface_mm
            reflected = 2.0 * _DB * math.log(math.cosh(half_jump)) * math.sqrt(2.0) / interface_mm * beams[12]
            lost = (attenuation + reflected) * step
            out[line, sample] = passed + 0.5 * lost
            passed += lost
