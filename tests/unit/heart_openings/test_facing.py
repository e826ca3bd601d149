"""Patches of voxel faces: area, normal and centre of known planes, gaps and cuts."""

import numpy as np
import pytest

from cathxr.heart.facing import boundary_patches, bridged, common_box, coverage, facing_patches
from cathxr.heart.volume import Grid

from .shapes import angle_deg, ball, middle, oblique_grid, points, tube

GRID = oblique_grid((70, 64, 76))
CENTRE = middle(GRID)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (1.0, 0.4, -0.3), (0.577, 0.577, 0.577), (-0.2, 0.9, 0.1)])
def test_a_disc_between_two_half_tubes_has_its_area_normal_and_centre(normal: tuple[float, float, float]) -> None:
    unit = np.array(normal) / np.linalg.norm(normal)
    radius = 14.0
    inner = tube(GRID, CENTRE - 12.0 * unit, unit, 12.0, radius)
    outer = tube(GRID, CENTRE, unit, 12.0, radius) & ~inner
    patch = facing_patches(inner, outer, GRID)[0]
    # The disc's rim is known to half a voxel in random directions, so that its area is good to a per cent or two; the
    # centre and the plane's place are means over a thousand faces, and half a voxel is the most they can be off.
    assert patch.diameter_mm == pytest.approx(2.0 * radius, rel=0.03)
    assert angle_deg(patch.normal, unit) < 2.0
    assert np.linalg.norm(patch.centroid_mm - CENTRE) < 0.4
    assert patch.flatness > 0.95


def test_counting_faces_would_make_an_oblique_disc_too_large() -> None:
    unit = np.ones(3) / np.sqrt(3.0)
    unit = GRID.ct_from_voxel[:3, :3] @ unit / 0.8
    inner = tube(GRID, CENTRE - 12.0 * unit, unit, 12.0, 14.0)
    outer = tube(GRID, CENTRE, unit, 12.0, 14.0) & ~inner
    faces = coverage(inner, outer) * sum(
        np.count_nonzero(np.diff(np.pad(inner, 1).astype(np.int8), axis=axis)) for axis in range(3)
    )
    counted = faces * 0.8**2
    area = np.pi * 14.0**2
    assert counted > 1.6 * area  # sqrt(3) at this inclination
    # At the rim a voxel's partner may lie outside: up to a quarter of a voxel is lost all round, 0.2 mm of 14 mm.
    assert facing_patches(inner, outer, GRID)[0].area_mm2 == pytest.approx(area, rel=0.04)


def test_separate_patches_are_told_apart_largest_first() -> None:
    body = ball(GRID, CENTRE, 18.0)
    arms = [np.array([1.0, 0.0, 0.2]), np.array([-1.0, 0.1, 0.0])]
    outer = (tube(GRID, CENTRE, arms[0], 40.0, 6.0) | tube(GRID, CENTRE, arms[1], 40.0, 3.5)) & ~body
    patches = facing_patches(body, outer, GRID)
    assert len(patches) == 2
    for patch, arm, radius in zip(patches, arms, (6.0, 3.5), strict=True):
        assert angle_deg(patch.normal, arm) < 4.0
        # The ball bulges into the tube: seen along the arm, its area is still the tube's cross-section.
        assert patch.diameter_mm == pytest.approx(2.0 * radius, rel=0.08)  # a rim of 0.4 mm on 3.5 mm
    assert len(facing_patches(body, outer, GRID, least_mm2=60.0)) == 1


def test_pools_across_a_gap_meet_in_the_middle() -> None:
    unit = np.array([0.3, -0.5, 0.8])
    unit /= np.linalg.norm(unit)
    gap = 3.0
    inner = tube(GRID, CENTRE - (12.0 + gap / 2) * unit, unit, 12.0, 12.0)
    outer = tube(GRID, CENTRE + gap / 2 * unit, unit, 12.0, 12.0)
    free = ~(inner | outer)
    assert facing_patches(inner, outer, GRID) == []
    grown = bridged(inner, outer, free, GRID, reach_mm=6.0, slack_mm=1.0)
    assert not (grown[0] & grown[1]).any()
    patch = facing_patches(*grown, GRID)[0]
    assert np.linalg.norm(patch.centroid_mm - CENTRE) < 0.5
    assert angle_deg(patch.normal, unit) < 3.0
    # Beyond the rim the gap is at most 1 mm wider than 3 mm up to 2 * sqrt(2**2 - 1.5**2) / 2 = 1.3 mm outside.
    assert 23.0 < patch.diameter_mm < 24.0 + 2 * 1.9
    far = bridged(inner, outer, free, GRID, reach_mm=1.5, slack_mm=1.0)
    assert np.array_equal(far[0], inner)


def test_a_cut_by_the_boundary_is_flat_and_looks_out() -> None:
    start = GRID.to_ct([38.0, 32.0, 30.0])
    direction = GRID.ct_from_voxel[:3, 2] + 0.15 * GRID.ct_from_voxel[:3, 0]
    mask = tube(GRID, start, direction, 200.0, 7.0)
    (patch,) = boundary_patches(mask, GRID, least_mm2=20.0)
    assert angle_deg(patch.normal, GRID.ct_from_voxel[:3, 2]) < 1e-3
    assert GRID.to_voxel(patch.centroid_mm)[2] == pytest.approx(69.5)
    cosine = np.cos(np.arctan(0.15))
    assert patch.area_mm2 == pytest.approx(np.pi * 49.0 / cosine, rel=0.05)


def test_nothing_faces_nothing() -> None:
    empty = np.zeros(GRID.shape, bool)
    body = ball(GRID, CENTRE, 10.0)
    assert facing_patches(body, empty, GRID) == []
    assert boundary_patches(body, GRID) == []
    assert common_box(body, empty, GRID, 5.0) is None
    assert coverage(empty, body) == 0.0
    with pytest.raises(ValueError, match="expected the grid's shape"):
        facing_patches(body[:-1], empty[:-1], GRID)


def test_anisotropic_voxels_give_the_same_disc() -> None:
    grid = Grid((40, 90, 90), np.diag([0.6, 0.6, 1.5, 1.0]))
    unit = np.array([0.5, 0.2, 0.84])
    unit /= np.linalg.norm(unit)
    inner = tube(grid, middle(grid) - 12.0 * unit, unit, 12.0, 13.0)
    outer = tube(grid, middle(grid), unit, 12.0, 13.0) & ~inner
    patch = facing_patches(inner, outer, grid)[0]
    assert patch.diameter_mm == pytest.approx(26.0, rel=0.03)
    assert angle_deg(patch.normal, unit) < 2.5
    assert points(grid).shape == (*grid.shape, 3)
