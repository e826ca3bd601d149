"""The compiled look near a prediction against plain NumPy, on drawn back-lit pictures whose truth is known."""

import cv2
import numpy as np
import pytest

from cathxr.core import FloatArray, PixelArray
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.vision.near_end import end_near
from cathxr.vision.near_expected import ALONE, expect, offset_from, spread
from cathxr.vision.near_kernels import rough_near, section_near
from cathxr.vision.near_work import near_work
from cathxr.vision.profiles import edge, sample
from cathxr.vision.raw import dark_edge, grey_at, light_at, light_gain, look_inside

SIZE = 120
FINE = 6
STEP = 4


def backlight() -> FloatArray:
    """Return an uneven back-light (H, W): it falls by a fifth across the picture."""
    across = np.arange(SIZE) / SIZE
    return np.asarray(220.0 - 44.0 * across[None] + 10.0 * across[:, None], dtype=np.float64)


def drawn(angle: float, shift: float, width: float, *, opacity: float = 0.8, blur: float = 1.0) -> PixelArray:
    """Return a picture (H, W, 3) of a tube that comes from the left and ends, round, at the middle."""
    fine = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5 - 0.5 * (SIZE - 1)
    x, y = np.meshgrid(fine, fine)
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x - shift
    distance = np.where(along < 0.0, np.abs(across), np.hypot(along, across))
    cover = (distance <= 0.5 * width).reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))
    matte = opacity * cv2.GaussianBlur(cover, (0, 0), blur)
    grey = np.clip(np.round(backlight() * (1.0 - matte)), 0, 255).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def source(pixels: PixelArray, gain: float = 1.0) -> tuple[PixelArray, np.ndarray, float, float]:
    """Return the picture with the back-light that it was drawn with, at reduced size, `gain` too dark."""
    reduced = backlight().reshape(SIZE // STEP, STEP, SIZE // STEP, STEP).mean(axis=(1, 3)) / gain
    return pixels, reduced.astype(np.float32), float(STEP), gain


def test_grey_levels_are_opencvs_and_interpolated() -> None:
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, 255, (30, 40, 3)).astype(np.uint8)
    grey = pixels @ np.array([0.114, 0.587, 0.299])
    for x, y in rng.uniform(0.0, [39.0, 29.0], (50, 2)):
        column, row = min(int(x), 38), min(int(y), 28)
        fx, fy = x - column, y - row
        block = grey[row : row + 2, column : column + 2]
        expected = np.array([1.0 - fy, fy]) @ block @ np.array([1.0 - fx, fx])
        assert grey_at(pixels, x, y, -1.0) == pytest.approx(expected, abs=0.02)  # weights to 2^-14, of 255
        assert grey_at(pixels[..., 1].copy(), x, y, -1.0) <= 255.0
    assert grey_at(pixels, -0.1, 5.0, -1.0) == -1.0
    assert grey_at(pixels, 39.0, 29.0, -1.0) == pytest.approx(grey[29, 39], abs=0.02)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3, -0.9])
def test_an_edge_is_where_the_matte_has_it(angle: float) -> None:
    lit = source(drawn(angle, 0.0, 12.0))
    middle = 0.5 * (SIZE - 1)
    x, y = middle - 20.0 * np.cos(angle), middle - 20.0 * np.sin(angle)
    nx, ny = -np.sin(angle), np.cos(angle)
    distance, slope = edge(lit, x, y, nx, ny, 12.0, 0.4)  # of the matte, sample by sample
    here, there = light_at(lit, x, y), light_at(lit, x + 6.0 * nx, y + 6.0 * ny)
    got, fall = dark_edge(lit[0], x, y, nx, ny, 12.0, 0.6 * here, 0.6 * (there - here) / 6.0)
    assert got == pytest.approx(distance, abs=2e-3)  # the light between two samples half a pixel apart
    assert fall / there == pytest.approx(slope, rel=0.01)
    assert dark_edge(lit[0], x, y, nx, ny, 3.0, 0.6 * here, 0.0) == (-1.0, 0.0)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3, -0.9])
@pytest.mark.parametrize("off", [-2.0, 0.0, 1.5])
def test_a_section_is_the_tubes(angle: float, off: float) -> None:
    lit = source(drawn(angle, 0.7, 12.0), gain=1.1)
    middle = 0.5 * (SIZE - 1)
    nx, ny = -np.sin(angle), np.cos(angle)
    x, y = middle - 25.0 * np.cos(angle) + off * nx, middle - 25.0 * np.sin(angle) + off * ny
    offset, width, own, slope = section_near(lit, x, y, nx, ny, 12.0)
    # whole grey levels and bilinear interpolation: a few hundredths of a pixel
    assert offset == pytest.approx(0.7 - off, abs=0.06)
    # off the middle one of the five samples between the edges feels their blur: the level is that much lower
    assert width == pytest.approx(12.0, abs=0.12 if abs(off) < 2.0 else 0.25)
    assert own == pytest.approx(0.8, abs=0.02 if abs(off) < 2.0 else 0.06)
    assert 0.1 < slope < 0.5
    rough, wide = rough_near(lit, x + 4.0 * nx, y + 4.0 * ny, nx, ny, 12.0, 0.8)
    assert rough == pytest.approx(0.7 - off - 4.0, abs=0.2)
    assert wide == pytest.approx(12.0, abs=0.5)


