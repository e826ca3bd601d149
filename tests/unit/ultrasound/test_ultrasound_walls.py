"""Interfaces: the impedance ratio gives the echo, the angle takes it away, what is reflected does not go on."""

import math

import numpy as np
import pytest

from cathxr.ultrasound import Resolved, simulate

from ...ultrasound_support.phantoms import QUIET, decibel, moved, phantom, plane, share_within, voxel_centres

CENTRE = slice(94, 98)


def _peak(field: object) -> float:
    image = simulate(field, moved(), QUIET)  # type: ignore[arg-type]
    return float(image.envelope[CENTRE].max(axis=1).mean())


@pytest.mark.parametrize("at_mm", [40.0, 40.25, 40.5])
@pytest.mark.parametrize("ratio", [1.02, 1.05, 0.83, 2.0, 4.0, 0.25])
def test_the_impedance_ratio_gives_the_reflection(ratio: float, at_mm: float) -> None:
    """R = |Z2 - Z1| / (Z2 + Z1), less what the first half of the interface has already kept back both ways.

    15 %: where the interface lies between two voxels takes off up to 8 %, the axial blur 4 %, the 8-bit code of the
    faintest interface (a square of 1 in 30 steps) 3 %.
    """
    reflection = abs(ratio - 1.0) / (ratio + 1.0)
    expected = reflection * math.sqrt(1.0 - reflection**2)
    assert _peak(plane(ratio, at_mm)) == pytest.approx(expected, rel=0.15)


def test_a_wall_is_where_it_is() -> None:
    image = simulate(plane(1.05, 40.0), moved(), QUIET)
    found = image.ranges_mm[image.envelope[CENTRE].mean(axis=0).argmax()]
    assert found == pytest.approx(40.0, abs=0.3)  # a third of a voxel


def test_a_wall_falls_with_incidence_as_the_cosine_to_the_power() -> None:
    """cos³ times what the beam's width takes off the peak of a slanted line (variances across the line add).

    Within 10 % near normal incidence, and further out as at an angle 4 degrees off: the edge is as sharp as the voxels
    hold, and differences over 2.5 voxels see less of a slope the more it is along their axis. n = 2 would look like 49
    degrees at 60.
    """
    resolved = Resolved.of(QUIET)
    line, axial = resolved.wall_mm**2, resolved.sigma_axial_mm**2
    lateral = (resolved.sigma_lateral_rad * (40.0 + QUIET.apex_mm)) ** 2
    straight = _peak(plane(1.2, 40.0))
    for degrees in (15.0, 30.0, 45.0, 60.0, 68.0):
        tilt = np.radians(degrees)
        kept = math.sqrt((line + axial) / (line + axial * math.cos(tilt) ** 2 + lateral * math.sin(tilt) ** 2))
        share = _peak(plane(1.2, 40.0, tilt)) / straight / kept
        if degrees < 20.0:
            assert share == pytest.approx(math.cos(tilt) ** 3, rel=0.1)
        else:
            assert np.degrees(np.arccos(share ** (1.0 / 3.0))) == pytest.approx(degrees, abs=4.0)


def test_an_interface_keeps_back_what_it_reflects() -> None:
    """1 - R² of an amplitude passes both ways; 20 %: the profile's squared slope is a Gaussian's only roughly."""
    for ratio in (0.25, 2.0, 4.0):
        reflection = abs(ratio - 1.0) / (ratio + 1.0)
        loss = simulate(plane(ratio, 40.0), moved(), QUIET).loss_db[48, -1]
        assert loss == pytest.approx(-decibel(1.0 - reflection**2), rel=0.2)


@pytest.mark.parametrize(("attenuation", "log_ratio"), [(7.0, 1.4), (20.0, -1.5)], ids=["bone", "air"])
def test_a_block_of_bone_or_air_shadows(attenuation: float, log_ratio: float) -> None:
    """Behind 8 mm of bone there is less than a thousandth of what is beside its shadow; in front, nothing changes."""
    x, _, z = voxel_centres()
    block = share_within(4.0 - np.abs(x - 30.0)) * share_within(12.0 - np.abs(z))
    image = simulate(phantom(log_ratio * block, 1.0 - block, 0.2 + attenuation * block), moved(), QUIET)
    with_block = decibel(image.envelope)
    open_field = decibel(simulate(phantom(0.0, 1.0, 0.2), moved(), QUIET).envelope)
    behind, beside, before = (
        (slice(90, 102), slice(280, 440)),
        (slice(2, 30), slice(280, 440)),
        (slice(90, 102), slice(10, 120)),
    )
    assert np.median(with_block[behind]) < np.median(open_field[behind]) - 60.0
    assert np.median(with_block[beside]) == pytest.approx(np.median(open_field[beside]), abs=1.0)
    assert np.median(with_block[before]) == pytest.approx(np.median(open_field[before]), abs=1.0)
