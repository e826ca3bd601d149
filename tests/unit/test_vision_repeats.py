"""A frozen camera repeats its picture to the last bit; a live one never does."""

import numpy as np
import pytest

from cathxr.core import Image, PixelArray
from cathxr.vision.repeats import RepeatCounter


def picture(seed: int = 0, shape: tuple[int, ...] = (48, 64)) -> PixelArray:
    """Return a noisy picture."""
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


class Camera:
    """Numbers the pictures given to a counter."""

    def __init__(self) -> None:
        self.counter = RepeatCounter()
        self.seq = -1

    def count(self, pixels: PixelArray) -> int:
        """Return what the counter says of the next picture."""
        self.seq += 1
        return self.again(pixels)

    def again(self, pixels: PixelArray) -> int:
        """Return what the counter says of the same picture once more."""
        return self.counter.count(Image("top", self.seq, 1_000 * self.seq, pixels))


def test_equal_pictures_are_counted_in_a_row() -> None:
    counter = Camera()
    assert [counter.count(picture()) for _ in range(4)] == [0, 1, 2, 3]
    assert [counter.count(picture(1)) for _ in range(2)] == [0, 1]
    assert counter.count(picture()) == 0  # seen before, but not just before


# A row that is compared first (a multiple of 16) and rows that are not.
@pytest.mark.parametrize("row", [0, 1, 15, 16, 17, 31, 47])
@pytest.mark.parametrize("shape", [(48, 64), (48, 64, 3)])
def test_one_bit_of_one_pixel_makes_a_new_picture(row: int, shape: tuple[int, ...]) -> None:
    counter = Camera()
    counter.count(picture(shape=shape))
    changed = picture(shape=shape)
    changed[row, 63] ^= 1
    assert counter.count(changed) == 0
    assert counter.count(changed.copy()) == 1  # compared with the newest, not with the first


def test_a_buffer_that_the_camera_writes_again_is_no_repeat() -> None:
    counter = Camera()
    buffer = picture()
    counter.count(buffer)
    buffer[:] = picture(1)
    assert counter.count(buffer) == 0
    buffer[:] = picture(2)
    assert counter.count(buffer) == 0
    assert counter.count(buffer) == 1


def test_another_size_is_a_new_picture() -> None:
    counter = Camera()
    black = np.zeros((48, 64), dtype=np.uint8)
    assert counter.count(black) == 0
    assert counter.count(black) == 1
    assert counter.count(np.zeros((64, 48), dtype=np.uint8)) == 0
    assert counter.count(np.zeros((48, 64, 3), dtype=np.uint8)) == 0


def test_reset_forgets() -> None:
    counter = Camera()
    counter.count(picture())
    assert counter.count(picture()) == 1
    counter.counter.reset()
    assert counter.count(picture()) == 0


def test_a_picture_read_twice_is_no_repeat() -> None:
    counter = Camera()
    assert [counter.count(picture()), counter.again(picture()), counter.count(picture())] == [0, 0, 1]
    assert counter.again(picture()) == 1
