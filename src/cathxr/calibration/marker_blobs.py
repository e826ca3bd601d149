"""Coloured round spots of a picture: everything that might be a fiducial, each with its rim and its colour."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from cathxr.calibration import marker_kernels
from cathxr.calibration.marker_colours import chroma, hue_deg, white_of
from cathxr.calibration.marker_outline import Outline, outline_of
from cathxr.core import FloatArray, PixelArray
from cathxr.geometry import CameraModel

_LEAST_RADIUS_PX = 2.6
_MOST_RADIUS_SHARE = 0.09
"""Of the picture's width: larger spots are not fiducials."""
_SHARES = np.array([0.45, 0.7])
_COSINE = float(np.cos(np.deg2rad(32.0)))
_FLOOR_DN = 9.0
_BLOCK_PX = 6
_MOST_ELONGATED, _LEAST_COMPACT = 2.4, 0.72
_LEAST_RIM = 0.4
_MOST_SPOTS = 120
_NOISE_SIGMAS = 6.0


@dataclass(frozen=True, eq=False)
class Spot:
    """A coloured spot. centre_px (2,), sigma_px, radius_px: by its rim where it has one.

    colour_bgr (3,): its colour in the picture. direction (3,): along which in BGR it stands out from grey.
    strength: its greatest chroma, DN. why: why it cannot be a fiducial, "" where it can.
    """

    centre_px: FloatArray
    sigma_px: float
    radius_px: float
    colour_bgr: FloatArray
    strength: float
    direction: FloatArray
    outline: Outline | None = None
    why: str = ""

    @property
    def rim(self) -> Outline:
        """The outline of a spot that has one."""
        assert self.outline is not None
        return self.outline


@dataclass(frozen=True, eq=False)
class Spots:
    """The spots of one picture, strongest first, and what was taken for white in it (3,) BGR."""

    spots: tuple[Spot, ...]
    white: FloatArray


def find_spots(model: CameraModel, pixels: PixelArray) -> Spots:
    """Return the coloured spots of a picture (H, W, 3) BGR."""
    white = white_of(pixels)
    strength, plane = chroma_picture(pixels, white)
    noise = float(np.median(np.abs(strength[::4, ::4]))) / 0.8
    floor = max(_FLOOR_DN, _NOISE_SIGMAS * min(noise, 4.0))
    seeds = marker_kernels.peaks(strength, _BLOCK_PX, floor)
    order = np.argsort(-strength[seeds[:, 1], seeds[:, 0]], kind="stable")
    most = int(np.pi * (_MOST_RADIUS_SHARE * pixels.shape[1]) ** 2)
    table = marker_kernels.regions(strength, plane, seeds[order], _SHARES, _COSINE, most)
    spots = [spot for row in table if (spot := _spot(row, white, pixels)) is not None]
    spots = _without_doubles([_measured(model, pixels, spot) for spot in spots[:_MOST_SPOTS]])
    return Spots(tuple(spots), white)


def spot_at(model: CameraModel, pixels: PixelArray, place_px: FloatArray, *, reach_px: float) -> Spot | None:
    """Return the round coloured spot that covers place_px (2,) or comes within reach_px of it, None where none does."""
    near = [spot for spot in find_spots(model, pixels).spots if spot.outline is not None and not spot.why]
    gaps = [float(np.hypot(*(spot.centre_px - place_px))) - spot.radius_px for spot in near]
    best = int(np.argmin(gaps)) if gaps else -1
    return near[best] if best >= 0 and gaps[best] <= reach_px else None


def chroma_picture(pixels: PixelArray, white: FloatArray) -> tuple[marker_kernels.Float32, marker_kernels.Float32]:
    """Return (strength (H, W), plane (H, W, 2)): how far from grey each pixel is, lightly smoothed, and which way."""
    soft = cv2.GaussianBlur(pixels, (0, 0), 1.0) if min(pixels.shape[:2]) > 8 else pixels
    return marker_kernels.chroma_of(np.asarray(soft, dtype=np.uint8), _across_grey(white))


def _across_grey(white: FloatArray) -> FloatArray:
    """Return (2, 3), what takes a BGR colour to its chroma where `white` (3,) is taken for white."""
    return np.asarray(chroma(np.eye(3)).T / white)


def _spot(row: FloatArray, white: FloatArray, pixels: PixelArray) -> Spot | None:
    """Return a region as a spot, None where it is a speck."""
    area, xx, xy, yy = row[1], row[4], row[5], row[6]
    radius = float(np.sqrt(area / np.pi))
    if radius < _LEAST_RADIUS_PX:
        return None
    plane = np.array(row[7:9])
    towards = plane / np.hypot(*plane)
    # What the white-balanced, opponent axes of `chroma_picture` make of BGR, along this spot's own hue.
    direction = towards @ _across_grey(white)
    centre = np.array(row[2:4])
    size = np.linalg.eigvalsh(np.array([[xx, xy], [xy, yy]]) + np.eye(2) / 12.0)
    compact = area / (4.0 * np.pi * np.sqrt(size[0] * size[1]))
    why = ""
    height, width = pixels.shape[:2]
    if np.sqrt(size[1] / size[0]) > _MOST_ELONGATED or compact < _LEAST_COMPACT:
        why = "not round"
    elif (centre < 1.2 * radius + 2.0).any() or (centre > (width, height) - np.array(1.2 * radius + 3.0)).any():
        why = "cut off by the picture's edge"
    return Spot(centre, 0.5 * radius, radius, _mean_colour(pixels, centre, radius), float(row[0]), direction, None, why)


def _measured(model: CameraModel, pixels: PixelArray, spot: Spot) -> Spot:
    """Return the spot with its rim."""
    if spot.why:
        return spot
    rim = outline_of(model, pixels, spot.centre_px, radius_px=spot.radius_px, direction=spot.direction)
    if rim is None or rim.share < _LEAST_RIM:
        return replace(spot, why="no round rim")
    return replace(spot, centre_px=rim.centre_px, sigma_px=rim.sigma_px, radius_px=rim.radius_px, outline=rim)


def _without_doubles(spots: list[Spot]) -> list[Spot]:
    """Return the spots but for those inside a stronger one that has a rim."""
    kept: list[Spot] = []
    for spot in spots:
        inside = any(
            other.outline is not None and np.hypot(*(other.centre_px - spot.centre_px)) < 0.7 * other.radius_px
            for other in kept
        )
        if not inside:
            kept.append(spot)
    return kept


def hues(spots: Spots, *, white: FloatArray) -> FloatArray:
    """Return the spots' hues (N,), degrees, where `white` (3,) BGR is taken for white."""
    if not spots.spots:
        return np.empty(0)
    return hue_deg(np.stack([spot.colour_bgr for spot in spots.spots]) / white)


def _mean_colour(pixels: PixelArray, centre_px: FloatArray, radius_px: float) -> FloatArray:
    """Return the median colour (3,) BGR of the inner part of a spot."""
    reach = max(1, round(0.55 * radius_px))
    x, y = (round(float(each)) for each in centre_px)
    patch = pixels[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1].reshape(-1, 3)
    return np.asarray(np.median(patch, axis=0), dtype=np.float64)
