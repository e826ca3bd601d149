"""Smoothness of the tip's speed: SPARC and LDLJ. Both are negative; nearer to zero is smoother.

Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet: "On the analysis of movement smoothness", Journal of
NeuroEngineering and Rehabilitation 12:112, 2015.
"""

from collections.abc import Callable

import numpy as np

from cathxr.core import FloatArray
from cathxr.training.metrics.measure import Measure, Run, none
from cathxr.training.metrics.motion import Motion, even

_OfTip = Callable[[FloatArray, float], float]
_CUTOFF_HZ = 10.0
_THRESHOLD = 0.05
_PADDING = 4
_LEAST_SAMPLES = 8
_LEAST_MM = 5.0
_ONSET = 0.05
"""A movement goes from the first to the last sample at this share of its greatest speed: rest does not count."""


def sparc(speed: FloatArray, rate_hz: float) -> float:
    """Return the spectral arc length of a speed profile (N,), negative, without unit.

    The magnitude spectrum, zero-padded to 2^4 times the next power of two and scaled to its greatest value, between the
    first and the last frequency up to 10 Hz at which it is at least 0.05; its arc length, that band's width taken as 1.

    Raises:
        ValueError: fewer than 2 samples, or no speed at all.
    """
    values = np.asarray(speed, dtype=np.float64)
    if len(values) < 2 or not np.abs(values).max() > 0.0:
        raise ValueError("speed: expected at least 2 samples of something that moves")
    size = 2 ** (int(np.ceil(np.log2(len(values)))) + _PADDING)
    magnitude = np.abs(np.fft.rfft(values, size))
    frequency = np.fft.rfftfreq(size, 1.0 / rate_hz)
    magnitude = (magnitude / magnitude.max())[frequency <= _CUTOFF_HZ]
    strong = np.flatnonzero(magnitude >= _THRESHOLD)
    band = magnitude[strong[0] : strong[-1] + 1]
    if len(band) < 2:
        raise ValueError("speed: expected a spectrum that is wider than one line")
    return float(-np.hypot(1.0 / (len(band) - 1), np.diff(band)).sum())


def ldlj(velocity: FloatArray, rate_hz: float) -> float:
    """Return the log dimensionless jerk of a velocity (N, D) or a speed (N,), without unit.

    -ln(T^3 / v_peak^2 * integral of |d2v/dt2|^2 dt), T = N / rate, second differences: the definition for discrete
    samples that the authors' own implementation uses.

    Raises:
        ValueError: fewer than 3 samples, no speed, or no jerk at all.
    """
    values = np.asarray(velocity, dtype=np.float64).reshape(len(velocity), -1)
    if len(values) < 3:
        raise ValueError(f"velocity: expected at least 3 samples, got {len(values)}")
    jerk = np.diff(values, n=2, axis=0) * rate_hz**2
    cost = float((jerk**2).sum()) / rate_hz
    peak = float((values**2).sum(axis=1).max())
    if not (peak > 0.0 and cost > 0.0):
        raise ValueError("velocity: expected a motion that speeds up or slows down")
    return float(-np.log((len(values) / rate_hz) ** 3 / peak * cost))


def mean_sparc(run: Run) -> Measure:
    """Return the mean SPARC of the movements' speed."""
    return _mean(run, lambda tip, rate: sparc(np.linalg.norm(np.diff(tip, axis=0), axis=1) * rate, rate))


def mean_ldlj(run: Run) -> Measure:
    """Return the mean LDLJ of the movements' velocity."""
    return _mean(run, lambda tip, rate: ldlj(np.diff(tip, axis=0) * rate, rate))


def _mean(run: Run, function: _OfTip) -> Measure:
    """Return a function's mean over the movements that are long enough and move at all."""
    if not run.movements:
        return none("no target was reached in full sight")
    values = [value for each in run.movements if (value := _value(each, function)) is not None]
    if not values:
        return none("every movement was shorter than 5 mm, too short to tell its smoothness")
    return Measure(float(np.mean(values)))


def _value(motion: Motion, function: _OfTip) -> float | None:
    tip, rate = even(next(iter(motion.segments())))
    steps = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    if steps.sum() < _LEAST_MM:
        return None
    moving = np.flatnonzero(steps >= _ONSET * steps.max())
    tip = tip[moving[0] : moving[-1] + 2]
    return function(tip, rate) if len(tip) > _LEAST_SAMPLES else None
