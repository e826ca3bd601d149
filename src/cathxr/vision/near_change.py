"""What changed near a predicted line only, and that as a back-lit picture. Compiled, without memory of its own."""

from typing import Any

import numpy as np
from numba import njit

from cathxr.vision.segment_difference import SATURATED, pixel_difference

_WHITE = 255.0


@njit(cache=True, nogil=True)  # type: ignore[misc, unused-ignore]
def spans_near(path: Any, first: int, last: int, room: float, window: Any, spans: Any) -> None:
    """Set spans int64 (rows, 2) to the columns of each row that lie within `room` px of points first to last of a path.

    path (N, 2) px of the picture; window: x0, y0, x1, y1 px. Rows and columns of spans count from the window's corner;
    a row with nothing near has stop before first.
    """
    x0, y0, x1, y1 = window
    rows, columns = y1 - y0, x1 - x0
    for i in range(rows):
        spans[i, 0], spans[i, 1] = columns, 0
    for j in range(first, last):
        u, v = path[j, 0], path[j, 1]
        high = max(v, path[j + 1, 1]) + room
        low = min(v, path[j + 1, 1]) - room
        left = min(u, path[j + 1, 0]) - room
        right = max(u, path[j + 1, 0]) + room
        begin, end = max(0, int(np.floor(left)) - x0), min(columns, int(np.ceil(right)) + 1 - x0)
        for i in range(max(0, int(np.floor(low)) - y0), min(rows, int(np.ceil(high)) + 1 - y0)):
            spans[i, 0] = min(spans[i, 0], begin)
            spans[i, 1] = max(spans[i, 1], end)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")  # type: ignore[misc, unused-ignore]
def changed_near(
    picture: Any, background: Any, gain: Any, gain_px: int, window: Any, spans: Any, plain: float, shade: float
) -> Any:
    """Return `difference` float32 (rows, columns) of a window, 0 outside spans, from the background in its light.

    picture (rows, columns, C): the window's; background uint8 (H, W, C): the whole one; gain float32 (h, w, C): the
    light's change, each pixel `gain_px` of the picture's, as of `lit`. window: x0, y0, x1, y1 px.
    """
    x0, y0, _, _ = window
    rows, columns, channels = picture.shape
    high, wide = gain.shape[0] - 1, gain.shape[1] - 1
    last = channels - 1
    middle = last // 2
    greyed, shaded = np.float32(plain), np.float32(shade)
    scale = np.float32(1.0 / gain_px)
    result = np.zeros((rows, columns), dtype=np.float32)
    for i in range(rows):
        y = (np.float32(y0 + i) + np.float32(0.5)) * scale - np.float32(0.5)
        y = min(max(y, np.float32(0.0)), np.float32(high))
        upper = min(int(y), max(high - 1, 0))
        lower = min(upper + 1, high)
        down = y - np.float32(upper)
        j, stop = spans[i, 0], spans[i, 1]
        while j < stop:
            x = (np.float32(x0 + j) + np.float32(0.5)) * scale - np.float32(0.5)
            before = min(int(max(x, np.float32(0.0))), max(wide - 1, 0))
            after = min(before + 1, wide)
            until = stop if before >= wide - 1 else min(stop, max(j + 1, int((before + 1.5) * gain_px + 0.5) - x0))
            g0 = gain[upper, before, 0] + down * (gain[lower, before, 0] - gain[upper, before, 0])
            g1 = gain[upper, before, middle] + down * (gain[lower, before, middle] - gain[upper, before, middle])
            g2 = gain[upper, before, last] + down * (gain[lower, before, last] - gain[upper, before, last])
            d0 = gain[upper, after, 0] + down * (gain[lower, after, 0] - gain[upper, after, 0]) - g0
            d1 = gain[upper, after, middle] + down * (gain[lower, after, middle] - gain[upper, after, middle]) - g1
            d2 = gain[upper, after, last] + down * (gain[lower, after, last] - gain[upper, after, last]) - g2
            for k in range(j, until):
                along = (np.float32(x0 + k) + np.float32(0.5)) * scale - np.float32(0.5) - np.float32(before)
                along = min(max(along, np.float32(0.0)), np.float32(1.0))
                b0 = np.float32(background[y0 + i, x0 + k, 0])
                b1 = np.float32(background[y0 + i, x0 + k, middle])
                b2 = np.float32(background[y0 + i, x0 + k, last])
                e0 = min(b0 * (g0 + along * d0), np.float32(_WHITE))
                e1 = min(b1 * (g1 + along * d1), np.float32(_WHITE))
                e2 = min(b2 * (g2 + along * d2), np.float32(_WHITE))
                e0 = max(e0, SATURATED) if b0 >= SATURATED else e0
                e1 = max(e1, SATURATED) if b1 >= SATURATED else e1
                e2 = max(e2, SATURATED) if b2 >= SATURATED else e2
                p0 = np.float32(picture[i, k, 0])
                p1 = np.float32(picture[i, k, middle])
                p2 = np.float32(picture[i, k, last])
                result[i, k] = pixel_difference(p0, p1, p2, e0, e1, e2, greyed, shaded)
            j = until
    return result


@njit(cache=True, nogil=True)  # type: ignore[misc, unused-ignore]
def darken(matte: Any, spans: Any, rim: int, window: Any, picture: Any) -> None:
    """Draw a window's matte float32 (rows, columns) into a picture uint8 (H, W, 3): white where it is 0, black at 1.

    Only within spans, without `rim` px at their ends and at the window's own edges but those of the picture.
    """
    x0, y0, _, y1 = window
    height, width = picture.shape[0], picture.shape[1]
    top = rim if y0 > 0 else 0
    bottom = y1 - y0 - (rim if y1 < height else 0)
    for i in range(top, bottom):
        begin, end = spans[i, 0], spans[i, 1]
        begin += rim if x0 + begin > 0 else 0
        end -= rim if x0 + end < width else 0
        for j in range(begin, end):
            value = np.uint8(np.float32(_WHITE) * (np.float32(1.0) - matte[i, j]) + np.float32(0.5))
            picture[y0 + i, x0 + j, 0] = value
            picture[y0 + i, x0 + j, 1] = value
            picture[y0 + i, x0 + j, 2] = value
