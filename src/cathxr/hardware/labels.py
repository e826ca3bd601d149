"""Names beside a picture, each with a line to the thing that it means."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import PixelArray

_LETTER_PX = 17
_APART_PX = 27
_GAP_PX = 14
_BLUE = (158, 94, 27)
_LEAST_PX = 12


@dataclass(frozen=True)
class _Label:
    text: str
    x: int
    y: int


def with_labels(pixels: PixelArray, masks: Mapping[str, NDArray[np.bool_]]) -> PixelArray:
    """Return a picture (H, W, 3) BGR, wider by margins with names, each joined to the middle of its mask (H, W).

    What is hardly seen gets no name.
    """
    masks = {text: mask for text, mask in masks.items() if int(mask.sum()) >= _LEAST_PX}
    if not masks:
        return pixels
    left, right = _filled(pixels)
    pixels, masks = pixels[:, left:right], {text: mask[:, left:right] for text, mask in masks.items()}
    height, width = pixels.shape[:2]
    places = [_Label(text, *_inside(mask)) for text, mask in masks.items()]
    middle = float(np.median([each.x for each in places]))
    sides = [sorted((each for each in places if (each.x < middle) == left), key=lambda each: each.y)
             for left in (True, False)]  # fmt: skip
    margin = 2 * _GAP_PX + max(_text_width(each.text) for each in places)
    wide = np.full((height, width + 2 * margin, 3), 255, dtype=np.uint8)
    wide[:, margin : margin + width] = pixels
    written: list[tuple[str, int, int, bool]] = []
    for left, side in zip((True, False), sides, strict=True):
        for each, y in zip(side, _spread([each.y for each in side], height), strict=True):
            x = margin - _GAP_PX if left else margin + width + _GAP_PX
            target = (margin + each.x, each.y)
            cv2.line(wide, (x, y), target, _BLUE, 1, cv2.LINE_AA)
            cv2.circle(wide, target, 3, _BLUE, -1, cv2.LINE_AA)
            written.append((each.text, x, y, left))
    return _with_texts(wide, written)


def _filled(pixels: PixelArray) -> tuple[int, int]:
    """Return from which column on to which there is something in a picture, with a little room."""
    columns = np.flatnonzero((pixels < 255).any(axis=(0, 2)))
    if len(columns) == 0:
        return 0, pixels.shape[1]
    return max(0, int(columns[0]) - 2 * _GAP_PX), min(pixels.shape[1], int(columns[-1]) + 2 * _GAP_PX)


def _inside(mask: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the place (x, y) that lies deepest in a mask."""
    depth = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3)
    y, x = np.unravel_index(int(depth.argmax()), depth.shape)
    return int(x) - 1, int(y) - 1


def _spread(wanted: list[int], height: int) -> list[int]:
    """Return heights near those wanted, in order, far enough apart to be read."""
    found = list(wanted)
    for index in range(1, len(found)):
        found[index] = max(found[index], found[index - 1] + _APART_PX)
    last = height - _APART_PX
    for index in range(len(found) - 1, -1, -1):
        found[index] = min(found[index], last)
        last = found[index] - _APART_PX
    return found


def _font() -> Any:
    import matplotlib
    from PIL import ImageFont

    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), _LETTER_PX)


def _text_width(text: str) -> int:
    return int(np.ceil(float(_font().getlength(text))))


def _with_texts(pixels: PixelArray, written: list[tuple[str, int, int, bool]]) -> PixelArray:
    from PIL import Image, ImageDraw

    picture = Image.fromarray(np.ascontiguousarray(pixels[..., ::-1]))
    draw, font = ImageDraw.Draw(picture), _font()
    for text, x, y, left in written:
        draw.text((x - 4 if left else x + 4, y), text, fill=(0, 0, 0), font=font, anchor="rm" if left else "lm")
    return np.ascontiguousarray(np.asarray(picture)[..., ::-1])
