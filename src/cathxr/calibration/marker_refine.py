"""The centre of a named ball or disc, corrected for shading: a ball lit from one side looks shifted towards the light.

The edge operator is applied to a model of each ray's section (matt shading, lens blur) just as to the picture; what it
gives there, less the modelled rim, is taken off. Colour alone, full contrast, and brightness alone (which cameras that
compress colour keep sharp) are tried, and the surest is kept.
"""

from dataclasses import replace

import numpy as np

from cathxr.calibration import marker_shading_kernels as kernels
from cathxr.calibration.marker_blobs import Spot
from cathxr.calibration.marker_outline import ball_through
from cathxr.core import FloatArray, PixelArray
from cathxr.geometry import CameraModel

_STEP_PX = 0.5
_BLURS_PX = np.array([0.45, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0])
_ROUNDS = 2
_COLOUR, _CONTRAST, _BRIGHTNESS = 0, 1, 2
_SHARP_PX = 0.035
"""A rim as sure as this needs no third look."""
_LEAST_SHARE = 0.58
_LEFT, _LEFT_PX, _DISAGREEMENT, _PARTIAL = 0.02, 1.0, 0.5, 0.03


def refined(
    model: CameraModel,
    pixels: PixelArray,
    spot: Spot,
    *,
    place_px: FloatArray,
    reach_px: float,
    half_angle_rad: float | None = None,
) -> Spot | None:
    """Return the spot with its rim, centre and sigma corrected for shading, None: none within reach of its place.

    place_px (2,): where the other markers put it; half_angle_rad: its size, where known.
    """
    found = [_refined(model, pixels, spot, mode, half_angle_rad) for mode in (_COLOUR, _CONTRAST)]
    if min((each.sigma_px for each in found if each is not None), default=np.inf) > _SHARP_PX:
        found.append(_refined(model, pixels, spot, _BRIGHTNESS, half_angle_rad))
    near = [each for each in found if each is not None and _gap(each.centre_px, place_px) < reach_px]
    good = sorted(near, key=lambda each: each.sigma_px)
    if not good:
        return None
    best = good[0]
    moved = _gap(best.centre_px, spot.centre_px)
    # What is left of shading that is not quite matt, and of what the three ways to look disagree about.
    others = [
        float(np.hypot(*(each.centre_px - best.centre_px))) for each in good[1:] if each.sigma_px < 2 * best.sigma_px
    ]
    doubt = max([(_LEFT + _LEFT_PX / best.radius_px) * moved, *(_DISAGREEMENT * each for each in others)])
    doubt += _PARTIAL * best.radius_px * (1.0 - best.rim.share)
    return replace(best, sigma_px=float(np.hypot(best.sigma_px, doubt)))


def _refined(
    model: CameraModel, pixels: PixelArray, spot: Spot, mode: int, half_angle_rad: float | None
) -> Spot | None:
    x, y = (float(each) for each in spot.centre_px)
    radius, found = spot.radius_px, None
    count = int(np.clip(2.0 * np.pi * radius, 36, 160))
    for _ in range(_ROUNDS):
        reach = min(0.12 * radius + 2.5, radius - 0.5)
        points, corrected = np.empty((count, 6)), np.empty((count, 4))
        kernels.rim_towards(pixels, spot.direction, mode, x, y, radius, reach, _STEP_PX, points)
        light = kernels.shading(pixels, x, y, radius, spot.direction)
        kernels.corrected(points, light, radius, reach, _STEP_PX, _BLURS_PX, corrected)
        gate = max(0.7, 0.06 * radius)
        rim = ball_through(model, corrected, gate_px=gate, half_angle_rad=half_angle_rad)
        if rim is None or rim.share < _LEAST_SHARE or _gap(rim.centre_px, spot.centre_px) > 0.5 * spot.radius_px:
            return None
        found, (x, y), radius = rim, rim.centre_px, rim.radius_px
    if found is None:
        return None
    return replace(spot, centre_px=found.centre_px, sigma_px=found.sigma_px, radius_px=radius, outline=found)


def _gap(first: FloatArray, second: FloatArray) -> float:
    return float(np.hypot(*(first - second)))
