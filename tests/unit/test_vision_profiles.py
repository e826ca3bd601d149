"""Cross-sections of a blurred stripe at any angle and offset: against the truth, and against a plain NumPy twin."""

import numpy as np
import pytest
from scipy.special import erf

from cathxr.vision.profiles import SAMPLE_PX, cross, edge, line_samples, sample
from cathxr.vision.raw import EDGE_SHARE, SIDE_CHANGE, look_inside
from cathxr.vision.segmentation import MatteArray

SIZE = 96
MIDDLE = 0.5 * (SIZE - 1)


def stripe(angle: float, shift: float, width: float, blur: float, noise: float = 0.0, seed: int = 0) -> MatteArray:
    """Return a matte of a stripe `width` px wide, `shift` px from the middle along its normal, Gaussian-blurred."""
    at = np.arange(SIZE) - MIDDLE
    x, y = np.meshgrid(at, at)
    across = -np.sin(angle) * x + np.cos(angle) * y - shift
    scale = np.sqrt(2.0) * blur
    clean = 0.5 * (erf((across + 0.5 * width) / scale) - erf((across - 0.5 * width) / scale))
    return (clean + noise * np.random.default_rng(seed).normal(size=clean.shape)).astype(np.float32)


def normal(angle: float) -> tuple[float, float]:
    """Return the stripe's unit normal."""
    return -np.sin(angle), np.cos(angle)


def plain_sample(matte: MatteArray, points: np.ndarray) -> np.ndarray:
    """Return the matte (N,) at points (N, 2) by bilinear interpolation, 0 outside."""
    height, width = matte.shape
    x, y = points[:, 0], points[:, 1]
    inside = (x >= 0) & (x <= width - 1) & (y >= 0) & (y <= height - 1)
    column = np.clip(np.floor(x).astype(int), 0, width - 2)
    row = np.clip(np.floor(y).astype(int), 0, height - 2)
    fx, fy = x - column, y - row
    values = matte.astype(np.float64)
    upper = values[row, column] * (1 - fx) + values[row, column + 1] * fx
    lower = values[row + 1, column] * (1 - fx) + values[row + 1, column + 1] * fx
    return np.where(inside, upper * (1 - fy) + lower * fy, 0.0)


def plain_edge(
    matte: MatteArray, start: np.ndarray, direction: np.ndarray, reach: float, level: float
) -> tuple[float, float]:
    """Return (distance, slope) of the first fall below `level`, by looking at the whole profile at once."""
    at = SAMPLE_PX * np.arange(int(reach / SAMPLE_PX) + 1)
    values = plain_sample(matte, start + at[:, None] * direction)
    falls = np.flatnonzero((values[1:] < level) & (values[:-1] >= level))
    if not falls.size:
        return -1.0, 0.0
    i = int(falls[0])
    slope = (values[i] - values[i + 1]) / SAMPLE_PX
    return at[i] + (values[i] - level) / slope, slope


def plain_settled(
    matte: MatteArray,
    start: np.ndarray,
    direction: np.ndarray,
    found: tuple[float, float],
    inside: tuple[float, float, float],
    usual: float,
) -> tuple[float, float]:
    """Return the edge near a found one at half of the darkness inside it, by looking at all samples around at once."""
    far, (px, share, change) = found[0], inside
    if far < px:
        return found
    seen = float(plain_sample(matte, (start + (far - px) * direction)[None])[0]) / share
    further = float(plain_sample(matte, (start + (far - 2.0 * px) * direction)[None])[0])
    part = np.clip(abs(seen - usual) / (0.06 * usual) - 1.0, 0.0, 1.0)
    at_edge = seen + np.clip(seen - further, -change * seen, change * seen)
    level = 0.5 * (usual + part * (at_edge - usual))
    at = max(far - 1.25, far - px) + SAMPLE_PX * np.arange(
        int(np.ceil((far + 1.25 - max(far - 1.25, far - px)) / 0.5)) + 1
    )
    values = plain_sample(matte, start + at[:, None] * direction)
    falls = np.flatnonzero((values[1:] < level) & (values[:-1] >= level))
    if values[0] < level or not falls.size:
        return found
    i = int(falls[0])
    slope = (values[i] - values[i + 1]) / SAMPLE_PX
    return at[i] + (values[i] - level) / slope, slope


