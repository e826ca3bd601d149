"""The twin's torsion: of the tip's frame, by length and by bend, and of nothing else."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from cathxr.core import Rig
from cathxr.geometry import tip_pose
from cathxr.geometry.roll import tip_roll_rad, total_bend_rad
from cathxr.storage.rig_file import example_rig
from cathxr.twin.settings import TwinSettings
from cathxr.twin.world import TwinWorld

PER_MM, PER_QUARTER = 0.06, -5.0


def twisted_rig() -> Rig:
    rig = example_rig()
    assert rig.roll is not None
    roll = replace(rig.roll, torsion_deg_per_mm=PER_MM, torsion_deg_per_quarter_bend=PER_QUARTER)
    return replace(rig, roll=roll)


@pytest.mark.parametrize("manoeuvre", ["smooth", "curl", "still"])
@pytest.mark.parametrize("t_s", [0.0, 3.7])
def test_it_turns_the_tip_about_its_tangent_as_stated(manoeuvre: str, t_s: float) -> None:
    rig, t_ns = twisted_rig(), round(t_s * 1e9)
    plain = TwinWorld(rig, seed=3, settings=TwinSettings(manoeuvre=manoeuvre)).truth(t_ns, points=200)
    settings = TwinSettings(manoeuvre=manoeuvre, torsion_deg_per_mm=PER_MM, torsion_deg_per_quarter_bend=PER_QUARTER)
    twisted = TwinWorld(rig, seed=3, settings=settings).truth(t_ns, points=200)
    assert plain.shape_box is not None
    assert plain.box_from_tip is not None
    assert twisted.shape_box is not None
    assert twisted.box_from_tip is not None
    np.testing.assert_array_equal(twisted.shape_box, plain.shape_box)
    assert twisted.roll_rad == plain.roll_rad
    between = plain.box_from_tip.rotation.T @ twisted.box_from_tip.rotation
    turned = np.arctan2(between[1, 0], between[0, 0])
    bend = total_bend_rad(plain.shape_box)
    expected = radians(PER_MM * plain.length_mm + PER_QUARTER * bend / (np.pi / 2))
    # The bend by tangents 5 mm apart misses 2 degrees of bend at most, where it changes sides: of 5 per 90, 0.11.
    assert turned == pytest.approx(expected, abs=radians(0.15))
    # What a tracker with this rig would say of the same centreline.
    turn = tip_roll_rad(rig.roll, shape_box=twisted.shape_box, roll_rad=twisted.roll_rad)
    told = tip_pose(twisted.shape_box, zero_direction=rig.zero_direction, roll_rad=turn)
    off = np.arccos((np.trace(told.rotation.T @ twisted.box_from_tip.rotation) - 1.0) / 2.0)
    assert off < radians(0.3)  # the above, and 0.1 degrees for 200 points instead of the integrator's steps


def test_torsion_must_be_a_number() -> None:
    with pytest.raises(ValueError, match="torsion_deg_per_mm: expected a finite number"):
        TwinSettings(torsion_deg_per_mm=float("nan"))
