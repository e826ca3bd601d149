"""How different a picture is from what its background alone would show: brightness and colour apart, per pixel."""

from dataclasses import dataclass
from typing import Any, TypeVar, cast

import cv2
import numpy as np
from numba import njit

from cathxr.core import PixelArray
from cathxr.vision.segmentation import MatteArray

AnyPicture = TypeVar("AnyPicture", PixelArray, MatteArray)

COARSE_WIDTH = 640
"""The first guess works on pictures about this wide: a 4F catheter is then still over two pixels across."""
SATURATED = np.float32(250.0)


@dataclass(frozen=True)
class Weights:
    """How much of a brightness change counts, beside a change of colour.

    plain: on a grey background. shade: on a coloured one, for a change that a shadow or a reflection could make.
    """

    plain: float
    shade: float


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")  # type: ignore[misc, unused-ignore]
def pixel_difference(p0: Any, p1: Any, p2: Any, e0: Any, e1: Any, e2: Any, plain: Any, shade: Any) -> Any:
    """Return the difference of one pixel, three float32 levels, from the three expected: see `difference`.

    Without branches, and with one division: most of a picture's pixels come through here.
    """
    p0 = e0 if (e0 >= SATURATED) & (p0 > e0) else p0
    p1 = e1 if (e1 >= SATURATED) & (p1 > e1) else p1
    p2 = e2 if (e2 >= SATURATED) & (p2 > e2) else p2
    expected = max(e0 * e0 + e1 * e1 + e2 * e2, np.float32(1.0))
    both = p0 * e0 + p1 * e1 + p2 * e2
    o0, o1, o2 = p0 - e0, p1 - e1, p2 - e2
    high = max(e0, e1, e2)
    coloured = high - min(e0, e1, e2) > np.float32(0.25) * high
    shaded = (both > np.float32(0.45) * expected) & (both < np.float32(1.25) * expected)
    weight = shade if coloured & shaded else plain
    change = both - expected  # of brightness, times the level expected
    unweighted = (np.float32(1.0) - weight * weight) * change * change / expected
    square = o0 * o0 + o1 * o1 + o2 * o2 - unweighted
    return np.sqrt(max(square, np.float32(0.0)) * np.float32(1.0 / 3.0))


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")  # type: ignore[misc, unused-ignore]
def difference(picture: Any, expected: Any, plain: float, shade: float) -> Any:
    """Return the difference float32 (H, W), grey levels, between a picture and what is expected, both uint8 (H, W, C).

    Of each pixel the part that a mere change of brightness explains, picture = s * expected, counts `plain` on a grey
    background; on a coloured one `shade` where a shadow could have made it (s from 0.45 to 1.25). The rest is a change
    of colour and counts fully. Where the expected value is saturated the true one may be anything above, so that only
    darker is different. C is 1 or 3.
    """
    rows, columns, channels = picture.shape
    result = np.empty((rows, columns), dtype=np.float32)
    last = channels - 1
    middle = last // 2
    greyed, shaded = np.float32(plain), np.float32(shade)
    for i in range(rows):
        for j in range(columns):
            e0 = np.float32(expected[i, j, 0])
            e1 = np.float32(expected[i, j, middle])
            e2 = np.float32(expected[i, j, last])
            p0 = np.float32(picture[i, j, 0])
            p1 = np.float32(picture[i, j, middle])
            p2 = np.float32(picture[i, j, last])
            result[i, j] = pixel_difference(p0, p1, p2, e0, e1, e2, greyed, shaded)
    return result


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")  # type: ignore[misc, unused-ignore]
def standing_out(values: Any, expected: Any, edges: Any, noise: float, relative: float) -> Any:
    """Return a difference image (H, W), grey levels, in sigmas of noise, of a share of the level and of shifted edges.

    expected uint8 (H, W, C), edges float32 (H, W) grey levels that a small shift of the background may make.
    """
    rows, columns, channels = expected.shape
    result = np.empty((rows, columns), dtype=np.float32)
    for i in range(rows):
        for j in range(columns):
            level = np.float32(0.0)
            for k in range(channels):
                level = max(level, np.float32(expected[i, j, k]))
            level = level * np.float32(relative)
            edge = edges[i, j]
            result[i, j] = values[i, j] / np.sqrt(np.float32(noise * noise) + level * level + edge * edge)
    return result