def plain_cross(
    matte: MatteArray, point: np.ndarray, along: np.ndarray, width: float, plateau: float
) -> tuple[float, float, float, float]:
    """Return the section for a point on the tube: both edges twice, then each by the darkness inside it."""
    start, level, own, at = 0.0, EDGE_SHARE * plateau, plateau, 0.0
    right = left = slope_right = slope_left = 0.0
    for _ in range(2):
        right, slope_right = plain_edge(matte, point + start * along, along, 2.0 * width, level)
        left, slope_left = plain_edge(matte, point + start * along, -along, 2.0 * width, level)
        if right < 0 or left < 0 or right + left > 2.0 * width:
            return 0.0, 0.0, 0.0, 0.0
        middle = start + 0.5 * (right - left)
        own = float(
            plain_sample(matte, point + (middle + np.linspace(-0.2, 0.2, 5)[:, None] * (right + left)) * along).mean()
        )
        at, start, level = start, middle, EDGE_SHARE * own
    inside = look_inside(right + left, own / max(slope_left, slope_right), SIDE_CHANGE)
    right, slope_right = plain_settled(matte, point + at * along, along, (right, slope_right), inside, own)
    left, slope_left = plain_settled(matte, point + at * along, -along, (left, slope_left), inside, own)
    return at + 0.5 * (right - left), right + left, own, 0.5 * (slope_left + slope_right)


def cases(count: int, width: float, seed: int) -> np.ndarray:
    """Return (N, 3): angle, the stripe's shift, and how far from its middle the section is asked for."""
    rng = np.random.default_rng(seed)
    most = 0.4 * width
    return rng.uniform([0.0, -4.0, -most], [np.pi, 4.0, most], (count, 3))


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize(("width", "blur"), [(3.0, 0.6), (6.0, 1.0), (12.0, 1.5), (20.0, 2.5)])
def test_the_compiled_section_is_the_plain_one(width: float, blur: float, noise: float) -> None:
    for angle, shift, off in cases(40, width, seed=1):
        matte = stripe(angle, shift, width, blur, noise)
        along = np.array(normal(angle))
        point = MIDDLE + (shift + off) * along
        got = cross(matte, point[0], point[1], along[0], along[1], 1.1 * width, 0.9)
        expected = plain_cross(matte, point, along, 1.1 * width, 0.9)
        np.testing.assert_allclose(got, expected, atol=1e-9)  # the same sums in another order


@pytest.mark.parametrize(("width", "blur"), [(4.0, 0.6), (4.0, 0.8), (6.0, 1.0), (12.0, 1.5), (20.0, 2.5)])
def test_without_noise_the_middle_is_right_to_a_few_hundredths_of_a_pixel(width: float, blur: float) -> None:
    errors, widths = [], []
    for angle, shift, off in cases(150, width, seed=2):
        nx, ny = normal(angle)
        matte = stripe(angle, shift, width, blur)
        x, y = MIDDLE + (shift + off) * nx, MIDDLE + (shift + off) * ny
        offset, found, plateau, slope = cross(matte, x, y, nx, ny, width, 1.0)
        errors.append(offset + off)
        widths.append(found - width)
        assert 0.8 < plateau < 1.01
        # A Gaussian-blurred step of height 1 falls by 1 / (sqrt(2 pi) blur); sampling makes it a little gentler.
        assert 0.6 < slope * np.sqrt(2.0 * np.pi) * blur < 1.05
    # Bilinear interpolation of an edge as sharp as 0.6 px is off by up to 0.07 px, by 0.02 px for one of 1 px and more
    # (its second derivative, 0.24 / blur^2, times h^2 / 8 in each direction, over the slope 0.4 / blur, is
    # 0.15 / blur; the half level, where the edge has no curvature, meets a third of that), and symmetric, so that
    # only its spread counts: half of it for the mean of two edges.
    spread = 0.05 / blur
    assert np.sqrt(np.mean(np.square(errors))) < 0.5 * spread
    assert np.abs(errors).max() < 1.5 * spread
    assert abs(np.mean(errors)) < 5.0 * 0.5 * spread / np.sqrt(150.0)
    # The half level lies outside the true edge where the blurs of both sides overlap: by nothing at six blurs' width.
    if width >= 6.0 * blur:
        assert abs(np.mean(widths)) < 0.1


@pytest.mark.parametrize(("width", "blur"), [(6.0, 0.7), (12.0, 0.8), (20.0, 1.5)])
def test_a_tube_lit_from_one_side_is_where_it_is(width: float, blur: float) -> None:
    # the other camera's back-light shines on one side: there the tube is half as dark as on the other
    for angle, shift, _ in cases(40, width, seed=4):
        across = (
            -np.sin(angle) * (np.arange(SIZE) - MIDDLE) + np.cos(angle) * (np.arange(SIZE) - MIDDLE)[:, None] - shift
        )
        lit = stripe(angle, shift, width, blur) * (0.7 - 0.3 * np.clip(across / (0.5 * width), -1.0, 1.0))
        nx, ny = normal(angle)
        offset, found, own, _ = cross(
            lit.astype(np.float32), MIDDLE + shift * nx, MIDDLE + shift * ny, nx, ny, width, 0.7
        )
        # one level for both sides puts its middle 0.35 to 0.65 px to the dark side
        assert abs(offset) < 0.25
        assert found == pytest.approx(width, abs=0.4)
        assert own == pytest.approx(0.7, abs=0.05)


