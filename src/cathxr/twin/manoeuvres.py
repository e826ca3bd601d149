"""Scripted manoeuvres: named, smooth, made from a seed."""

import zlib
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from cathxr.core import FloatArray
from cathxr.twin.motion import Harmonics, Modulated, Motion

_Maker = Callable[[np.random.Generator], Motion]


def _waves(
    rng: np.random.Generator, base: FloatArray, amplitude: FloatArray, *, periods_s: tuple[float, float]
) -> Harmonics:
    """Return two sine waves per control that together stay within `amplitude` (4,) of `base` (4,).

    periods_s: of the slow wave, shortest and longest; the other is about half as long.
    """
    slow = rng.uniform(*periods_s, size=4)
    quick = slow * rng.uniform(0.45, 0.6, size=4)
    share = rng.uniform(0.6, 0.75, size=4)
    return Harmonics(
        base,
        np.stack([share * amplitude, (1.0 - share) * amplitude]),
        2.0 * np.pi / np.stack([slow, quick]),
        rng.uniform(0.0, 2.0 * np.pi, size=(2, 4)),
    )


def _pose(
    rng: np.random.Generator, *, insertion: tuple[float, float], roll: float, flexion: tuple[float, float]
) -> FloatArray:
    """Return controls (4,) with an insertion in a range, a roll within ±roll, and a flexion in a range to any side."""
    side = rng.uniform(0.0, 2.0 * np.pi)
    size = rng.uniform(*flexion)
    return np.array([rng.uniform(*insertion), rng.uniform(-roll, roll), size * np.cos(side), size * np.sin(side)])


def _smooth(rng: np.random.Generator) -> Motion:
    base = _pose(rng, insertion=(68.0, 78.0), roll=60.0, flexion=(0.0, 30.0))
    return _waves(rng, base, np.array([22.0, 100.0, 50.0, 35.0]), periods_s=(8.0, 14.0))


def _fast(rng: np.random.Generator) -> Motion:
    base = _pose(rng, insertion=(70.0, 78.0), roll=60.0, flexion=(0.0, 20.0))
    return _waves(rng, base, np.array([22.0, 60.0, 48.0, 36.0]), periods_s=(2.1, 3.0))


def _quick(rng: np.random.Generator) -> Motion:
    # The tip reaches 140 to 200 mm/s: the upper end of what a trainee's hand does.
    base = _pose(rng, insertion=(70.0, 78.0), roll=60.0, flexion=(0.0, 20.0))
    return _waves(rng, base, np.array([22.0, 60.0, 48.0, 36.0]), periods_s=(1.75, 2.4))


def _still(rng: np.random.Generator) -> Motion:
    return Harmonics.held(_pose(rng, insertion=(70.0, 95.0), roll=180.0, flexion=(20.0, 70.0)))


def _rest(rng: np.random.Generator) -> Motion:
    return Harmonics.held(_pose(rng, insertion=(25.0, 35.0), roll=20.0, flexion=(0.0, 5.0)))


def _curl(rng: np.random.Generator) -> Motion:
    base = _pose(rng, insertion=(84.0, 94.0), roll=180.0, flexion=(215.0, 225.0))
    share = base[2:] / np.linalg.norm(base[2:])
    return _waves(rng, base, np.array([12.0, 40.0, *np.abs(45.0 * share)]), periods_s=(8.0, 14.0))


def _crossing(rng: np.random.Generator) -> Motion:
    # Bent by more than a half turn with much of the body out: the end passes over the body in one view after the other.
    base = _pose(rng, insertion=(100.0, 108.0), roll=180.0, flexion=(245.0, 255.0))
    return _waves(rng, base, np.array([8.0, 90.0, 8.0, 8.0]), periods_s=(8.0, 14.0))


def _full_range(rng: np.random.Generator) -> Motion:
    base = np.array([62.0, 0.0, 0.0, 0.0])
    return _waves(rng, base, np.array([56.0, 40.0, 20.0, 20.0]), periods_s=(12.0, 18.0))


def _at_a_camera(rng: np.random.Generator) -> Motion:
    # Anterior flexion points along -y (front camera) at roll 0 and along +z (top camera) at roll -90.
    base = np.array([rng.uniform(72.0, 84.0), rng.choice([0.0, -90.0]), 90.0, 0.0])
    return _waves(rng, base, np.array([10.0, 20.0, 20.0, 12.0]), periods_s=(8.0, 14.0))


def _insertion(rng: np.random.Generator) -> Motion:
    base = np.array([65.0, rng.uniform(-90.0, 90.0), rng.uniform(10.0, 40.0), 0.0])
    return _waves(rng, base, np.array([35.0, 0.0, 0.0, 0.0]), periods_s=(8.0, 12.0))


def _roll(rng: np.random.Generator) -> Motion:
    base = np.array([rng.uniform(75.0, 90.0), 0.0, rng.uniform(40.0, 60.0), 0.0])
    return _waves(rng, base, np.array([0.0, 180.0, 0.0, 0.0]), periods_s=(8.0, 12.0))


def _flexion(rng: np.random.Generator) -> Motion:
    base = np.array([rng.uniform(75.0, 90.0), rng.uniform(-90.0, 90.0), 0.0, 0.0])
    return _waves(rng, base, np.array([0.0, 0.0, 100.0, 60.0]), periods_s=(7.0, 12.0))


def _timing(rng: np.random.Generator) -> Motion:
    # The bent tip goes to and fro along x, which both cameras see, and swings with the roll, which the encoder reads:
    # each in its own rhythm, between 0.4 and 1 Hz and never quite the same, so that only one delay fits.
    base = np.array([rng.uniform(74.0, 80.0), rng.choice([-135.0, -45.0, 45.0, 135.0]), rng.uniform(55.0, 75.0), 0.0])
    return Modulated(
        base=base,
        amplitude=np.array([11.0, 42.0, 0.0, 0.0]),
        pulsation=2.0 * np.pi * np.array([rng.uniform(0.68, 0.72), rng.uniform(0.58, 0.62), 0.5, 0.5]),
        depth=np.array([0.4, 0.36, 0.0, 0.0]),
        swing=2.0 * np.pi / np.array([rng.uniform(5.0, 6.0), rng.uniform(6.5, 7.5), 9.0, 9.0]),
        phase=rng.uniform(0.0, 2.0 * np.pi, size=4),
    )


_MAKERS: Mapping[str, _Maker] = MappingProxyType(
    {
        "smooth": _smooth,
        "insertion": _insertion,
        "roll": _roll,
        "flexion": _flexion,
        "fast": _fast,
        "quick": _quick,
        "curl": _curl,
        "crossing": _crossing,
        "full_range": _full_range,
        "at_a_camera": _at_a_camera,
        "still": _still,
        "rest": _rest,
        "timing": _timing,
    }
)
NAMES: tuple[str, ...] = tuple(_MAKERS)


def script(name: str, *, seed: int) -> Motion:
    """Return the named manoeuvre of a seed; time zero is the world's start.

    Raises:
        ValueError: no such manoeuvre.
    """
    if name not in _MAKERS:
        raise ValueError(f"manoeuvre: expected one of {', '.join(NAMES)}, got {name!r}")
    return _MAKERS[name](np.random.default_rng([seed, zlib.crc32(name.encode())]))