def reduced(pixels: PixelArray, step: int) -> PixelArray:
    """Return the picture uint8 (H // step, W // step, C), each pixel the mean of `step` x `step`."""
    height, width = pixels.shape[:2]
    cropped = pixels[: height // step * step, : width // step * step]
    small = cv2.resize(cropped, (width // step, height // step), interpolation=cv2.INTER_AREA)
    return with_channels(np.asarray(small, dtype=np.uint8))


def sampled(pixels: PixelArray, factor: int) -> PixelArray:
    """Return a picture as `reduced` does, uint8 (H // factor, W // factor, C), each pixel the mean of four samples.

    A large picture is read in few places only. factor is at least 2, and even.
    """
    height, width = pixels.shape[:2]
    half = factor // 2
    rows, columns = height // factor * factor, width // factor * factor
    return reduced(np.ascontiguousarray(pixels[half // 2 : rows : half, half // 2 : columns : half]), 2)


def with_channels(pixels: PixelArray) -> PixelArray:
    """Return the picture with a channel axis, (H, W, C); a grey one has one channel."""
    return pixels if pixels.ndim == 3 else pixels[..., None]


def lit(background: PixelArray, gain: MatteArray, factor: int, corner: tuple[int, int]) -> PixelArray:
    """Return what a block of a background uint8 (H, W, C) shows under a gain given on pixels `factor` times as large.

    gain float32 (h, w, C) of the whole picture; corner: the block's first row and column. A saturated background pixel
    may truly be any amount brighter, so that it stays saturated.
    """
    block = enlarged(gain, factor, (background.shape[0], background.shape[1]), corner)
    bright = with_channels(np.asarray(cv2.multiply(background, block, dtype=cv2.CV_8U), dtype=np.uint8))
    floor = np.asarray(
        cv2.threshold(background, int(SATURATED) - 1, int(SATURATED), cv2.THRESH_BINARY)[1], dtype=np.uint8
    )
    return np.maximum(bright, with_channels(floor))


def enlarged(small: AnyPicture, factor: int, shape: tuple[int, int], corner: tuple[int, int]) -> AnyPicture:
    """Return a block of `shape` (rows, columns) of a reduced picture (h, w, C), enlarged smoothly by `factor`.

    corner: the block's first row and column at the enlarged size. Centres match: pixel i of the reduced picture covers
    pixels i * factor to (i + 1) * factor - 1. Beyond the reduced picture its edge repeats.
    """
    spans = []
    for first, count, size in zip(corner, shape, small.shape[:2], strict=True):
        low = min(max(0, first // factor - 1), size - 1)
        spans.append((low, max(low + 1, min(size, -(-(first + count) // factor) + 1))))
    (top, bottom), (left, right) = spans
    block = cv2.resize(
        small[top:bottom, left:right],
        ((right - left) * factor, (bottom - top) * factor),
        interpolation=cv2.INTER_LINEAR,
    )
    short = [max(0, corner[i] + shape[i] - spans[i][1] * factor) for i in range(2)]
    if max(short) > 0:
        block = cv2.copyMakeBorder(block, 0, short[0], 0, short[1], cv2.BORDER_REPLICATE)
    row, column = corner[0] - top * factor, corner[1] - left * factor
    cropped = block[row : row + shape[0], column : column + shape[1]]
    return cast(AnyPicture, cropped if cropped.ndim == 3 else cropped[..., None])


def without_bodies(mask: PixelArray, widest: int) -> PixelArray:
    """Return the mask 0 or 255 without whatever is wider than `widest` px both ways: lamps, frames, no catheter."""
    box = np.ones((widest, 1), dtype=np.uint8)
    cores = cv2.erode(cv2.erode(mask, box), box.T, borderValue=255)
    if not cores.any():
        return mask
    rim = np.ones((widest + 4, 1), dtype=np.uint8)
    return np.asarray(cv2.bitwise_and(mask, cv2.bitwise_not(cv2.dilate(cv2.dilate(cores, rim), rim.T))), dtype=np.uint8)


def noise_level(values: MatteArray) -> float:
    """Return the spread of a difference image where nothing is, grey levels, from its median (about 0.8 sigma)."""
    return max(0.5, float(np.median(values[::4, ::4])) / 0.8)


def grown(values: MatteArray, low: float, high: float) -> PixelArray:
    """Return the mask 0 or 255 of what exceeds `low` and is connected to something that exceeds `high`."""
    weak = (values > low).astype(np.uint8)
    count, labels = cv2.connectedComponents(weak, connectivity=8)
    keep = np.zeros(count, dtype=np.uint8)
    keep[labels[values > high]] = 255
    keep[0] = 0
    return np.asarray(keep[labels], dtype=np.uint8)


def matte_from(values: MatteArray, noise: float, faintest: float, *, plateau_px: int) -> MatteArray:
    """Return the matte of a difference image (grey levels): each pixel's share of the full difference beside it.

    A pixel that the catheter covers by a share a differs by a times the catheter's full difference there, which is the
    largest within a few pixels. So the half level stays on the edge whatever the catheter's colours are.
    plateau_px: how far inside its edge a blurred tube reaches its full difference; more would let one side's shine
    shift the other side's edge. faintest: a full difference below this is taken for background.
    """
    lifted = np.maximum(values - np.float32(noise), np.float32(0.0))
    smooth = cv2.GaussianBlur(lifted, (3, 3), 0.6)
    size = 2 * plateau_px + 1
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    full = cv2.dilate(smooth, around)
    full = cv2.blur(full, (3, 3))
    share = np.asarray(np.minimum(lifted / np.maximum(full, faintest), 1.0), dtype=np.float32)
    # Where two of the catheter's colours meet, their mixture may look like the background: close what is that narrow.
    inside = (share > 0.5).astype(np.uint8)
    gaps = cv2.subtract(cv2.morphologyEx(inside, cv2.MORPH_CLOSE, around), inside)
    if cv2.countNonZero(gaps):
        np.copyto(share, cv2.morphologyEx(share, cv2.MORPH_CLOSE, around), where=np.asarray(gaps, dtype=np.bool_))
    return share


def not_touching(mask: PixelArray, region: PixelArray) -> PixelArray:
    """Return the mask 0 or 255 without its components that touch a region (not 0) of the same size."""
    touching = (mask > 0) & (cv2.dilate(region, np.ones((3, 3), dtype=np.uint8)) > 0)
    if not touching.any():
        return mask
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    keep = np.full(count, 255, dtype=np.uint8)
    keep[labels[touching]] = 0
    keep[0] = 0
    return np.asarray(keep[labels], dtype=np.uint8)
