"""A fitted curve that turns back on itself within the rounded end is no catheter: both silhouettes would not tell."""

import numpy as np
import pytest

from cathxr.core import FloatArray
from cathxr.tracking.judge_kernels import folded_at_tip
from cathxr.tracking.spline import CubicBasis

RADIUS_MM = 1.5
SPANS = 10


def control_of(curve: FloatArray) -> FloatArray:
    """Return the control points (n, 3) of the spline nearest to points evenly spaced in its parameter."""
    values = CubicBasis(SPANS).values(np.linspace(0.0, 1.0, len(curve)))
    return np.asarray(np.linalg.lstsq(values, curve, rcond=None)[0], dtype=np.float64)


def bent(radius_mm: float) -> FloatArray:
    """Return 60 mm of a catheter whose last quarter is a bend, cap's centre first."""
    along = np.linspace(0.0, 60.0, 400)
    turn = np.clip(along - 45.0, 0.0, None) / radius_mm
    steps = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1) * (along[1] - along[0])
    return np.cumsum(steps, axis=0)[::-1].copy()


@pytest.mark.parametrize("radius_mm", [8.0, 20.0, 1e6])
def test_a_bend_is_no_fold(radius_mm: float) -> None:
    assert not folded_at_tip(SPANS, control_of(bent(radius_mm)), RADIUS_MM)


@pytest.mark.parametrize("back_mm", [0.5, 1.5, 3.0])
def test_a_beginning_that_leads_backwards_is_a_fold(back_mm: float) -> None:
    control = control_of(bent(20.0))
    body = control[3] - control[1]
    control[0] = control[1] + back_mm * body / np.linalg.norm(body)
    assert folded_at_tip(SPANS, control, RADIUS_MM)


def test_what_is_no_curve_is_left_to_others() -> None:
    assert not folded_at_tip(SPANS, np.zeros((SPANS + 3, 3)), RADIUS_MM)
