"""The openings found in voxels of the real heart, against the source's own list of them (caps.json)."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cathxr.heart.builtin_recipe import Ingredients, ingredients
from cathxr.heart.openings import Places, find_places
from cathxr.heart.surface import enclosed_volume_ml, read_stl
from cathxr.heart.volume import LabelVolume

from .shapes import angle_deg

pytest.importorskip("vtkmodules", reason="the extra `heart` (VTK) is not installed")

SPACING_MM = 1.0
VESSELS = (
    "superior_vena_cava",
    "inferior_vena_cava",
    "left_superior_pulmonary_vein",
    "left_inferior_pulmonary_vein",
    "right_superior_pulmonary_vein",
    "right_inferior_pulmonary_vein",
)


@pytest.fixture(scope="module")
def source(shared_data: Path) -> Path:
    return shared_data / "heart_rodero01" / "derived_stl"


@pytest.fixture(scope="module")
def caps(source: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((source / "caps.json").read_text())
    return {key.replace("-", "_").replace("left_atrium_app", "left_atrial_app"): each for key, each in document.items()}


@pytest.fixture(scope="module")
def made(source: Path) -> Ingredients:
    return ingredients(source, spacing_mm=SPACING_MM)


@pytest.fixture(scope="module")
def places(made: Ingredients) -> Places:
    return find_places(made.walled)


def off_mm(places: Places, caps: dict[str, Any], key: str) -> float:
    return float(np.linalg.norm(places.openings[key].centroid_mm - caps[key]["centroid_mm"]))


@pytest.mark.parametrize("key", ["aortic_valve", "pulmonary_valve"])
def test_arterial_valves_are_where_the_source_has_them(places: Places, caps: dict[str, Any], key: str) -> None:
    # The vessel's first ring, and not the ventricle's rim, decides what touches: 2 mm, and the lumen is a little
    # narrower than the rim.
    assert off_mm(places, caps, key) < 2.0
    assert places.openings[key].diameter_mm == pytest.approx(caps[key]["eq_diameter_mm"], rel=0.12)


@pytest.mark.parametrize("key", ["mitral_valve", "tricuspid_valve"])
def test_atrioventricular_valves_lie_between_the_two_rims(places: Places, caps: dict[str, Any], key: str) -> None:
    # The source has two rims a valve, the ventricle's and a smaller one of the atrium, 2 to 3 mm apart: the valve found
    # between the two pools is between them in place (with a voxel to spare) and in size.
    rims = [caps[key], caps[f"{key}_atrium"]]
    assert off_mm(places, caps, key) < 4.0
    low, high = sorted(each["eq_diameter_mm"] for each in rims)
    assert 0.95 * low < places.openings[key].diameter_mm < 1.02 * high


@pytest.mark.parametrize("key", [*VESSELS, "left_atrial_appendage"])
def test_mouths_that_the_wall_leaves_bare(places: Places, made: Ingredients, caps: dict[str, Any], key: str) -> None:
    # Two voxels. The wall hides the rim of each mouth by up to a voxel all round: 2 mm of 13 to 18 mm.
    assert off_mm(places, caps, key) < 2.0
    assert places.openings[key].diameter_mm == pytest.approx(caps[key]["eq_diameter_mm"], rel=0.2)
    assert angle_deg(places.openings[key].normal, made.places.openings[key].normal) < 8.0


def test_without_walls_the_valves_are_found_and_the_veins_are_said_to_be_missing(made: Ingredients) -> None:
    # The source's pools end in flat caps, without a stub: without walls nothing shows where the vessels were.
    labels = made.labels.labels.copy()
    labels[made.labels.mask("superior_vena_cava") | made.labels.mask("inferior_vena_cava")] = 0
    names = {value: key for value, key in made.labels.names.items() if "vena" not in key}
    places = find_places(LabelVolume(labels, made.labels.grid, names))
    assert {"mitral_valve", "tricuspid_valve", "aortic_valve", "pulmonary_valve"} <= set(places.openings)
    assert not any("vein" in key or "vena" in key for key in places.openings)
    assert any("Superior vena cava" in each for each in places.findings)
    assert any("Pulmonary veins: 0" in each for each in places.findings)


def test_landmarks_are_where_they_must_be(places: Places, made: Ingredients) -> None:
    apex = places.landmarks["left_ventricle_apex"].position_mm
    mitral = places.openings["mitral_valve"]
    assert 70.0 < np.linalg.norm(apex - mitral.centroid_mm) < 110.0  # an adult's left ventricle is 7 to 11 cm long
    assert (apex - mitral.centroid_mm) @ mitral.normal < 0.0
    for key, one, other in (
        ("interventricular_septum", "left_ventricle", "right_ventricle"),
        ("interatrial_septum", "left_atrium", "right_atrium"),
    ):
        point = places.landmarks[key].position_mm
        gaps = []
        for pool in (one, other):
            k, j, i = np.nonzero(made.labels.mask(pool))
            gaps.append(np.linalg.norm(made.labels.grid.to_ct(np.stack([i, j, k], axis=1)) - point, axis=1).min())
        # Midway, to two voxels; a septum is at most 15 mm thick.
        assert abs(gaps[0] - gaps[1]) < 2.5, key
        assert sum(gaps) < 18.0, key


def test_pools_grown_to_meet_keep_their_volumes(made: Ingredients, source: Path) -> None:
    for key, stl in (
        ("left_ventricle", "lv"),
        ("right_ventricle", "rv"),
        ("left_atrium", "la"),
        ("right_atrium", "ra"),
    ):
        whole = enclosed_volume_ml(read_stl(source / f"{stl}_cavity.stl"))
        # 1 % is the budget; rasterising at 1 mm adds about 0.1 %.
        assert made.labels.volume_ml(key) == pytest.approx(whole, rel=0.0115)
