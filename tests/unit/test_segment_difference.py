import numpy as np
import pytest

from cathxr.vision.segment_difference import difference, enlarged, grown, lit, reduced, standing_out, without_bodies


def plain_difference(picture: np.ndarray, expected: np.ndarray, plain: float, shade: float) -> np.ndarray:
    """The same in NumPy, one line an equation."""
    e = expected.astype(np.float64)
    p = np.where(e >= 250, np.minimum(picture, e), picture).astype(np.float64)
    square = np.maximum((e * e).sum(axis=2), 1.0)
    scale = (p * e).sum(axis=2) / square
    colour = ((p - scale[..., None] * e) ** 2).sum(axis=2)
    coloured = e.max(axis=2) - e.min(axis=2) > 0.25 * e.max(axis=2)
    weight = np.where(coloured & (scale > 0.45) & (scale < 1.25), shade, plain)
    return np.sqrt((colour + (weight * (scale - 1)) ** 2 * square) / 3)


def test_difference_agrees_with_the_plain_reference() -> None:
    random = np.random.default_rng(0)
    picture = random.integers(0, 256, (40, 50, 3), dtype=np.uint8)
    expected = random.integers(0, 256, (40, 50, 3), dtype=np.uint8)
    # float32 on numbers up to 255^2 * 3: seven digits of 2e5 under a square root.
    np.testing.assert_allclose(
        difference(picture, expected, 1.0, 0.4), plain_difference(picture, expected, 1.0, 0.4), rtol=1e-3, atol=0.1
    )


def test_a_grey_pictures_difference_is_its_change_of_level() -> None:
    picture = np.full((4, 4, 1), 60, dtype=np.uint8)
    expected = np.full((4, 4, 1), 200, dtype=np.uint8)
    np.testing.assert_allclose(difference(picture, expected, 1.0, 0.4), 140.0, atol=0.01)


def test_standing_out_is_in_sigmas() -> None:
    values = np.full((3, 3), 50.0, dtype=np.float32)
    expected = np.full((3, 3, 3), 100, dtype=np.uint8)
    edges = np.full((3, 3), 4.0, dtype=np.float32)
    np.testing.assert_allclose(standing_out(values, expected, edges, 3.0, 0.12), 50.0 / 13.0, rtol=1e-5)


@pytest.mark.parametrize("corner", [(0, 0), (5, 11), (37, 90)])
@pytest.mark.parametrize("factor", [1, 4, 8])
def test_enlarging_puts_pixel_centres_where_they_were(factor: int, corner: tuple[int, int]) -> None:
    """A linear ramp, reduced by means and enlarged again, is the same ramp away from the edge."""
    rows, columns = np.mgrid[:96, :160].astype(np.float32)
    ramp = (0.5 * columns + 0.7 * rows)[..., None]
    small = ramp.reshape(96 // factor, factor, 160 // factor, factor, 1).mean(axis=(1, 3))
    block = enlarged(small, factor, (30, 40), corner)
    expected = ramp[corner[0] : corner[0] + 30, corner[1] : corner[1] + 40]
    inner = np.ones(expected.shape, dtype=bool)
    if corner == (0, 0):
        inner[: factor // 2 + 1] = inner[:, : factor // 2 + 1] = False
    # OpenCV's linear interpolation of float32 keeps five digits.
    np.testing.assert_allclose(block[inner], expected[inner], atol=0.01)


def test_enlarging_beyond_the_last_whole_pixel_repeats_it() -> None:
    picture = np.full((31, 45, 3), 77, dtype=np.uint8)
    block = enlarged(reduced(picture, 4), 4, (31, 45), (0, 0))
    assert block.shape == (31, 45, 3)
    assert (block == 77).all()


def test_saturated_background_stays_saturated_in_less_light() -> None:
    background = np.array([[[255], [100]]], dtype=np.uint8)
    gain = np.full((1, 1, 1), 0.5, dtype=np.float32)
    result = lit(background, gain, 2, (0, 0))
    assert result[0, 0, 0] >= 250
    assert result[0, 1, 0] == 50


def test_growing_keeps_what_a_strong_pixel_reaches() -> None:
    values = np.array([[5, 5, 9, 0, 5, 5]], dtype=np.float32)
    np.testing.assert_array_equal(grown(values, 4.0, 8.0), [[255, 255, 255, 0, 0, 0]])


def test_bodies_go_and_tubes_stay() -> None:
    mask = np.zeros((100, 200), dtype=np.uint8)
    mask[20:80, 10:70] = 255
    mask[45:55, 100:200] = 255
    result = without_bodies(mask, 20)
    assert not result[:, :90].any()
    np.testing.assert_array_equal(result[:, 100:], mask[:, 100:])