@pytest.mark.parametrize("noise", [0.02, 0.05])
@pytest.mark.parametrize(("width", "blur"), [(6.0, 1.0), (12.0, 1.5)])
def test_with_noise_the_middle_is_as_right_as_the_noise_allows(width: float, blur: float, noise: float) -> None:
    errors = []
    count = 300
    for i, (angle, shift, off) in enumerate(cases(count, width, seed=3)):
        nx, ny = normal(angle)
        matte = stripe(angle, shift, width, blur, noise, seed=i)
        x, y = MIDDLE + (shift + off) * nx, MIDDLE + (shift + off) * ny
        offset, found, _, _ = cross(matte, x, y, nx, ny, width, 1.0)
        assert found > 0.0
        errors.append(offset + off)
    # An edge moves by noise over slope; the middle is the mean of two. Interpolation averages neighbours: less noise,
    # between 2/3 and 1 of it in standard deviation. The first crossing is taken, which adds a little to the spread.
    one_edge = noise * np.sqrt(2.0 * np.pi) * blur
    most = np.hypot(one_edge / np.sqrt(2.0), 0.025 / blur)
    spread = np.sqrt(np.mean(np.square(errors)))
    assert spread < 1.1 * most
    assert spread > 0.4 * most
    assert abs(np.mean(errors)) < 5.0 * most / np.sqrt(count)


def test_a_start_beside_the_tube_finds_it() -> None:
    angle, width = 0.4, 8.0
    nx, ny = normal(angle)
    matte = stripe(angle, 0.0, width, 1.0)
    for off in (-6.5, -5.0, 5.0, 6.5):  # up to 0.75 widths are searched
        offset, found, _, _ = cross(matte, MIDDLE + off * nx, MIDDLE + off * ny, nx, ny, width, 1.0)
        assert offset == pytest.approx(-off, abs=0.1)
        assert found == pytest.approx(width, abs=0.2)


def test_where_no_tube_is_the_width_is_negative() -> None:
    matte = stripe(0.0, 0.0, 6.0, 1.0)
    assert cross(matte, MIDDLE, MIDDLE + 20.0, 0.0, 1.0, 6.0, 1.0)[1] == -1.0
    assert cross(np.zeros_like(matte), MIDDLE, MIDDLE, 0.0, 1.0, 6.0, 1.0)[1] == -1.0
    assert cross(matte, -50.0, -50.0, 0.0, 1.0, 6.0, 1.0)[1] == -1.0  # outside the picture there is nothing


def test_what_is_wider_than_two_tubes_has_no_width() -> None:
    matte = stripe(0.0, 0.0, 20.0, 1.0)
    assert cross(matte, MIDDLE, MIDDLE, 0.0, 1.0, 9.0, 1.0)[1] == 0.0
    assert cross(matte, MIDDLE, MIDDLE, 0.0, 1.0, 11.0, 1.0)[1] == pytest.approx(20.0, abs=0.1)
    assert cross(matte, MIDDLE, MIDDLE, 1.0, 0.0, 9.0, 1.0)[1] == 0.0  # along the stripe there is no edge


def test_the_edge_is_the_first_fall_below_the_level() -> None:
    matte = np.zeros((8, 24), dtype=np.float32)
    matte[:, :6] = 1.0
    matte[:, 12:16] = 1.0
    distance, slope = edge(matte, 2.0, 4.0, 1.0, 0.0, 20.0, 0.5)
    assert distance == pytest.approx(3.5)  # halfway from pixel 5 to pixel 6
    assert slope == pytest.approx(1.0)
    assert edge(matte, 2.0, 4.0, 1.0, 0.0, 3.0, 0.5) == (-1.0, 0.0)  # out of reach
    assert edge(matte, 2.0, 4.0, -1.0, 0.0, 20.0, 0.5)[0] == pytest.approx(2.25)  # the picture's end, between samples


def test_samples_are_bilinear_and_nothing_outside() -> None:
    rng = np.random.default_rng(4)
    matte = rng.uniform(size=(7, 9)).astype(np.float32)
    points = rng.uniform([-1.0, -1.0], [9.0, 7.0], (300, 2))
    corners = np.array([[0.0, 0.0], [8.0, 6.0], [8.0, 0.0], [0.0, 6.0], [8.0 + 1e-9, 3.0], [3.0, -1e-9]])
    points = np.vstack([points, corners])
    got = [sample(matte, x, y) for x, y in points]
    np.testing.assert_allclose(got, plain_sample(matte, points), atol=1e-12)
    line = line_samples(matte, np.array([-0.5, 1.0]), np.array([0.75, 0.25]), 14)
    at = np.array([-0.5, 1.0]) + np.arange(14)[:, None] * np.array([0.75, 0.25])
    np.testing.assert_allclose(line, plain_sample(matte, at), atol=1e-12)