def test_where_there_is_no_tube_there_is_no_section() -> None:
    lit = source(drawn(0.0, 0.0, 12.0))
    assert rough_near(lit, 20.0, 12.0, 0.0, 1.0, 12.0, 0.8)[1] < 0.0
    assert section_near(lit, 20.0, 12.0, 0.0, 1.0, 12.0)[1] < 0.0
    brighter = (np.clip(lit[0].astype(int) + 40, 0, 255).astype(np.uint8), *lit[1:])
    section_near(brighter, 20.0, 12.0, 0.0, 1.0, 12.0)  # than the back-light was: no fault
    px, share, change = look_inside(12.0, -3.0, 0.3)
    assert px == pytest.approx(0.85, abs=1e-3)
    assert share == pytest.approx(1.0)
    assert change == 0.3


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.2, -0.9])
def test_the_rounded_end_is_found_from_nearby(angle: float) -> None:
    lit = source(drawn(angle, 0.0, 12.0))
    middle = 0.5 * (SIZE - 1)
    ahead = np.array([np.cos(angle), np.sin(angle)])
    outline = np.zeros((37, 2))
    u, v, count, rms = end_near(lit, middle + 2.0, middle - 1.5, *ahead, 6.0, 0.8, 1.0, outline)
    assert np.hypot(u - middle, v - middle) < 0.15
    assert 0.0 <= rms < 0.15
    front = (outline[:count] - middle) @ ahead > 0.0
    assert front.sum() > 10
    np.testing.assert_allclose(np.hypot(*(outline[:count][front] - middle).T), 6.0, atol=0.2)
    assert end_near(lit, middle, middle - 40.0, 0.0, -1.0, 6.0, 0.8, 1.0, outline)[3] >= -1.0


def test_the_lights_gain_is_the_median_beside_the_line() -> None:
    pixels = drawn(0.0, 0.0, 12.0)
    lit = (*source(pixels, gain=1.25)[:3], 1.0)  # the light as it was, a fifth darker than now
    points = np.stack([np.linspace(10.0, 50.0, 20), np.full(20, 59.5)], axis=1)
    normals = np.tile([0.0, 1.0], (20, 1))
    got = light_gain(lit, points, normals, 20, 20.0, np.zeros(64))
    levels = [
        (1.0 - sample(lit, x, y + side * 20.0)) for x, y in points for side in (-1.0, 1.0)
    ]  # of the matte: picture over light
    assert got == pytest.approx(float(np.median(levels)), rel=1e-6)
    assert got == pytest.approx(1.25, rel=0.02)


def test_what_is_expected_is_the_projected_curve() -> None:
    rig = example_rig()
    model = CameraModel.of(rig.cameras["top"])
    x = np.linspace(70.0, 0.0, 50)
    shape = np.stack([x, 0.004 * x**2, -0.003 * x**2], axis=1)
    work = near_work()
    work.shape[:50] = shape
    size = (float(model.size_px[0]), float(model.size_px[1]))
    count, tip_u, tip_v, alone = expect(50, 1.5, 1.1, model.numbers, size, work)
    np.testing.assert_allclose([tip_u, tip_v], model.project(shape[0]), atol=1e-9)
    assert alone == ALONE
    assert count in (50, 49)
    # from the rounded end's centre on: one radius behind the tip, between the second and the third point or so
    assert np.linalg.norm(work.line[0] - shape[0]) == pytest.approx(1.5, abs=0.01)
    np.testing.assert_allclose(work.line[1:count], shape[51 - count :], atol=1e-12)
    pixels, jacobian = model.project_with_jacobian(work.line[:count].copy())
    np.testing.assert_allclose(work.path[:count], pixels, atol=1e-9)
    scale = np.sqrt(0.5 * np.square(jacobian).sum(axis=(1, 2)))
    np.testing.assert_allclose(work.widths[:count], 2.0 * 1.5 * 1.1 * scale, atol=1e-9)
    seen = np.linalg.norm(np.diff(pixels, axis=0), axis=1)
    real = np.linalg.norm(np.diff(work.line[:count], axis=0), axis=1) * 0.5 * (scale[1:] + scale[:-1])
    share = seen / real
    shares = np.concatenate([share[:1], np.minimum(share[1:], share[:-1]), share[-1:]])
    np.testing.assert_allclose(work.shares[:count], shares, atol=1e-9)
    total, spacing = spread(count, 4.0, 110, work)
    steps = np.linalg.norm(np.diff(work.points[:total], axis=0), axis=1)
    np.testing.assert_allclose(steps, spacing, rtol=0.01)  # chords of a bent line
    work.shape[:50] = shape + np.array([0.0, 500.0, 0.0])
    assert expect(50, 1.5, 1.1, model.numbers, size, work)[0] == 0


def test_an_offset_is_that_from_the_nearest_segment() -> None:
    path = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 0.0]])
    assert offset_from(path, 3, 5.0, 2.0) == (0.0, 2.0)
    assert offset_from(path, 3, 12.0, 5.0) == (2.0, 0.0)
