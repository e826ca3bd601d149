"""Openings and landmarks of label volumes whose valves and vessels are known."""

import numpy as np
import pytest

from cathxr.heart.openings import find_openings, find_places
from cathxr.heart.volume import Grid, LabelVolume, Technical, Volume

from .shapes import angle_deg, ball, labelled, tube

GRID = Grid((130, 110, 130), np.diag([1.0, 1.0, 1.0, 1.0]))
LEFT, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def with_vessels(**extra: np.ndarray) -> LabelVolume:
    """A right atrium with caval tubes inside its own label, and a left atrium with four veins likewise."""
    right = ball(GRID, np.array([35.0, 55.0, 60.0]), 20.0)
    right |= tube(GRID, np.array([35.0, 58.0, 60.0]), np.array([0.0, 0.1, 1.0]), 42.0, 8.0)
    right |= tube(GRID, np.array([35.0, 58.0, 60.0]), np.array([-0.1, 0.0, -1.0]), 40.0, 9.0)
    left = ball(GRID, np.array([85.0, 60.0, 75.0]), 18.0)
    for side, height in ((1, 10.0), (1, -8.0), (-1, 11.0), (-1, -7.0)):
        start = np.array([85.0, 62.0, 75.0 + height])
        left |= tube(GRID, start, np.array([side, 0.35, 0.15 * np.sign(height)]), 30.0, 5.0)
    return labelled(GRID, right_atrium=right, left_atrium=left & ~right, **extra)


def test_touching_pools_share_a_valve() -> None:
    cut = np.array([60.0, 55.0, 60.0])
    inner = tube(GRID, cut - 30.0 * LEFT, LEFT, 30.0, 15.0)
    outer = tube(GRID, cut, LEFT, 30.0, 15.0) & ~inner
    aorta = tube(GRID, cut - 15.0 * LEFT, UP, 200.0, 9.0) & ~inner
    openings, landmarks = find_openings(labelled(GRID, left_ventricle=inner, left_atrium=outer, aorta=aorta))
    mitral = openings["mitral_valve"]
    assert mitral.structure == "left_ventricle"
    assert np.linalg.norm(mitral.centroid_mm - cut) < 0.6  # half a voxel
    assert angle_deg(mitral.normal, LEFT) < 1.0  # out of the ventricle
    assert mitral.diameter_mm == pytest.approx(30.0, rel=0.03)
    assert openings["aortic_valve"].normal[2] > 0.95
    end = openings["aorta_end"]
    assert end.structure == "aorta"
    assert end.centroid_mm[2] == pytest.approx(129.5)  # the boundary: half a voxel beyond the last centre
    assert end.diameter_mm == pytest.approx(18.0, rel=0.04)
    apex = landmarks["left_ventricle_apex"].position_mm
    assert apex[0] == pytest.approx(30.0, abs=1.0)


def test_a_thin_gap_is_bridged_and_a_wide_one_is_said() -> None:
    for gap, is_found in ((4.0, True), (9.0, False)):
        inner = tube(GRID, np.array([20.0, 55.0, 60.0]), LEFT, 30.0, 15.0)
        outer = tube(GRID, np.array([50.0 + gap, 55.0, 60.0]), LEFT, 30.0, 15.0)
        places = find_places(labelled(GRID, right_ventricle=inner, right_atrium=outer))
        assert ("tricuspid_valve" in places.openings) is is_found
        if is_found:
            valve = places.openings["tricuspid_valve"]
            assert np.linalg.norm(valve.centroid_mm - [50.0 + gap / 2, 55.0, 60.0]) < 0.8
            # The gap may be 2.5 mm wider than at its narrowest, which is so up to 2.6 mm outside the rim.
            assert 29.0 < valve.diameter_mm < 35.5
        else:
            assert any("Tricuspid valve" in each and "mm apart" in each for each in places.findings)


def test_a_contact_as_wide_as_a_wall_is_no_valve() -> None:
    inner = tube(GRID, np.array([10.0, 55.0, 60.0]), LEFT, 50.0, 48.0)
    outer = tube(GRID, np.array([60.0, 55.0, 60.0]), LEFT, 50.0, 48.0) & ~inner
    places = find_places(labelled(GRID, left_ventricle=inner, aorta=outer))
    assert "aortic_valve" not in places.openings
    assert any("which no such opening does" in each for each in places.findings)


def test_venae_cavae_inside_the_atriums_label_are_found_by_their_tubes() -> None:
    places = find_places(with_vessels())
    upper, lower = places.openings["superior_vena_cava"], places.openings["inferior_vena_cava"]
    # A tube's direction comes from slabs of 3 mm across some 200 voxels each, its end from the outermost voxel.
    assert np.linalg.norm(upper.centroid_mm - [35.0, 58.0 + 4.2, 60.0 + 41.8]) < 1.5
    assert angle_deg(upper.normal, np.array([0.0, 0.1, 1.0])) < 10.0
    assert upper.diameter_mm == pytest.approx(16.0, rel=0.1)
    assert np.linalg.norm(lower.centroid_mm - [35.0 - 4.0, 58.0, 60.0 - 39.8]) < 1.5
    assert lower.diameter_mm == pytest.approx(18.0, rel=0.1)
    assert upper.structure == lower.structure == "right_atrium"
    junction = places.landmarks["superior_vena_cava_junction"].position_mm
    assert 70.0 < junction[2] < 90.0  # where the tube leaves the ball: z about 78


