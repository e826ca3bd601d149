"""The compiled B-spline basis against SciPy's, ends and outside included."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cathxr.tracking.spline import DEGREE, CubicBasis

SPANS = [1, 2, 3, 7, 28]


def reference(basis: CubicBasis) -> BSpline:
    """Return SciPy's spline whose coefficients are the identity: its values are the basis."""
    return BSpline(basis.knots, np.eye(basis.count), DEGREE)


def parameters(spans: int) -> np.ndarray:
    """Return parameters (N,): random ones, every knot, and one rounding on either side of it."""
    knots = np.linspace(0.0, 1.0, spans + 1)
    around = np.concatenate([knots, np.nextafter(knots, 2.0)[:-1], np.nextafter(knots, -1.0)[1:]])
    return np.concatenate([np.random.default_rng(0).uniform(0.0, 1.0, 200), around])


@pytest.mark.parametrize("spans", SPANS)
def test_values_and_slopes_are_scipys(spans: int) -> None:
    basis = CubicBasis(spans)
    at = parameters(spans)
    values, slopes = basis.values_and_slopes(at)
    assert values.shape == slopes.shape == (len(at), spans + 3)
    # Values are at most 1, slopes at most 3 spans, each some ten roundings; both are continuous at knots.
    np.testing.assert_allclose(values, reference(basis)(at), atol=1e-14)
    np.testing.assert_allclose(slopes, reference(basis).derivative()(at), atol=1e-13 * spans)
    np.testing.assert_array_equal(basis.values(at), values)
    np.testing.assert_array_equal(basis.slopes(at), slopes)


@pytest.mark.parametrize("spans", SPANS)
def test_outside_the_first_and_last_piece_go_on(spans: int) -> None:
    basis = CubicBasis(spans)
    at = np.array([-0.3, -0.01, 1.001, 1.2])
    values, slopes = basis.values_and_slopes(at)
    outside = reference(basis)(at, extrapolate=True)
    np.testing.assert_allclose(values, outside, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(slopes, reference(basis).derivative()(at, extrapolate=True), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("spans", SPANS)
def test_the_ends_are_the_first_and_last_control_points(spans: int) -> None:
    basis = CubicBasis(spans)
    values, slopes = basis.values_and_slopes(np.array([0.0, 1.0]))
    np.testing.assert_array_equal(values[0], np.eye(basis.count)[0])
    np.testing.assert_allclose(values[1], np.eye(basis.count)[-1], atol=1e-15)
    expected = np.zeros((2, basis.count))  # and the curve leaves them towards their neighbours
    expected[0, :2] = [-3.0 * spans, 3.0 * spans]
    expected[1, -2:] = [-3.0 * spans, 3.0 * spans]
    np.testing.assert_allclose(slopes, expected, atol=1e-12 * spans)


@pytest.mark.parametrize("spans", SPANS)
def test_the_basis_sums_to_one_and_is_not_negative(spans: int) -> None:
    values, slopes = CubicBasis(spans).values_and_slopes(parameters(spans))
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(slopes.sum(axis=1), 0.0, atol=1e-12)
    assert (values >= -1e-15).all()
    assert ((values != 0.0).sum(axis=1) <= 4).all()


@pytest.mark.parametrize("spans", SPANS)
def test_third_derivatives_are_those_of_each_piece(spans: int) -> None:
    basis = CubicBasis(spans)
    got = basis.third_derivatives()
    middles = (np.arange(spans) + 0.5) / spans
    np.testing.assert_allclose(got, reference(basis).derivative(3)(middles), rtol=1e-12)
    # By the compiled slopes: their second difference within a piece is exact, they are quadratic there.
    step = 0.25 / spans
    before, at, after = (basis.slopes(middles + move) for move in (-step, 0.0, step))
    np.testing.assert_allclose(got, (before - 2.0 * at + after) / step**2, rtol=1e-9, atol=1e-9 * spans**3)


@pytest.mark.parametrize("spans", [0, -1])
def test_a_basis_without_pieces_is_refused(spans: int) -> None:
    with pytest.raises(ValueError, match="spans: expected at least 1"):
        CubicBasis(spans)
