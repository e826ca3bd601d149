"""What changed near a line: compiled code against plain NumPy and against the whole picture's way."""

import numpy as np
import pytest
from numpy.typing import NDArray

from cathxr.core import PixelArray
from cathxr.vision.near_change import changed_near, darken, spans_near
from cathxr.vision.segment_background import BackgroundSegmenter
from cathxr.vision.segment_difference import difference, enlarged
from cathxr.vision.segmentation import Window

WINDOW = Window(37, 22, 205, 121)
ROOM = 18.0
PATH = np.stack([np.linspace(50.0, 190.0, 15), 70.0 + 30.0 * np.sin(np.linspace(0.0, 4.0, 15))], axis=1)


def spans() -> NDArray[np.int64]:
    result = np.zeros((140, 2), dtype=np.int64)
    spans_near(PATH, 0, len(PATH) - 1, ROOM, WINDOW.corners, result)
    return result[: WINDOW.y1 - WINDOW.y0]


def pictures(channels: int) -> tuple[PixelArray, PixelArray]:
    """An empty picture with a saturated corner, and one in other light, with noise and a bar across it."""
    rng = np.random.default_rng(5)
    rows, columns = np.mgrid[:160, :240]
    empty = np.stack([60 + 0.5 * columns + 10 * k + 0.2 * rows for k in range(channels)], axis=2)
    empty[:40, 150:] = 255.0
    picture = empty * (1.1 - 0.001 * columns[..., None])
    picture[60:75, 40:200] = 30.0
    picture += rng.normal(scale=2.0, size=picture.shape)
    return np.clip(empty, 0, 255).astype(np.uint8), np.clip(picture, 0, 255).astype(np.uint8)


def test_spans_hold_what_is_near_the_line_and_little_else() -> None:
    found = spans()
    fine = np.stack([np.interp(np.linspace(0, 14, 800), np.arange(15), PATH[:, k]) for k in range(2)], axis=1)
    for i in range(WINDOW.y1 - WINDOW.y0):
        inside = np.abs(fine[:, 1] - (WINDOW.y0 + i)) <= ROOM
        if inside.any():
            assert found[i, 0] <= max(0.0, fine[inside, 0].min() - ROOM - WINDOW.x0)
            assert found[i, 1] > min(WINDOW.x1 - WINDOW.x0 - 1, fine[inside, 0].max() + ROOM - WINDOW.x0)
    assert int((found[:, 1] - found[:, 0]).clip(0).sum()) < 0.85 * (WINDOW.x1 - WINDOW.x0) * (WINDOW.y1 - WINDOW.y0)


@pytest.mark.parametrize("channels", [1, 3])
def test_the_difference_is_the_whole_pictures_within_its_rounding(channels: int) -> None:
    empty, picture = pictures(channels)
    gain = np.random.default_rng(6).uniform(0.8, 1.2, (10, 15, channels)).astype(np.float32)
    rows, columns = WINDOW.slices
    found = changed_near(
        np.ascontiguousarray(picture[rows, columns]), empty, gain, 16, WINDOW.corners, spans(), 1.0, 0.6
    )
    light = enlarged(gain, 16, found.shape, (WINDOW.y0, WINDOW.x0))
    block = empty[rows, columns].astype(np.float32)
    expected = np.where(block >= 250.0, np.maximum(np.minimum(block * light, 255.0), 250.0), block * light)
    plain = difference(picture[rows, columns], np.minimum(expected, 255.0), 1.0, 0.6)
    inside = np.zeros(found.shape, dtype=bool)
    for i, (first, stop) in enumerate(spans()):
        inside[i, first : max(first, stop)] = True
    np.testing.assert_allclose(found[inside], plain[inside], atol=0.02)
    assert inside.any()
    assert not found[~inside].any()


@pytest.mark.parametrize("channels", [1, 3])
def test_the_matte_near_a_line_is_the_whole_pictures_there(channels: int) -> None:
    empty, picture = pictures(channels)
    segmenter = BackgroundSegmenter(empty)
    segmenter.coarse(picture)
    whole = segmenter.matte(picture, WINDOW)
    segmenter.refresh(picture)
    near = segmenter.matte_near(picture, WINDOW, spans())
    apart = [
        np.abs(near[i, first + 8 : stop - 8] - whole[i, first + 8 : stop - 8])
        for i, (first, stop) in enumerate(spans())
        if stop - first > 16
    ]
    off = np.concatenate(apart)
    assert off.size > 5000
    assert float(off.mean()) < 0.01
    assert float(np.mean(off > 0.1)) < 0.01  # single noisy pixels, by which small gaps are closed or not


def test_what_is_drawn_stays_within_the_spans_without_their_rim() -> None:
    canvas = np.full((160, 240, 3), 255, dtype=np.uint8)
    matte = np.ones((WINDOW.y1 - WINDOW.y0, WINDOW.x1 - WINDOW.x0), dtype=np.float32)
    darken(matte, spans(), 8, WINDOW.corners, canvas)
    for i, (first, stop) in enumerate(spans()):
        dark = np.flatnonzero(canvas[WINDOW.y0 + i, :, 0] == 0) - WINDOW.x0
        drawn = 8 <= i < WINDOW.y1 - WINDOW.y0 - 8 and stop - first > 16
        assert (dark.min(), dark.max()) == (first + 8, stop - 9) if drawn else not dark.size
