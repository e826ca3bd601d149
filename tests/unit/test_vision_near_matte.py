"""Following a catheter of any colour near its prediction, with the matte in place of a back-light."""

import numpy as np
import pytest
from numpy.typing import NDArray

from cathxr.app.bench_scenes import Sequence
from cathxr.app.bench_sequence import Method
from cathxr.core import PixelArray, Status
from cathxr.vision.near_matte import NearMatte
from cathxr.vision.segmentation import MatteArray, Window

SIZE, WIDTH_PX = (320, 240), 6.0


class Ramp:
    """A matte that only depends on where a pixel is."""

    def refresh(self, pixels: PixelArray) -> None:
        """Take nothing."""

    def matte_near(self, pixels: PixelArray, window: Window, spans: NDArray[np.int64]) -> MatteArray:
        """Return a matte that grows to the right and falls with the rows, a little wrong at a window's edge."""
        x, y = np.meshgrid(np.arange(window.x0, window.x1), np.arange(window.y0, window.y1))
        result = (x / SIZE[0] * (1.0 - y / SIZE[1])).astype(np.float32)
        result[:3] = result[-3:] = 1.0
        return result


def test_the_picture_is_the_matte_near_the_line_and_white_elsewhere() -> None:
    near = NearMatte(SIZE, WIDTH_PX)
    pixels = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
    path = np.stack([np.linspace(60.0, 250.0, 40), np.linspace(90.0, 160.0, 40)], axis=1)
    picture, light, _, gain = near.source(pixels, Ramp(), path)
    assert float(light.min()) == 255.0 * gain
    for x, y in path:
        row, column = round(y), round(x)
        expected = 255.0 * (1.0 - column / SIZE[0] * (1.0 - row / SIZE[1]))
        np.testing.assert_allclose(picture[row, column], expected, atol=0.51)
    assert (picture[:40] == 255).all()
    assert (picture[-30:] == 255).all()
    near.source(pixels, Ramp(), path[:5])
    assert (picture[120:, 200:] == 255).all()  # what was drawn for the line before is gone


def test_a_line_at_the_pictures_corner_is_read_up_to_its_edge() -> None:
    near = NearMatte(SIZE, WIDTH_PX)
    pixels = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
    path = np.stack([np.linspace(310.0, 319.0, 10), np.linspace(230.0, 239.0, 10)], axis=1)
    picture, *_ = near.source(pixels, Ramp(), path)
    assert picture[225, 319, 0] < 255


@pytest.mark.parametrize("name", ["white", "coloured"])
def test_a_catheter_of_any_colour_is_followed_near_its_prediction(name: str) -> None:
    sequence = Sequence(name, seed=3)
    method = Method("model", sequence)
    followed = 0
    for pair in sequence.pairs(6, 30.0):
        observation, track, _ = method.track(pair)
        assert track.status is Status.TRACKED
        assert track.tip_box is not None
        assert pair.truth.tip_box is not None
        assert float(np.linalg.norm(track.tip_box - pair.truth.tip_box)) < 0.25
        followed += observation.predicted
    assert followed >= 4  # a stretch that is not found, as of a colour like the background's, is looked at in full once
