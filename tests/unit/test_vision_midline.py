"""The measured midline on a drawn arc of tube with a round end, whose midline and cap centre are known."""

from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

from cathxr.vision.midline import SPACING_PX, Midline, measured, smoothed
from cathxr.vision.segmentation import MatteArray

SIZE = 240
FINE = 6
"""Subpixels a side: an edge is right to 1 / (12 x 6) px at worst and to far less along a section."""
CASES = [
    (3.0, 0.6),
    (4.0, 0.6),
    (4.0, 1.0),
    (6.0, 1.0),
    (6.0, 1.5),
    (9.0, 0.6),
    (12.0, 1.5),
    (12.0, 2.5),
    (16.0, 1.0),
    (20.0, 2.5),
]
BENDS = [80.0, 400.0]


@dataclass(frozen=True, eq=False)
class Tube:
    """A tube of `width` px along an arc about `centre` with radius `bend` px, from the left edge to `cap`, its end."""

    matte: MatteArray
    path: np.ndarray
    centre: np.ndarray
    bend: float
    cap: np.ndarray
    heading: np.ndarray


def tube(width: float, blur: float, bend: float, *, noise: float = 0.0) -> Tube:
    """Return a tube drawn with subpixels, averaged, then blurred; and a rough path along it, entry first."""
    fine = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5
    x, y = np.meshgrid(fine, fine)
    centre = np.array([-30.0, 70.0 + bend])
    sweep = min(210.0 / bend, 2.0)
    heading = np.array([np.cos(sweep), np.sin(sweep)])
    cap = centre + bend * np.array([heading[1], -heading[0]])
    on_arc = np.arctan2(x - centre[0], centre[1] - y) <= sweep
    to_arc = np.abs(np.hypot(x - centre[0], y - centre[1]) - bend)
    distance = np.where(on_arc, to_arc, np.hypot(x - cap[0], y - cap[1]))
    covered = (distance <= 0.5 * width).reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3)).astype(np.float32)
    blurred = cv2.GaussianBlur(covered, (0, 0), blur, borderType=cv2.BORDER_REPLICATE)
    rng = np.random.default_rng(1)
    matte = (blurred + noise * rng.normal(size=blurred.shape)).astype(np.float32)
    # The path begins where sections no longer leave the picture, and is off by a twentieth of the width.
    angles = np.arange((30.0 + width) / bend, sweep, max(1.0, 0.35 * width) / bend)
    radii = bend + 0.05 * width * rng.normal(size=len(angles))
    path = centre + radii[:, None] * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    return Tube(matte, path, centre, bend, cap, heading)


def widening(width: float, blur: float) -> float:
    """Return by how much half the width grows where the blurs of both edges overlap, px.

    The lens' blur, a pixel's own (variance 1/12) and that of bilinear sampling (1/6 on average) add; the level is half
    of the mean over the middle two fifths of the apparent width.
    """
    half, spread = 0.5 * width, np.sqrt(blur**2 + 1.0 / 12.0 + 1.0 / 6.0)

    def height(at: float) -> float:
        return float(norm.cdf((at + half) / spread) - norm.cdf((at - half) / spread))

    def excess(at: float) -> float:
        return height(at) - 0.5 * float(np.mean([height(part * at) for part in (-0.4, -0.2, 0.0, 0.2, 0.4)]))

    return float(brentq(excess, 0.5 * half, 2.0 * width)) - half


def off_axis(one: Tube, line: Midline) -> np.ndarray:
    """Return how far outside the arc each midline point lies (N,), px."""
    return np.asarray(np.hypot(*(line.curve_px - one.centre).T) - one.bend)


@pytest.mark.parametrize("bend", BENDS)
@pytest.mark.parametrize(("width", "blur"), CASES)
def test_the_midline_and_the_end_are_within_their_budgets(width: float, blur: float, bend: float) -> None:
    one = tube(width, blur, bend)
    line = measured(one.matte, one.path, 1.1 * width, 0.95)
    assert line is not None
    off = off_axis(one, line)[1:]
    # Blur moves both edges of an arc inwards by blur^2 / (2 bend). Bilinear sampling leaves 0.03 px, 0.1 at worst.
    inwards = blur**2 / (2.0 * bend)
    assert np.sqrt(np.mean(np.square(off))) < 0.04 + 1.2 * inwards
    assert np.abs(off).max() < 0.1 + 3.0 * inwards
    # The cap's centre is one apparent radius behind the end's edge: a tube that looks wider has it further back.
    wider = widening(width, blur)
    end = line.curve_px[0] - one.cap
    assert abs(end @ one.heading) < 0.06 + wider
    # Across, it is reached on a straight line from the last section: at most one coarse step and a pixel away.
    straight = (2.0 * SPACING_PX + 1.0) ** 2 / (2.0 * bend)
    assert abs(end @ [-one.heading[1], one.heading[0]]) < 0.06 + straight
    # Of the tip both errors cancel but for a part: inside a round end the blur leaves less darkness than inside a side.
    tip = line.tip_px - one.cap - 0.5 * width * one.heading
    assert abs(tip @ one.heading) < 0.08 + 0.6 * wider
    assert np.median(line.half_width_px) == pytest.approx(0.5 * width + wider, abs=0.05)


