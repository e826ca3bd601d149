"""A fitted curve that turns back on itself at the inlet must not turn the tip's frame around."""

import numpy as np
import pytest

from cathxr.core import FloatArray
from cathxr.geometry import tangents, tip_pose
from cathxr.tracking.centreline import unfolded


def straight(start_mm: float = 15.0, tip_mm: float = 75.0) -> FloatArray:
    """Return a curve, tip first, that bends gently and begins where the inlet stops hiding it."""
    x = np.linspace(tip_mm, start_mm, 240)
    return np.stack([x, 0.002 * (x - start_mm) ** 2, np.zeros_like(x)], axis=1)


def folded(length_mm: float) -> FloatArray:
    """Return the same with a hairpin at its beginning, `length_mm` long, as a spline makes it."""
    along = np.linspace(0.0, 1.0, 30)[1:]
    hairpin = np.stack([15.0 + length_mm * along**2, 0.05 * along, 0.02 * along], axis=1)
    return np.vstack([straight(), hairpin])


def _unfolded(curve: FloatArray) -> FloatArray:
    return curve[: unfolded(curve, len(curve))]


def test_a_curve_without_a_fold_is_left_alone() -> None:
    np.testing.assert_array_equal(_unfolded(straight()), straight())


@pytest.mark.parametrize("length_mm", [0.1, 1.0, 3.0])
def test_a_short_fold_is_cut_off_with_the_way_into_it(length_mm: float) -> None:
    got = _unfolded(folded(length_mm))
    assert (tangents(got)[:, 0] < -0.9).all()
    assert got[0, 0] == 75.0
    # The fold itself, as much again, and a step of 0.25 mm.
    assert got[-1, 0] <= 15.0 + 1.2 * length_mm + 0.5
    roll_zero = np.array([0.0, -1.0, 0.0])
    frame, expected = (tip_pose(each, zero_direction=roll_zero, roll_rad=0.0).rotation for each in (got, straight()))
    # A plane curve carries a normal in its plane as it is, wherever it begins.
    np.testing.assert_allclose(frame, expected, atol=1e-6)


def test_a_bend_back_is_not_a_fold() -> None:
    # A long stretch that leads back is the catheter's: a curl that really enters against the axis is for others to see.
    curve = folded(8.0)
    np.testing.assert_array_equal(_unfolded(curve), curve)
