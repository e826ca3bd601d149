"""What the receiver makes of the echoes: beam width, envelope, ring, noise, amplification, compression to 8 bits."""

import math

import numba as nb
import numpy as np
import numpy.typing as npt

from cathxr.core import FloatArray
from cathxr.ultrasound.scatterers import UNIT, imaginary_part, lattice_key, mixed, real_part
from cathxr.ultrasound.settings import TGC_STOPS, IceSettings, Resolved

RING_DECAY_MM = 1.1
RING_PERIOD_MM = 0.9
_NOISE_LAYER = 0x3C6EF372
"""Keeps the receiver's noise apart from the scatterers, which use the same generator."""


def envelope(echo: FloatArray, settings: IceSettings, *, resolved: Resolved, seq: int) -> FloatArray:
    """Return the received envelope (lines, samples): blurred by the point spread function, with ring and noise.

    seq: which picture it is; the noise differs in each.
    """
    blurred = np.empty_like(echo)
    _blur(echo, resolved.axial, 1, blurred)
    received = np.empty_like(echo)
    _blur(blurred, resolved.lateral, 0, received)
    out = np.empty(echo.shape[:2])
    noise = 10.0 ** (settings.noise_db / 20.0) / UNIT
    _envelope(received, noise, seq, 10.0 ** (settings.ring_db / 20.0), resolved.sample_mm, out)
    return out


def amplification_db(settings: IceSettings) -> FloatArray:
    """Return gain and time gain compensation (samples,) in dB."""
    share = (np.arange(settings.samples) + 0.5) / settings.samples
    slope = settings.tgc_slope_db_cm_mhz * settings.frequency_mhz * settings.depth_mm / 10.0
    sliders = np.interp(share * (TGC_STOPS - 1), np.arange(TGC_STOPS), np.array(settings.tgc_db))
    return np.asarray(settings.gain_db + slope * share + sliders)


def compressed(received: FloatArray, settings: IceSettings) -> npt.NDArray[np.uint8]:
    """Return the grey levels (lines, samples): linear in dB over the dynamic range, below white_db."""
    level_db = 20.0 * np.log10(np.maximum(received, 1e-12)) + amplification_db(settings)
    share = 1.0 + (level_db - settings.white_db) / settings.dynamic_range_db
    return np.asarray(np.floor(255.0 * np.clip(share, 0.0, 1.0) + 0.5), np.uint8)


@nb.njit(cache=True, nogil=True)
def _blur(values: FloatArray, weights: FloatArray, axis: int, out: FloatArray) -> None:
    """Write the weighted mean along an axis; at the edges, of what is there."""
    lines, samples = values.shape[0], values.shape[1]
    radius = len(weights) - 1
    end = lines if axis == 0 else samples
    for line in range(lines):
        for sample in range(samples):
            at = line if axis == 0 else sample
            real, imaginary, total = 0.0, 0.0, 0.0
            for other in range(max(at - radius, 0), min(at + radius, end - 1) + 1):
                weight = weights[abs(other - at)]
                total += weight
                i, j = (other, sample) if axis == 0 else (line, other)
                real += weight * values[i, j, 0]
                imaginary += weight * values[i, j, 1]
            out[line, sample, 0] = real / total
            out[line, sample, 1] = imaginary / total


@nb.njit(cache=True, nogil=True)
def _envelope(received: FloatArray, noise: float, seq: int, ring: float, sample_mm: float, out: FloatArray) -> None:
    for line in range(received.shape[0]):
        for sample in range(received.shape[1]):
            h = mixed(mixed(lattice_key(line, sample, seq)) ^ np.uint32(_NOISE_LAYER))
            real = received[line, sample, 0] + noise * real_part(h)
            imaginary = received[line, sample, 1] + noise * imaginary_part(h)
            r = (sample + 0.5) * sample_mm
            rung = ring * math.exp(-r / RING_DECAY_MM) * (0.6 + 0.4 * math.cos(2.0 * math.pi * r / RING_PERIOD_MM))
            out[line, sample] = math.sqrt(real * real + imaginary * imaginary + rung * rung)
