"""Surfaces from labels: closed, smooth, at their volume, light, with caps where blood goes on."""

import numpy as np
import pytest

from cathxr.core import DataError
from cathxr.heart.model import Opening
from cathxr.heart.surface import Surface, enclosed_volume_ml, rim_edges, vertex_normals
from cathxr.heart.surfaces import surfaces_of
from cathxr.heart.surfaces.checks import self_intersections, topology
from cathxr.heart.surfaces.distance import distances_mm, sampled
from cathxr.heart.surfaces.repair import untangled
from cathxr.heart.volume import LabelVolume

from .shapes import grid_of, points_of, tube, two_halves


def centre(labels: LabelVolume) -> np.ndarray:
    return labels.grid.to_ct((np.array(labels.grid.shape[::-1]) - 1) / 2)


@pytest.fixture(scope="module")
def halves():
    labels = two_halves()
    return labels, {part.key: part for part in surfaces_of(labels, budget=6000)}


def test_surfaces_are_closed_outward_and_in_one_piece(halves):
    _, parts = halves
    for part in parts.values():
        found = topology(part.surface)
        assert found.is_watertight
        assert (found.pieces, found.cavities, found.euler, found.intersections) == (1, 0, 2, 0)
        assert enclosed_volume_ml(part.surface) > 0.0


def test_volumes_are_kept(halves):
    labels, parts = halves
    for key, part in parts.items():
        # The requirement: within 1 % of the voxels.
        assert enclosed_volume_ml(part.surface) == pytest.approx(labels.volume_ml(key), rel=0.01)
        assert part.checks.surface_ml == pytest.approx(enclosed_volume_ml(part.surface))


def test_the_walls_lie_on_the_ball_finer_than_a_voxel_and_without_its_stairs(halves):
    labels, parts = halves
    normals_off = []
    for part in parts.values():
        walls = part.surface.keep(~part.caps)
        away = walls.vertices_mm - centre(labels)
        radius = np.linalg.norm(away, axis=1)
        # Half a voxel is the error of voxels; their staircase has a standard deviation of 0.3 of one.
        assert np.percentile(np.abs(radius - 18.0), 95) < 0.5
        inner = np.abs(away @ labels.grid.ct_from_voxel[:3, 2]) > 3.0
        cosine = (vertex_normals(walls) * away / radius[:, None]).sum(axis=1)[inner]
        normals_off.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    # A surface of stairs has normals 0 to 55 degrees off; that of the plain half-way contour is 8 degrees off here.
    assert np.median(np.concatenate(normals_off)) < 4.0


def test_caps_are_where_the_two_touch_and_both_agree(halves):
    labels, parts = halves
    up = labels.grid.ct_from_voxel[:3, 2]
    areas = []
    for part in parts.values():
        caps = part.surface.keep(part.caps)
        height = (caps.vertices_mm - centre(labels)) @ up
        # The plane lies between two layers of voxels, half a voxel off the middle at most.
        assert np.abs(height).max() < 1.5
        areas.append(np.linalg.norm(caps.area_vectors, axis=1).sum())
        walls = part.surface.keep(~part.caps)
        rim = rim_edges(walls)
        assert len(rim) == len(rim_edges(caps)) > 20
    # The disc of the cut, less the groove of up to one voxel that smoothing leaves along its rim.
    assert np.pi * 16.5**2 < min(areas) <= max(areas) < np.pi * 18.5**2
    ventricle, atrium = parts["left_ventricle"], parts["left_atrium"]
    gap = distances_mm(sampled(ventricle.surface.keep(ventricle.caps), 500), atrium.surface)
    assert np.percentile(gap, 95) < 0.5


def test_a_budget_is_kept_and_the_light_surface_is_near_the_full_one():
    parts = surfaces_of(two_halves(), budget=2400)
    # The cut along the rim adds a few.
    assert sum(len(part.caps) for part in parts) <= 2400 * 1.05
    for part in parts:
        assert part.checks.full_triangles > len(part.caps)
        assert part.checks.distance_p95_mm < 0.5
        assert part.checks.distance_p95_mm <= part.checks.distance_max_mm


def test_a_vessel_that_the_volume_cuts_is_closed_flat_by_caps_at_both_ends():
    labels = tube()
    (part,) = surfaces_of(labels, budget=20000)
    assert topology(part.surface).is_watertight
    caps = part.surface.keep(part.caps)
    height = (caps.vertices_mm - centre(labels)) @ labels.grid.ct_from_voxel[:3, 2] / 1.5
    # 30 slices of 1.5 mm: the outer faces of the first and the last voxel are 22.5 mm from the middle.
    assert np.abs(np.abs(height) - 22.5).max() < 0.6
    assert (height > 0).any()
    assert (height < 0).any()
    # Two discs of 8 mm; voxels of 1 mm make the radius uncertain by a tenth of one.
    assert np.linalg.norm(caps.area_vectors, axis=1).sum() == pytest.approx(2 * np.pi * 64.0, rel=0.06)
    assert part.checks.volume_change == pytest.approx(0.0, abs=0.01)


