"""The compiled fit against plain NumPy: banded systems, first guess, one step of Gauss-Newton, the tip's variance."""

import numpy as np
import pytest

from cathxr.core import Detection, FloatArray
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import example_rig
from cathxr.tracking.band import backward, factorise, forward
from cathxr.tracking.fit import camera_table, fit_curve, guess_of
from cathxr.tracking.fit_kernels import gauss_newton
from cathxr.tracking.fit_rows import one_edge
from cathxr.tracking.guess_kernels import EXTRA_POINTS, carried_to_inlet, fit_points, place, spans_of
from cathxr.tracking.judge_kernels import tip_variance
from cathxr.tracking.pair_work import PairWork
from cathxr.tracking.spline import CubicBasis

RIG = example_rig()
CAMERAS = [CameraModel.of(RIG.cameras[each]) for each in ("top", "front")]
RADIUS_MM = 1.5


def curve(count: int, *, length_mm: float = 80.0) -> FloatArray:
    """Return a bent catheter (N, 3) mm, tip first, that enters at the box's origin."""
    x = np.linspace(length_mm, 0.0, count)
    return np.stack([x, 0.003 * x**2, -0.002 * x**2], axis=1)


def detection(camera: CameraModel, name: str, rng: np.random.Generator, *, noise_px: float = 0.02) -> Detection:
    """Return what a camera measures of `curve`: its midline, and the outline of a ball of 1.5 mm at its end."""
    line, jacobian = camera.project_with_jacobian(curve(70))
    step = np.gradient(line, axis=0)
    normal = np.stack([-step[:, 1], step[:, 0]], axis=1) / np.linalg.norm(step, axis=1, keepdims=True)
    half = RADIUS_MM * np.linalg.norm(np.einsum("ni,nij->nj", normal, jacobian), axis=1)
    ahead = -step[0] / np.linalg.norm(step[0])
    turns = np.linspace(-1.2, 1.2, 21)
    rays = np.stack(
        [np.cos(turns) * ahead[0] - np.sin(turns) * ahead[1], np.sin(turns) * ahead[0] + np.cos(turns) * ahead[1]], 1
    )
    reach = RADIUS_MM * np.linalg.norm(rays @ jacobian[0], axis=1)
    return Detection(
        name, 0, 0,
        curve_px=line + noise_px * rng.normal(size=(70, 1)) * normal,
        normal_px=normal,
        sigma_px=np.full(70, 0.05),
        half_width_px=half,
        tip_px=line[0] + half[0] * ahead,
        tip_sigma_px=0.05,
        end_px=line[0] + rays * reach[:, None],
        end_sigma_px=np.full(21, 0.05),
    )  # fmt: skip


@pytest.fixture
def work() -> PairWork:
    rng = np.random.default_rng(0)
    result = PairWork()
    result.take([detection(camera, name, rng) for camera, name in zip(CAMERAS, ("top", "front"), strict=True)])
    return result


def dense(band: FloatArray) -> FloatArray:
    """Return the symmetric matrix whose lower band (N, W) is given."""
    count, width = band.shape
    result = np.zeros((count, count))
    for i in range(count):
        for d in range(min(i, width - 1) + 1):
            result[i, i - d] = result[i - d, i] = band[i, d]
    return result


@pytest.mark.parametrize(("count", "width"), [(5, 2), (30, 4), (93, 12)])
def test_banded_systems_are_solved_as_dense_ones(count: int, width: int) -> None:
    rng = np.random.default_rng(count)
    band = rng.normal(size=(count, width))
    band[:, 0] = 2.0 * width + np.abs(band[:, 0])  # diagonally dominant: positive definite
    right = rng.normal(size=(count, 3))
    expected = np.linalg.solve(dense(band), right)
    got, factor = right.copy(), band.copy()
    assert factorise(factor, count)
    forward(factor, count, got)
    np.testing.assert_allclose(got, np.linalg.solve(np.linalg.cholesky(dense(band)), right), atol=1e-12)
    backward(factor, count, got)
    np.testing.assert_allclose(got, expected, atol=1e-12)


def test_what_is_not_positive_definite_is_told() -> None:
    band = np.ones((4, 2))  # tridiagonal of ones: determinant of the leading block of two is 0
    assert not factorise(band, 4)


