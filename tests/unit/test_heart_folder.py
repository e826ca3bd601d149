"""The built-in heart, its folder's reader, and what the reader refuses."""

import json
import shutil
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cathxr.core import ConfigError, DataError
from cathxr.heart import HeartFolder, builtin_path, heart_toml, read_heart
from cathxr.heart.glb import read_glb, surface
from cathxr.heart.surface import Surface, enclosed_volume_ml, rim_edges
from cathxr.heart.volume import Technical
from cathxr.registration import BEFORE_MM, Kind, read_registration

CHAMBERS_ML = {"left_ventricle": 120.6, "right_ventricle": 186.2, "left_atrium": 68.3, "right_atrium": 111.4}


@pytest.fixture(scope="module")
def heart() -> HeartFolder:
    return read_heart(builtin_path())


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(builtin_path(), tmp_path / "heart"))


def part(heart: HeartFolder, key: str, *, with_caps: bool = False) -> Surface:
    document, binary = read_glb(heart.glb)
    return Surface(*surface(document, binary, heart.structures[key].node, with_caps=with_caps))


def json_chunk(path: Path) -> dict[str, Any]:
    """GLB's JSON chunk by the specification's byte layout, apart from the package's own reader."""
    data = path.read_bytes()
    assert data[:4] == b"glTF"
    assert struct.unpack("<II", data[4:12]) == (2, len(data))
    length = struct.unpack("<I", data[12:16])[0]
    assert data[16:20] == b"JSON"
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    return document


def is_inside(shape: Surface, point: np.ndarray) -> bool:
    """Whether a point is inside: the winding number is over a half (openings take their share of the sphere)."""
    a, b, c = (shape.vertices_mm[shape.triangles[:, at]] - point for at in range(3))
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    under = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return bool(np.arctan2(over, under).sum() / (2 * np.pi) > 0.5)


def test_glb_is_small_and_its_parts_are_those_of_heart_toml(heart: HeartFolder) -> None:
    document = json_chunk(heart.glb)
    assert heart.glb.stat().st_size < 2_000_000
    names = [node["name"] for node in document["nodes"] if "mesh" in node]
    assert sorted(names) == sorted(each.node for each in heart.structures.values())
    chambers = {"left_ventricle", "right_ventricle", "left_atrium", "right_atrium"}
    assert chambers | {"aorta", "pulmonary_artery", "superior_vena_cava", "inferior_vena_cava"} == set(names)
    assert "extensionsRequired" not in document
    assert "CC BY 4.0" in document["asset"]["copyright"]
    triangles = sum(
        document["accessors"][mesh["primitives"][0]["indices"]]["count"] // 3 for mesh in document["meshes"]
    )
    assert 20_000 < triangles < 45_000  # the walls of a budget of 40,000
    assert all({"POSITION", "NORMAL"} <= set(mesh["primitives"][0]["attributes"]) for mesh in document["meshes"])