def test_an_opening_that_nothing_touches_cuts_its_end_off():
    labels = two_halves()
    alone = LabelVolume(np.where(labels.labels == 1, np.uint8(1), np.uint8(0)), labels.grid, {1: "left_ventricle"})
    up = labels.grid.ct_from_voxel[:3, 2]
    valve = Opening("mitral_valve", "Mitral valve", "left_ventricle", centre(labels), up, 30.0)
    (closed,) = surfaces_of(alone, budget=6000)
    (opened,) = surfaces_of(alone, openings=[valve], budget=6000)
    assert not closed.caps.any()
    caps = opened.surface.keep(opened.caps)
    assert np.linalg.norm(caps.area_vectors, axis=1).sum() > 0.8 * np.pi * 15.0**2
    assert topology(opened.surface).is_watertight


def test_thick_slices_give_no_steps():
    grid = grid_of((20, 60, 60), (0.8, 0.8, 2.5))
    ball = np.linalg.norm(points_of(grid), axis=-1) <= 18.0
    labels = LabelVolume(ball.astype(np.uint8), grid, {1: "left_atrium"})
    (part,) = surfaces_of(labels, budget=20000)
    away = part.surface.vertices_mm - grid.to_ct((np.array(grid.shape[::-1]) - 1) / 2)
    # Half of a slice is 1.25 mm.
    assert np.percentile(np.abs(np.linalg.norm(away, axis=1) - 18.0), 95) < 0.6


def test_a_thin_vessel_does_not_vanish():
    grid = grid_of((40, 24, 24))
    thin = np.linalg.norm(points_of(grid)[..., :2], axis=-1) <= 1.6
    thin[:4] = thin[-4:] = False
    labels = LabelVolume(thin.astype(np.uint8) * 12, grid, {12: "coronary_arteries"})
    (part,) = surfaces_of(labels, budget=4000)
    assert part.checks.volume_change == pytest.approx(0.0, abs=0.05)
    assert part.checks.topology.pieces == 1


@pytest.mark.parametrize("voxels", [0, 1])
def test_labels_without_a_shape_are_refused_in_a_sentence(voxels):
    grid = grid_of((10, 10, 10))
    labels = np.zeros(grid.shape, np.uint8)
    labels[5, 5, :voxels] = 1
    with pytest.raises(DataError, match="no structure of at least 8 voxels"):
        surfaces_of(LabelVolume(labels, grid, {1: "aorta"}))


def test_a_name_that_is_not_in_the_catalogue_is_refused():
    labels = two_halves()
    with pytest.raises(DataError, match=r"'spleen'.*catalogue"):
        surfaces_of(LabelVolume(labels.labels, labels.grid, {1: "left_ventricle", 2: "spleen"}))


def test_a_budget_that_is_too_small_says_what_is_needed():
    with pytest.raises(DataError, match="at least 1200"):
        surfaces_of(two_halves(), budget=1000)


def _tetrahedron(at: float) -> Surface:
    corners = np.array([[0, 0, 0], [4.0, 0, 0], [0, 4.0, 0], [0, 0, 4.0]]) + at
    return Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


def test_self_intersections_are_found_between_pieces_and_not_between_neighbours():
    one, two = _tetrahedron(0.0), _tetrahedron(0.7)
    assert len(self_intersections(one)) == 0
    both = Surface(
        np.concatenate([one.vertices_mm, two.vertices_mm]), np.concatenate([one.triangles, two.triangles + 4])
    )
    pairs = self_intersections(both)
    assert len(pairs) > 0
    assert all((a < 4) != (b < 4) for a, b in pairs)
    assert topology(both).pieces == 2


def test_self_intersections_agree_with_every_pair_tried():
    rng = np.random.default_rng(3)
    vertices = rng.uniform(0.0, 10.0, (120, 3))
    soup = Surface(vertices, np.arange(120).reshape(40, 3))
    found = {tuple(sorted(pair)) for pair in self_intersections(soup).tolist()}

    def pierces(segment, triangle):
        a, b, c = triangle
        p, q = segment
        sides = [np.linalg.det([x - p, y - p, q - p]) for x, y in ((a, b), (b, c), (c, a))]
        ends = [np.linalg.det([b - a, c - a, x - a]) for x in (p, q)]
        return ends[0] * ends[1] < 0 and (all(s > 0 for s in sides) or all(s < 0 for s in sides))

    corners = vertices.reshape(40, 3, 3)
    expected = set()
    for a in range(40):
        for b in range(a + 1, 40):
            both = ((corners[a], corners[b]), (corners[b], corners[a]))
            if any(pierces((one[i], one[i - 1]), other) for one, other in both for i in range(3)):
                expected.add((a, b))
    assert found == expected
    assert found


def test_open_and_crowded_edges_are_counted():
    whole = _tetrahedron(0.0)
    assert topology(whole).is_watertight
    assert topology(Surface(whole.vertices_mm, whole.triangles[:3])).open_edges == 3
    turned = whole.triangles.copy()
    turned[0] = turned[0, ::-1]
    assert topology(Surface(whole.vertices_mm, turned)).crowded_edges == 3


def test_a_vertex_that_pokes_through_is_drawn_back():
    (part,) = surfaces_of(tube(), budget=20000)
    vertices = part.surface.vertices_mm.copy()
    middle = int(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1).argmin())
    vertices[middle] += 2.2 * (vertices.mean(axis=0) - vertices[middle])
    spoilt = Surface(vertices, part.surface.triangles)
    assert len(self_intersections(spoilt)) > 0
    assert len(self_intersections(untangled(spoilt))) == 0
