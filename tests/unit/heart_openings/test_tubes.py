"""A tube that carries a vessel on has the mouth's shape, the direction's way and the wanted length."""

import numpy as np
import pytest

from cathxr.heart.model import Opening
from cathxr.heart.tubes import carried_on, end_of
from cathxr.heart.volume import Grid

GRID = Grid((80, 60, 60), np.diag([0.5, 0.5, 0.5, 1.0]))
MOUTH = Opening("x", "X", "right_atrium", np.array([15.0, 15.0, 5.25]), np.array([0.0, 0.0, 1.0]), 10.0)


@pytest.mark.parametrize("slant", [0.0, 0.6])
def test_volume_and_far_end_are_those_of_a_cylinder_over_the_mouth(slant: float) -> None:
    direction = np.array([np.sin(slant), 0.0, np.cos(slant)])
    mask = carried_on(MOUTH, direction, 20.0, GRID)
    # Discs parallel to the mouth, stacked as high as the way rises: Cavalieri.
    expected = np.pi * (0.47 * 10.0) ** 2 * 20.0 * np.cos(slant)
    assert mask.sum() * GRID.voxel_ml * 1000.0 == pytest.approx(expected, rel=0.02)
    k, j, i = np.nonzero(mask)
    top = GRID.to_ct(np.stack([i, j, k], axis=1))[k == k.max()]
    end = end_of(MOUTH, "v", "V", direction, 20.0)
    assert end.key == "v_end"
    assert end.structure == "v"
    # The topmost layer lies within a voxel below the end, and is centred as the end is.
    assert np.abs(top.mean(axis=0) - end.centroid_mm).max() < 0.6


def test_a_way_into_the_chamber_is_refused() -> None:
    with pytest.raises(ValueError, match="leads out"):
        carried_on(MOUTH, np.array([0.0, 0.0, -1.0]), 20.0, GRID)