def test_four_veins_are_named_by_side_and_height() -> None:
    openings = find_places(with_vessels()).openings
    veins = {key: each for key, each in openings.items() if "pulmonary_vein" in key}
    assert set(veins) == {
        f"{side}_{place}_pulmonary_vein" for side in ("left", "right") for place in ("superior", "inferior")
    }
    for key, vein in veins.items():
        side = 1.0 if key.startswith("left") else -1.0
        assert side * vein.normal[0] > 0.8
        assert side * (vein.centroid_mm[0] - 85.0) > 22.0
        assert ("superior" in key) == (vein.centroid_mm[2] > 75.0)
        assert vein.diameter_mm == pytest.approx(10.0, rel=0.15)  # a rim of half a voxel on 5 mm


def test_veins_with_a_label_of_their_own_are_where_they_touch() -> None:
    whole = with_vessels()
    body = ball(GRID, np.array([85.0, 60.0, 75.0]), 18.0)
    veins = whole.mask("left_atrium") & ~body
    openings = find_places(labelled(GRID, left_atrium=body, pulmonary_veins=veins)).openings
    assert sum("pulmonary_vein" in key and "end" not in key for key in openings) == 4
    for key, vein in openings.items():
        if "end" not in key:
            assert (
                abs(np.linalg.norm(vein.centroid_mm - [85.0, 60.0, 75.0]) - 17.0) < 1.5
            )  # on the ball, or just inside
            assert vein.diameter_mm == pytest.approx(10.0, rel=0.25), key  # oblique to the ball's surface


def test_holes_in_a_known_wall_are_mouths() -> None:
    centre = np.array([60.0, 55.0, 60.0])
    atrium = ball(GRID, centre, 20.0)
    hole = tube(GRID, centre, np.array([0.2, 0.3, 1.0]), 60.0, 8.0) | tube(GRID, centre, -UP, 60.0, 9.0)
    wall = ball(GRID, centre, 23.0) & ~atrium & ~hole
    openings = find_places(labelled(GRID, right_atrium=atrium, myocardium=wall)).openings
    assert angle_deg(openings["superior_vena_cava"].normal, np.array([0.2, 0.3, 1.0])) < 5.0
    assert openings["superior_vena_cava"].diameter_mm == pytest.approx(16.0, rel=0.1)
    assert openings["inferior_vena_cava"].diameter_mm == pytest.approx(18.0, rel=0.1)


def test_the_ct_shows_where_an_atriums_label_stops_short_of_its_vessels() -> None:
    centre = np.array([60.0, 55.0, 60.0])
    atrium = ball(GRID, centre, 20.0)
    blood = atrium | tube(GRID, centre, np.array([0.1, 0.2, 1.0]), 60.0, 8.0) | tube(GRID, centre, -UP, 60.0, 9.0)
    noise = np.random.default_rng(7).normal(0.0, 20.0, GRID.shape)
    hu = (np.where(blood, 420.0, 50.0) + noise).astype(np.int16)
    labels = labelled(GRID, right_atrium=atrium)
    openings = find_places(labels, volume=Volume(hu, GRID, Technical("CT"))).openings
    assert angle_deg(openings["superior_vena_cava"].normal, np.array([0.1, 0.2, 1.0])) < 6.0
    assert openings["superior_vena_cava"].diameter_mm == pytest.approx(16.0, rel=0.15)  # a rim of a voxel all round
    assert openings["inferior_vena_cava"].diameter_mm == pytest.approx(18.0, rel=0.15)
    dull = Volume(np.full(GRID.shape, 50, np.int16), GRID, Technical("CT"))
    walled = labelled(GRID, right_atrium=atrium, myocardium=ball(GRID, centre, 23.0) & ~atrium)
    assert find_places(walled, volume=dull).openings == {}


def test_what_is_not_there_is_said_and_not_made_up() -> None:
    places = find_places(labelled(GRID, right_atrium=ball(GRID, np.array([60.0, 55.0, 60.0]), 20.0)))
    assert places.openings == {}
    assert any("Superior vena cava" in each for each in places.findings)
    assert find_places(labelled(GRID, blood_pool=ball(GRID, np.array([60.0, 55.0, 60.0]), 20.0))).findings == ()
    assert find_places(LabelVolume(np.zeros(GRID.shape, np.uint8), GRID, {})).openings == {}


def test_a_chamber_that_the_volume_cuts_is_named() -> None:
    cut = ball(GRID, np.array([120.0, 55.0, 60.0]), 25.0)
    findings = find_places(labelled(GRID, left_ventricle=cut)).findings
    assert any("boundary cuts through" in each for each in findings)


def test_the_same_labels_give_the_same_places() -> None:
    one, other = find_places(with_vessels()), find_places(with_vessels())
    assert one.openings.keys() == other.openings.keys()
    for key, each in one.openings.items():
        assert np.array_equal(each.centroid_mm, other.openings[key].centroid_mm)