def test_the_first_guess_is_the_least_squares_spline_with_its_prior(work: PairWork) -> None:
    points = curve(100)
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    spans = spans_of(length)
    basis = CubicBasis(spans)
    scale = 1e-9
    assert fit_points(spans, points, 100, length, basis.jerk_information(), scale, work.arrays)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]) / length
    rows = basis.values(np.minimum(along, 1.0)) / 0.5
    jerk = basis.third_derivatives()
    prior = jerk.T @ jerk * scale + 1e-9 * np.eye(basis.count)
    expected = np.linalg.solve(rows.T @ rows + prior, rows.T @ (points / 0.5))
    np.testing.assert_allclose(work.arrays.control[: basis.count], expected, atol=1e-8)
    np.testing.assert_allclose(dense(work.arrays.prior[: basis.count]), prior, rtol=1e-9, atol=1e-12)


def test_each_point_is_placed_at_its_foot_on_the_curve(work: PairWork) -> None:
    points = curve(100)
    line = CAMERAS[0].project(points)
    furthest = place(camera_table(CAMERAS)[0], points, (0, 70), work.arrays)
    step = np.diff(line, axis=0)
    for i in range(70):
        x = work.arrays.curve[i]
        share = np.clip(((x - line[:-1]) * step).sum(axis=1) / np.square(step).sum(axis=1), 0.0, 1.0)
        off = np.linalg.norm(x - line[:-1] - share[:, None] * step, axis=1)
        j = int(np.argmin(off))
        assert work.arrays.at[i] == pytest.approx((j + share[j]) / 99.0, abs=1e-9)
    assert furthest == work.arrays.at[:70].max()


@pytest.mark.parametrize(("start_mm", "reaches"), [(-3.0, True), (0.2, True), (10.0, True), (30.0, False)])
def test_a_curve_is_cut_or_carried_on_to_the_inlet(start_mm: float, reaches: bool) -> None:
    given = curve(60)
    given[:, 0] = np.linspace(80.0, start_mm, 60)
    room = np.zeros((60 + EXTRA_POINTS, 3))
    room[:60] = given
    count, at_inlet = carried_to_inlet(room, 60)
    assert at_inlet == reaches
    if start_mm < 0.0:
        last = int(np.flatnonzero(given[:, 0] > 0.0)[-1])
        share = given[last, 0] / (given[last, 0] - given[last + 1, 0])
        assert count == last + 2
        np.testing.assert_allclose(room[count - 1], given[last] + share * (given[last + 1] - given[last]), atol=1e-12)
    elif start_mm == 10.0:
        # straight on along the chord of the last five millimetres
        far = np.linalg.norm(given - given[-1], axis=1)
        chord = given[-1] - given[int(np.argmax(far < 5.0))]
        np.testing.assert_allclose(room[count - 1], given[-1] - given[-1, 0] / chord[0] * chord, atol=1e-9)
    else:
        assert count == 60


def test_the_fit_finds_the_curve_and_its_variance(work: PairWork) -> None:
    table = camera_table(CAMERAS)
    at = np.concatenate([np.linspace(0.0, 1.0, 70)] * 2)
    guess = guess_of(curve(100) + 0.4, at, work)
    assert guess is not None
    fit = fit_curve(table, work, guess, radius_mm=RADIUS_MM)
    assert fit is not None
    # two views of 4 px a mm, 0.02 px of noise on each of 140 points: a few microns
    np.testing.assert_allclose(fit.points(np.array([0.0]))[0], curve(70)[0], atol=0.02)
    assert fit.rms_px < 0.06
    assert np.abs(fit.end_off_px).max() < 0.1
    # the tip is one radius beyond the beginning along its tangent: its derivative, by differences
    size = 3 * len(fit.control)

    def tip(control: FloatArray) -> FloatArray:
        velocity = CubicBasis(fit.spans).slopes(np.array([0.0]))[0] @ control
        return np.asarray(control[0] - RADIUS_MM * velocity / np.linalg.norm(velocity))

    gain = np.zeros((3, size))
    for k in range(size):
        moved = fit.control.copy().reshape(-1)
        moved[k] += 1e-6
        gain[:, k] = (tip(moved.reshape(-1, 3)) - tip(fit.control)) / 1e-6
    lower = np.tril(dense(fit.factor))
    expected = np.trace(gain @ np.linalg.inv(lower @ lower.T) @ gain.T)
    assert np.trace(fit.covariance_of(gain)) == pytest.approx(expected, rel=1e-6)
    got = tip_variance(fit.spans, fit.control, fit.factor, RADIUS_MM, work.arrays.gain)
    assert got == pytest.approx(expected, rel=1e-4)