@pytest.mark.parametrize("bend", BENDS)
def test_the_midline_is_whole_and_in_order(bend: float) -> None:
    one = tube(8.0, 1.0, bend)
    line = measured(one.matte, one.path, 8.0, 1.0)
    assert line is not None
    count = len(line.curve_px)
    assert line.normal_px.shape == (count, 2)
    assert line.sigma_px.shape == line.half_width_px.shape == (count,)
    np.testing.assert_allclose(np.linalg.norm(line.normal_px, axis=1), 1.0, atol=1e-12)
    # Tip first: angles about the arc's centre fall, from the cap to the path's beginning, and normals are radial.
    away = line.curve_px - one.centre
    angles = np.arctan2(away[:, 0], -away[:, 1])
    assert (np.diff(angles) < 0).all()
    assert abs(angles[-1] - np.arctan2(*(one.path[0] - one.centre) * [1, -1])) * bend < 2.0 * SPACING_PX
    radial = away / np.linalg.norm(away, axis=1, keepdims=True)
    assert np.abs((line.normal_px[1:] * radial[1:]).sum(axis=1)).min() > 0.999  # within 2.5 degrees
    # The tip is on the midline's continuation, one radius ahead of the cap's centre.
    ahead = line.tip_px - line.curve_px[0]
    assert np.linalg.norm(ahead) == pytest.approx(4.0, abs=0.1)
    assert ahead @ one.heading / np.linalg.norm(ahead) > 0.995
    assert 0.0 < line.tip_sigma_px < 0.2


@pytest.mark.parametrize("noise", [0.03, 0.06])
@pytest.mark.parametrize(("width", "blur"), [(6.0, 1.0), (12.0, 1.5)])
def test_with_noise_the_stated_sigma_is_that_of_the_errors(width: float, blur: float, noise: float) -> None:
    one = tube(width, blur, 400.0, noise=noise)
    line = measured(one.matte, one.path, width, 1.0)
    assert line is not None
    off = off_axis(one, line)[1:]
    # Two edges, each moved by noise over slope; interpolation averages neighbours, hence at most.
    most = np.hypot(noise * np.sqrt(2.0 * np.pi) * blur / np.sqrt(2.0), 0.035)
    spread = np.sqrt(np.mean(np.square(off)))
    assert spread < 1.2 * most
    # Some 70 points, neighbours not independent, and a sigma by median: within a factor of 1.6.
    assert 1.0 / 1.6 < spread / np.median(line.sigma_px) < 1.6
    end = line.curve_px[0] - one.cap
    assert np.linalg.norm(end) < 5.0 * most + 0.1
    assert abs(end @ one.heading) < 5.0 * line.tip_sigma_px + 0.05


def test_a_worse_path_gives_the_same_midline() -> None:
    one = tube(8.0, 1.0, 400.0)
    good = measured(one.matte, one.path, 8.0, 1.0)
    shifted = measured(one.matte, one.path + np.array([1.0, -1.5]), 8.0, 1.0)
    assert good is not None
    assert shifted is not None
    # Other sampling places, the same tube: both within the budget above.
    assert np.abs(off_axis(one, shifted)[1:]).max() < 0.12
    assert np.linalg.norm(shifted.tip_px - good.tip_px) < 0.12


def test_where_too_little_is_seen_there_is_no_midline() -> None:
    one = tube(8.0, 1.0, 400.0)
    assert measured(one.matte, one.path[:3], 8.0, 1.0) is None  # too few points
    assert measured(one.matte, one.path[-4:], 8.0, 1.0) is None  # shorter than 1.5 widths
    assert measured(np.zeros_like(one.matte), one.path, 8.0, 1.0) is None  # no tube
    assert measured(np.ones_like(one.matte), one.path, 8.0, 1.0) is None  # nothing but tube
    assert measured(one.matte, one.path + np.array([0.0, 60.0]), 8.0, 1.0) is None  # beside it


@pytest.mark.parametrize("half_window", [2, 5, 30, 1000])
@pytest.mark.parametrize("count", [5, 12, 61])
def test_smoothing_keeps_quadratics_ends_included(half_window: int, count: int) -> None:
    at = np.arange(count, dtype=np.float64)
    values = np.stack([3.0 - 0.5 * at + 0.02 * at**2, 100.0 + at], axis=1)
    # The window's pseudo-inverse has entries up to half^2 / 1 in its rounding: 1e-16 x 200 x 900.
    np.testing.assert_allclose(smoothed(values, half_window), values, atol=1e-10)


@pytest.mark.parametrize("half_window", [2, 4, 9])
def test_smoothing_is_the_least_squares_quadratic_of_each_window(half_window: int) -> None:
    values = np.random.default_rng(2).normal(size=(40, 2))
    got = smoothed(values, half_window)
    for i in range(40):
        centre = min(max(i, half_window), 39 - half_window)  # at the ends the outermost window's fit
        window = np.arange(centre - half_window, centre + half_window + 1)
        fit = np.polynomial.polynomial.polyfit(window - i, values[window], 2)
        np.testing.assert_allclose(got[i], fit[0], atol=1e-12)


@pytest.mark.parametrize(("count", "half_window"), [(4, 5), (3, 2), (40, 1), (40, 0)])
def test_too_small_a_window_changes_nothing_and_shares_nothing(count: int, half_window: int) -> None:
    values = np.random.default_rng(3).normal(size=(count, 2))
    got = smoothed(values, half_window)
    np.testing.assert_array_equal(got, values)
    got[:] = 0.0
    assert not (values == 0.0).any()