def test_glb_is_in_metres_with_y_up(heart: HeartFolder) -> None:
    document = json_chunk(heart.glb)
    positions = [document["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]] for mesh in document["meshes"]]
    low = np.min([each["min"] for each in positions], axis=0)
    high = np.max([each["max"] for each in positions], axis=0)
    assert ((high - low > 0.08) & (high - low < 0.16)).all()  # an adult heart measures 8 to 16 cm each way
    tops = {mesh["name"]: each["max"][1] for mesh, each in zip(document["meshes"], positions, strict=True)}
    assert tops["left_atrium"] > tops["left_ventricle"]  # the atria are above their ventricles
    fronts = {mesh["name"]: each["max"][2] for mesh, each in zip(document["meshes"], positions, strict=True)}
    assert fronts["right_ventricle"] > fronts["left_atrium"]  # the right ventricle is in front, the left atrium behind
    lefts = {mesh["name"]: each["max"][0] for mesh, each in zip(document["meshes"], positions, strict=True)}
    assert lefts["left_ventricle"] > lefts["right_atrium"]  # +x is the patient's left


def test_normals_are_unit_and_point_out_of_the_surface(heart: HeartFolder) -> None:
    document, binary = read_glb(heart.glb)
    for mesh in document["meshes"]:
        attributes = mesh["primitives"][0]["attributes"]
        view = document["bufferViews"][document["accessors"][attributes["NORMAL"]]["bufferView"]]
        normals = np.frombuffer(binary, "<f4", view["byteLength"] // 4, view["byteOffset"]).reshape(-1, 3)
        assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-5  # float32 rounding
        shape = Surface(*surface(document, binary, mesh["name"]))
        face = shape.area_vectors / np.linalg.norm(shape.area_vectors, axis=1, keepdims=True)
        ct = np.stack([normals[:, 0], -normals[:, 2], normals[:, 1]], axis=1)
        agreement = (ct[shape.triangles].mean(axis=1) * face).sum(axis=1)
        assert np.percentile(agreement, 1) > 0.7


def test_volumes_are_those_of_the_source(heart: HeartFolder) -> None:
    for key, volume in CHAMBERS_ML.items():
        stated = heart.structures[key].volume_ml
        # The pools were grown to meet in their valves' planes: less than 1 %, which the source's note states.
        assert stated == pytest.approx(volume, rel=0.01)
        # Smoothing and simplifying may change what is shown by 1 %, the budget that issue 5 sets for surfaces. Walls
        # and caps together are closed, up to the rims' vertices that are there twice.
        assert enclosed_volume_ml(part(heart, key, with_caps=True)) == pytest.approx(stated, rel=0.01)


def test_every_opening_is_a_hole_of_its_structure(heart: HeartFolder) -> None:
    for opening in heart.openings.values():
        shape = part(heart, opening.structure)
        rim = shape.vertices_mm[np.unique(rim_edges(shape))]
        distance = np.linalg.norm(rim - opening.centroid_mm, axis=1)
        # A rim is no circle: its points lie between 0.3 and 1.6 times the equal-area radius (oval veins, the mitral
        # valve's orifice in a pool that is not convex there).
        near = distance < 1.6 * opening.diameter_mm / 2
        assert near.sum() > 8, opening.key
        # What lies close to the centre has been cut away; the aorta's stub ends on a bent line.
        gap = np.linalg.norm(shape.vertices_mm - opening.centroid_mm, axis=1).min()
        assert gap > 0.15 * opening.diameter_mm, opening.key
        inwards = opening.centroid_mm - 3.0 * opening.normal
        outwards = opening.centroid_mm + 3.0 * opening.normal
        whole = part(heart, opening.structure, with_caps=True)
        assert is_inside(whole, inwards), opening.key
        assert not is_inside(whole, outwards), opening.key


def test_inlet_is_before_the_inferior_vena_cava_and_x_runs_through_the_right_atrium(heart: HeartFolder) -> None:
    assert heart.registration is not None
    registration = read_registration(heart.registration)
    assert registration.kind is Kind.PLACEMENT
    box_from_ct = registration.ct_from_box.inverse()
    way_in = box_from_ct.apply(heart.openings["inferior_vena_cava"].centroid_mm)
    assert np.abs(way_in - [BEFORE_MM, 0.0, 0.0]).max() < 1e-6
    exit_box = box_from_ct.apply(heart.openings["superior_vena_cava"].centroid_mm)
    assert np.abs(exit_box[1:]).max() < 1e-6
    assert 50.0 < exit_box[0] < 120.0  # inside the box's region of interest
    atrium = part(heart, "right_atrium")
    for depth in (5.0, 20.0, 40.0, 60.0):
        assert is_inside(atrium, registration.ct(np.array([BEFORE_MM + depth, 0.0, 0.0]))), depth
    assert not is_inside(atrium, registration.ct(np.array([BEFORE_MM - 8.0, 0.0, 0.0])))
    assert is_inside(part(heart, "inferior_vena_cava"), registration.ct(np.array([BEFORE_MM - 15.0, 0.0, 0.0])))
    assert not is_inside(atrium, registration.ct(np.array([BEFORE_MM + 90.0, 0.0, 0.0])))
    up = registration.ct_from_box.turn(np.array([0.0, 0.0, 1.0]))
    assert up @ [0.0, -1.0, 0.0] > 0.95  # anterior


def test_nothing_that_names_a_patient_or_a_path(heart: HeartFolder) -> None:
    text = (heart.path / "heart.toml").read_text() + json.dumps(json_chunk(heart.glb))
    for word in ("patient_id", "PatientName", "/home/", "/Users/", "1.2.840"):
        assert word not in text


def test_written_toml_reads_back_the_same(heart: HeartFolder, copy: Path) -> None:
    (copy / "heart.toml").write_text(heart_toml(heart), encoding="utf-8")
    again = read_heart(copy)
    assert again.structures == heart.structures
    assert again.source == heart.source
    assert again.points_ct.keys() == heart.points_ct.keys()
    for key, opening in heart.openings.items():
        assert np.allclose(again.openings[key].normal, opening.normal, atol=1e-6)  # normals are written to 6 decimals
        assert np.array_equal(again.points_ct[key], heart.points_ct[key])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('schema = "cathxr-heart/1"', 'schema = "cathxr-heart/9"', "schema is wrong"),
        ('mesh = "heart.glb"', 'mesh = "../heart.glb"', "mesh is wrong"),
        ('mesh = "heart.glb"\n', "", "mesh is missing"),
        ("label = 1\n", 'label = 1\npatient = "x"\n', "patient is not a key of this format"),
        ("label = 1\n", "label = 2\n", "two structures have the label 2"),
        ("opacity = 0.3\n", "opacity = 3.0\n", "opacity is wrong"),
        ('colour = "#bf3a3a"', 'colour = "red"', "colour is wrong"),
        ("diameter_mm = 16.4", "diameter_mm = nan", "diameter_mm is wrong"),
        ("diameter_mm = 16.4", "diameter_mm = inf", "diameter_mm is wrong"),
        ("diameter_mm = 16.4", "diameter_mm = " + "9" * 400, "diameter_mm is wrong"),
        ("    25.49,\n", "", "inferior_vena_cava.centroid_mm is wrong"),
        ("    25.49,\n", "    inf,\n", "inferior_vena_cava.centroid_mm"),
        ("    -0.862346,\n", "    -0.5,\n", "expected a vector of length 1"),
        ('structure = "right_atrium"', 'structure = "spleen"', "which is not there"),
        ("[landmarks.left_ventricle_apex]", "[landmarks.mitral_valve]", "both an opening and a landmark"),
        ("[source]", "[source", "not valid TOML"),
        ('curve = "asinh"', 'curve = "linear"', "acoustic.channels.impedance.curve is wrong"),
        ('file = "acoustic.bin.gz"', 'file = "/etc/passwd"', "acoustic.file is wrong"),
        ("[acoustic.channels.scatter]", "[acoustic.channels.colour]", "acoustic.channels"),
        ("    1.439", "    0.0001\n    1.439", "not valid TOML"),
        (
            "[acoustic]",
            '[technical]\nmodality = "CT"\npatient = "x"\n[acoustic]',
            "patient is not a key of this format",
        ),
    ],
)
def test_bad_heart_toml_is_refused_in_one_sentence(copy: Path, old: str, new: str, sentence: str) -> None:
    toml = copy / "heart.toml"
    text = toml.read_text()
    assert old in text
    toml.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as caught:
        read_heart(copy)
    assert sentence in str(caught.value)
    assert "heart.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_a_series_says_is_written_and_read(heart: HeartFolder, copy: Path) -> None:
    said = Technical("CT", phase="75 % of R-R", slice_thickness_mm=0.6, contrast=True, remarks=("two slices missing",))
    (copy / "heart.toml").write_text(heart_toml(replace(heart, technical=said)), encoding="utf-8")
    assert read_heart(copy).technical == said
    assert heart.technical is None


def test_acoustic_volume_has_every_channel_missing_none(copy: Path) -> None:
    toml = copy / "heart.toml"
    text = toml.read_text()
    start = text.index("[acoustic.channels.scatter]")
    toml.write_text(text[:start] + text[text.index("[acoustic.channels.attenuation]") :])
    with pytest.raises(ConfigError, match="acoustic is wrong: channels: expected impedance"):
        read_heart(copy)


def test_missing_folder_and_files_are_named(copy: Path, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"heart\.toml"):
        read_heart(tmp_path / "nowhere")
    (copy / "heart.toml").write_text(
        (copy / "heart.toml").read_text().replace('labels = "labels.nii.gz"', 'labels = "l.nii.gz"')
    )
    with pytest.raises(DataError, match=r"l\.nii\.gz is missing"):
        read_heart(copy)
    shutil.copy(copy / "labels.nii.gz", copy / "l.nii.gz")
    (copy / "acoustic.bin.gz").unlink()
    with pytest.raises(DataError, match=r"acoustic\.bin\.gz is missing"):
        read_heart(copy)
    (copy / "heart.glb").unlink()
    with pytest.raises(DataError, match=r"heart\.glb cannot be read"):
        read_heart(copy)


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (lambda data: b"", "too short"),
        (lambda data: b"<html>" + data[6:], "does not begin with 'glTF'"),
        (lambda data: data[:4] + struct.pack("<I", 1) + data[8:], "version 1"),
        (lambda data: data[:-1000], "bytes long"),
        (lambda data: data[:12] + struct.pack("<I", 2**31) + data[16:], "runs past the end"),
        (lambda data: data[:20] + b"!" + data[21:], "no readable JSON"),
        (
            lambda data: data.replace(b'"nodes":[{', b'"nodes":[1,{').replace(b'"generator":"ca', b'"generator":"', 1),
            "not glTF's",
        ),
        (lambda data: data.replace(b'"name":"aorta","mesh"', b'"name":"tuber","mesh"'), "no part named 'aorta'"),
    ],
)
def test_damaged_glb_is_refused(copy: Path, damage: Any, sentence: str) -> None:
    glb = copy / "heart.glb"
    glb.write_bytes(damage(glb.read_bytes()))
    with pytest.raises(DataError, match=sentence):
        read_heart(copy)