def test_one_step_is_that_of_plain_gauss_newton(work: PairWork) -> None:
    arrays, table = work.arrays, camera_table(CAMERAS)
    at = np.concatenate([np.linspace(0.0, 1.0, 70)] * 2)
    guess = guess_of(curve(100) + 0.1, at, work)
    assert guess is not None
    size = len(guess.control)
    arrays.control[:size], arrays.prior[:size], arrays.at[:140] = guess.control, guess.prior, guess.at
    entry = np.ones((3, 2))
    gauss_newton(guess.spans, table, entry, RADIUS_MM, 0.2, 1, -1, work.points, work.outline, arrays)
    # the compiled code leaves where it put each point: the rows can be made again
    basis = CubicBasis(guess.spans)
    rows, residuals, sigmas = [], [], []
    used = arrays.at[:140] >= 0.0
    for i in np.flatnonzero(used):
        camera = CAMERAS[arrays.of_view[i]]
        value = basis.values(arrays.at[[i]])[0]
        seen, jacobian = camera.project_with_jacobian((value @ guess.control)[None])
        normal = arrays.normal[i]
        rows.append(np.outer(value, normal @ jacobian[0]).reshape(-1))
        residual, sigma = float(normal @ (arrays.curve[i] - seen[0])), float(arrays.sigma[i])
        wider = arrays.half[i] - arrays.balls[arrays.of_view[i]] * np.linalg.norm(normal @ jacobian[0])
        if abs(wider) > 3.0 * sigma:
            residual, sigma = one_edge(residual, wider, sigma)
        residuals.append(residual)
        sigmas.append(sigma)
    ends, views = [], arrays.end_view[: work.outline]
    for i in range(work.outline):
        camera = CAMERAS[views[i]]
        value = basis.values(arrays.end_at[[i]])[0]
        seen, jacobian = camera.project_with_jacobian((value @ guess.control)[None])
        away = arrays.end[i] - seen[0]
        away_unit = away / np.linalg.norm(away)
        rows.append(np.outer(value, away_unit @ jacobian[0]).reshape(-1))
        ends.append(np.linalg.norm(away) - arrays.balls[views[i]] * np.linalg.norm(away_unit @ jacobian[0]))
    design, residual = np.array(rows), np.array(residuals + ends)
    sigma = np.array(sigmas + [0.05] * work.outline)
    noise = np.clip(1.4826 * np.median(np.abs(residual / sigma)), 1.0, 50.0)
    for which in range(2):  # a real end is no perfect ball
        part = len(residuals) + np.flatnonzero(views == which)
        _, jacobian = CAMERAS[which].project_with_jacobian(guess.control[:1])
        most = 0.25 * arrays.balls[which] * np.linalg.norm(jacobian[0, 0])
        spread = 1.4826 * np.median(np.abs(residual[part]))
        sigma[part] = np.minimum(np.maximum(sigma[part], spread), np.maximum(most, sigma[part]))
    scaled = np.abs(residual) / (sigma * noise)
    weight = np.minimum(1.0, 2.5 / np.maximum(scaled, 1e-12)) / (sigma * noise) ** 2
    prior = np.kron(dense(guess.prior), np.eye(3))
    last, other = np.eye(size)[-1], np.eye(size)[-2]
    step_of = last - other
    prior += np.kron(np.outer(last, last) + np.outer(step_of, step_of), np.eye(3))
    matrix = design.T @ (weight[:, None] * design) + prior
    right = design.T @ (weight * residual) - prior @ guess.control.reshape(-1)
    step = np.linalg.solve(matrix, right).reshape(-1, 3)
    np.testing.assert_allclose(arrays.control[:size] - guess.control, step, atol=1e-6)
    lower = np.tril(dense(arrays.band[: 3 * size]))
    np.testing.assert_allclose(lower @ lower.T, matrix, rtol=1e-9, atol=1e-6 * matrix.max())


def test_the_next_pair_uses_the_same_memory(work: PairWork) -> None:
    before = work.arrays
    rng = np.random.default_rng(1)
    found = [detection(camera, name, rng) for camera, name in zip(CAMERAS, ("top", "front"), strict=True)]
    work.take(found)
    assert work.arrays is before
    np.testing.assert_array_equal(work.arrays.curve[70:140], found[1].curve_px)
    work.take(found * 3)  # more than there is room for
    assert work.arrays is not before
    np.testing.assert_array_equal(work.arrays.end[-1], work.arrays.end[-1])
    assert work.points == 6 * 70
