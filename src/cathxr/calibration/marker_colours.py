"""What colour a spot has, whatever the light: hue in the plane across grey, after the picture's own white."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import cv2
import numpy as np

from cathxr.core import CalibrationError, FloatArray, Marker, PixelArray

HUES_DEG: Mapping[str, float] = MappingProxyType(
    {
        "red": 0.0,
        "orange": 30.0,
        "yellow": 57.0,
        "green": 125.0,
        "cyan": 187.0,
        "blue": 227.0,
        "magenta": 311.0,
    }
)
"""The colours that can be told apart, and their hue: the angle of `chroma`, 0 for red."""

_HUE_SIGMA_DEG = 20.0
_HUE_GATE_DEG = 50.0
_LEAST_SHARE = 0.08
"""A background covers at least this share of the picture; a colour on less of it may be a fiducial's own."""
_MOST_CAST = 2.2
_DARK_DN = 25
_BINS = 64
_SAMPLES = 16000


def check_colours(markers: Iterable[Marker]) -> None:
    """Return nothing; refuse markers whose colour cannot be found by colour.

    Raises:
        CalibrationError: a marker has another colour than those of `HUES_DEG`.
    """
    for marker in markers:
        if marker.colour not in HUES_DEG:
            known = ", ".join(HUES_DEG)
            raise CalibrationError(
                f"Marker {marker.name} has the colour {marker.colour!r}, which cannot be found by its hue. "
                f"Use fiducials of these colours: {known}; or place the markers by hand with --click."
            )


def chroma(colours: FloatArray) -> FloatArray:
    """Return (..., 2), the part of BGR colours (..., 3) across grey: along red, and along green minus blue."""
    blue, green, red = colours[..., 0], colours[..., 1], colours[..., 2]
    return np.stack([(2.0 * red - green - blue) / 6.0**0.5, (green - blue) / 2.0**0.5], axis=-1)


def hue_deg(colours: FloatArray) -> FloatArray:
    """Return the hue (...,), degrees from 0 to 360, of BGR colours (..., 3)."""
    plane = chroma(colours)
    return np.asarray(np.degrees(np.arctan2(plane[..., 1], plane[..., 0])) % 360.0)


def log_scores(hues_deg: FloatArray, colours: Iterable[str]) -> FloatArray:
    """Return (C, N): how well N hues fit each of C named colours, 0 the best, -inf where they do not."""
    nominal = np.array([HUES_DEG[each] for each in colours])
    off = np.abs((np.asarray(hues_deg)[None] - nominal[:, None] + 180.0) % 360.0 - 180.0)
    score = -0.5 * (off / _HUE_SIGMA_DEG) ** 2
    return np.where(off <= _HUE_GATE_DEG, score, -np.inf)


def nearest_colour(hue: float, colours: Iterable[str]) -> str:
    """Return the one of the named colours that a hue, degrees, is nearest to."""
    return min(colours, key=lambda each: abs((hue - HUES_DEG[each] + 180.0) % 360.0 - 180.0))


def white_of(pixels: PixelArray) -> FloatArray:
    """Return the colour (3,) BGR of what should be grey, its mean 1: the commonest tint of a picture (H, W, 3).

    Dark pixels say nothing; a background that is saturated in one colour still says what to tell markers from. Where no
    tint covers a fair share of the picture (dark backgrounds), or it is too strong for a colour cast, white is taken to
    be white.
    """
    step = max(1, int((pixels.shape[0] * pixels.shape[1] / _SAMPLES) ** 0.5))
    few = pixels[::step, ::step].reshape(-1, 3).astype(np.float32)
    use = few[(few.max(axis=1) > _DARK_DN) & (few.min(axis=1) > 4)]
    neutral = np.ones(3)
    if len(use) < _LEAST_SHARE * len(few):
        return neutral
    logs = np.log2(use[:, [0, 2]] / use[:, 1:2])
    reach = np.log2(_MOST_CAST)
    cell = np.floor((logs + reach) * (_BINS / (2.0 * reach))).astype(np.int64)
    cell = cell[((cell >= 0) & (cell < _BINS)).all(axis=1)]
    raw = np.bincount(cell[:, 0] * _BINS + cell[:, 1], minlength=_BINS * _BINS).reshape(_BINS, _BINS)
    counts = np.asarray(cv2.GaussianBlur(raw.astype(np.float32), (0, 0), 1.5))
    peak = np.array(np.unravel_index(int(counts.argmax()), counts.shape))
    at = (peak + 0.5) / _BINS * 2.0 * reach - reach
    for _ in range(3):
        close = (np.abs(logs - at) < 0.12).all(axis=1)
        if close.sum() < _LEAST_SHARE * len(few):
            return neutral
        at = np.median(logs[close], axis=0)
    white = np.array([2.0 ** at[0], 1.0, 2.0 ** at[1]])
    return np.asarray(white / white.mean(), dtype=np.float64)
