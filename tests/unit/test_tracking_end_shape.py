"""What a tip is unsure by where the catheter's end is not the rounded one that is fitted."""

from dataclasses import replace

import numpy as np
import pytest

from cathxr.core import Detection, FloatArray
from cathxr.tracking.end_shape import other_end_mm, typical_off
from cathxr.tracking.fit import CurveFit

RADIUS_MM, RADIUS_PX, RAYS = 1.5, 6.0, 31


def view(camera: str) -> Detection:
    """Return a view with an end's outline of RAYS points."""
    return Detection(
        camera,
        0,
        0,
        curve_px=np.zeros((5, 2)),
        normal_px=np.tile([0.0, 1.0], (5, 1)),
        sigma_px=np.ones(5),
        half_width_px=np.full(5, RADIUS_PX),
        tip_px=np.zeros(2),
        tip_sigma_px=0.1,
        end_px=np.zeros((RAYS, 2)),
        end_sigma_px=np.full(RAYS, 0.1),
    )


def fit_of(*off_px: FloatArray) -> CurveFit:
    """Return a fit whose outlines are off by so much, view by view; all of them on the rounded end."""
    off = np.concatenate(off_px)
    return CurveFit(4, np.zeros((7, 3)), np.zeros((21, 12)), 0.1, 0.0, off, np.ones(len(off), dtype=bool))


def noise(spread_px: float, seed: int = 1) -> FloatArray:
    return np.random.default_rng(seed).normal(0.0, spread_px, RAYS)


VIEWS = [view("top"), view("front")]
# A square cut's corners stick out of the circle through its face, and the face lies within it.
SQUARE = RADIUS_PX * (0.8 / np.maximum(np.abs(np.cos(np.linspace(-1.0, 1.0, RAYS))), 0.7) - 1.0)


def added_mm(fit: CurveFit, doubtful: str | None = None) -> float:
    return other_end_mm(fit, VIEWS, np.empty(len(fit.end_off_px)), radius_mm=RADIUS_MM, doubtful=doubtful)


def test_a_rounded_end_adds_nothing() -> None:
    assert added_mm(fit_of(noise(0.1), noise(0.1, 2))) == 0.0
    assert added_mm(fit_of(np.zeros(RAYS), noise(0.25, 2))) < 0.1


def test_an_end_of_another_shape_may_be_half_a_radius_longer_or_shorter() -> None:
    assert added_mm(fit_of(noise(0.1), SQUARE)) == pytest.approx(0.5 * RADIUS_MM)
    assert added_mm(fit_of(SQUARE, noise(0.1))) == pytest.approx(0.5 * RADIUS_MM)


def test_a_view_whose_outline_had_no_part_says_nothing() -> None:
    assert added_mm(fit_of(noise(0.1), SQUARE), doubtful="front") == 0.0


def test_debris_at_a_rounded_end_does_not_change_its_shape() -> None:
    dirty = noise(0.1)
    dirty[3:12] = 3.0
    assert added_mm(fit_of(noise(0.1, 2), dirty)) == 0.0


def test_few_points_on_the_end_say_nothing() -> None:
    off, caps = np.full(RAYS, 2.0), np.zeros(RAYS, dtype=bool)
    caps[:7] = True
    assert typical_off(off, caps, np.empty(RAYS)) == 0.0
    fit = replace(fit_of(off, noise(0.1)), caps=np.concatenate([caps, np.ones(RAYS, dtype=bool)]))
    assert added_mm(fit) == 0.0
    caps[:20] = True
    assert typical_off(off, caps, np.empty(RAYS)) == pytest.approx(2.0 * 1.4826)
    assert typical_off(off, caps, np.empty(RAYS)) == typical_off.py_func(off, caps, np.empty(RAYS))


def test_whole_silhouettes_are_asked_about_their_end_too() -> None:
    fit = fit_of(noise(0.1), SQUARE, noise(0.1, 3))
    ends = np.concatenate([np.zeros(RAYS), np.ones(RAYS), np.zeros(RAYS)]).astype(bool)
    assert added_mm(replace(fit, caps=ends)) == pytest.approx(0.5 * RADIUS_MM)
    assert added_mm(replace(fit, caps=np.roll(ends, RAYS))) == 0.0
