"""The compiled centreline against a plain one: from the tip to the inlet's plane."""

import numpy as np
import pytest

from cathxr.core import FloatArray
from cathxr.tracking.centreline import DENSE, NOT_INSERTED, NOT_SEEN, centreline, curve_room
from cathxr.tracking.spline import CubicBasis

RADIUS_MM = 1.5
SPANS = 8


def controls(end_mm: float) -> FloatArray:
    """Return control points (11, 3) mm of a gentle bend from x = 60 to `end_mm`."""
    x = np.linspace(60.0, end_mm, SPANS + 3)
    return np.stack([x, 0.004 * (x - end_mm) ** 2, 0.1 * x], axis=1)


def plain(control: FloatArray) -> FloatArray:
    """Return the centreline of a spline that crosses x = 0, or ends near it."""
    curve = CubicBasis(SPANS).values(np.linspace(0.0, 1.0, DENSE)) @ control
    out = curve[0] - curve[1]
    dense = np.vstack([curve[0] + RADIUS_MM * out / np.linalg.norm(out), curve])
    behind = np.flatnonzero((dense[:-1, 0] > 0.0) & (dense[1:, 0] <= 0.0))
    if behind.size:
        last = int(behind[-1])
        share = dense[last, 0] / (dense[last, 0] - dense[last + 1, 0])
        return np.vstack([dense[: last + 1], dense[last] + share * (dense[last + 1] - dense[last])])
    near = int(np.argmax(np.linalg.norm(dense - dense[-1], axis=1) < 5.0))
    chord = dense[-1] - dense[near]
    return np.vstack([dense, dense[-1] - dense[-1, 0] / chord[0] * chord])


@pytest.mark.parametrize("end_mm", [-4.0, -0.01, 0.01, 6.0, 20.0])
def test_it_goes_from_the_tip_to_the_inlets_plane(end_mm: float) -> None:
    room = curve_room()
    count = centreline(SPANS, controls(end_mm), RADIUS_MM, room)
    expected = plain(controls(end_mm))
    assert count == len(expected)
    np.testing.assert_allclose(room[:count], expected, atol=1e-9)
    assert room[count - 1, 0] == 0.0


def test_what_begins_too_far_away_is_not_seen_and_what_is_too_short_not_inserted() -> None:
    assert centreline(SPANS, controls(30.0), RADIUS_MM, curve_room()) == NOT_SEEN
    backwards = controls(5.0)[::-1].copy()  # the beginning leads away from the inlet
    assert centreline(SPANS, backwards, RADIUS_MM, curve_room()) == NOT_SEEN
    short = controls(0.0) * 1e-3
    short[:, 0] -= 1.0  # its tip is 0.56 mm in front of the inlet
    assert centreline(SPANS, short, RADIUS_MM, curve_room()) == NOT_INSERTED
