"""Ready masks: label maps and their names, folders of masks, DICOM segmentations, STL parts."""

import gzip
import zipfile
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
import trimesh
from scipy.spatial.transform import Rotation

from cathxr.core import ConfigError, DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.reading import read_labels
from cathxr.heart.reading.structure_names import key_of, vessel_of_wall
from cathxr.heart.volume import Grid, LabelVolume, Volume

from ...heart_support.dicom_multiframe import write_segmentation
from ...heart_support.dicom_series import volume_of

ROTATION = Rotation.from_euler("xyz", [8.0, -15.0, 25.0], degrees=True).as_matrix()
CT = volume_of(np.zeros((10, 24, 30)), rotation=ROTATION)
LV, LA = slice(2, 6), slice(6, 9)


def boxes() -> np.ndarray:
    """Return labels of a ventricle (1) and an atrium (3)."""
    labels = np.zeros(CT.grid.shape, np.uint8)
    labels[LV, 4:14, 5:20] = 1
    labels[LA, 8:20, 10:25] = 3
    return labels


def write(path: Path, values: np.ndarray, grid: Grid = CT.grid) -> Path:
    image = sitk.GetImageFromArray(values)
    image.SetSpacing(grid.spacing_mm.tolist())
    image.SetOrigin(grid.ct_from_voxel[:3, 3].tolist())
    image.SetDirection((grid.ct_from_voxel[:3, :3] / grid.spacing_mm).ravel().tolist())
    path.parent.mkdir(parents=True, exist_ok=True)
    sitk.WriteImage(image, str(path))
    return path


def assert_boxes(found: LabelVolume) -> None:
    np.testing.assert_array_equal(found.mask("left_ventricle"), boxes() == 1)
    np.testing.assert_array_equal(found.mask("left_atrium"), boxes() == 3)


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("heart_ventricle_left.nii.gz", "left_ventricle"),
        ("heart_atrium_right", "right_atrium"),
        ("LV cavity", "left_ventricle"),
        ("ra_cavity.stl", "right_atrium"),
        ("03_Left-Atrium_mask.nii", "left_atrium"),
        ("pulmonary_vein", "pulmonary_veins"),
        ("atrial_appendage_left", "left_atrial_appendage"),
        ("heart_myocardium", "myocardium"),
        ("lv_myocardium.stl", "myocardium"),
        ("Right ventricle blood pool", "right_ventricle"),
        ("portal_vein_and_splenic_vein", None),
        ("vertebrae_L1", None),
        ("heart", None),
    ],
)
def test_names_of_structures(name: str, key: str | None) -> None:
    assert key_of(name) == key


def test_every_key_and_name_of_the_catalogue_is_known() -> None:
    for key, anatomy in CATALOGUE.items():
        assert key_of(key) == key
        if "not separated" not in anatomy.name:
            assert key_of(anatomy.name) == key
    assert vessel_of_wall("aorta_wall.stl") == "aorta"
    assert vessel_of_wall("la_wall.stl") is None


def test_a_label_map_of_the_catalogue_needs_no_names(tmp_path: Path) -> None:
    assert_boxes(read_labels(write(tmp_path / "labels.nii.gz", boxes()), like=CT))
    assert_boxes(read_labels(write(tmp_path / "labels.nrrd", boxes()), like=None))


def test_a_label_map_is_brought_to_the_grid_of_the_scan(tmp_path: Path) -> None:
    fine = Grid((20, 48, 60), CT.grid.ct_from_voxel @ np.diag([0.5, 0.5, 0.5, 1.0]) + _half_voxel())
    twice = boxes().repeat(2, 0).repeat(2, 1).repeat(2, 2)
    assert_boxes(read_labels(write(tmp_path / "fine.nii.gz", twice, fine), like=CT))


def _half_voxel() -> np.ndarray:
    shift = np.zeros((4, 4))
    shift[:3, 3] = -0.25 * CT.grid.ct_from_voxel[:3, :3].sum(axis=1)
    return shift


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("names.toml", '50 = "LV"\n7 = "left atrium"\n9 = "none"\n'),
        ("names.toml", "[labels]\nlv = 50\nleft_atrium = 7\nother = 9\n"),
        ("names.csv", "label,name\n50,LV cavity\n7,left_atrium\n9,none\n"),
        ("names.csv", "lv;50\nla;7\nbackground;9\n"),
    ],
)
def test_a_names_file_says_what_the_values_are(tmp_path: Path, name: str, text: str) -> None:
    values = np.choose(boxes(), [0, 50, 0, 7]).astype(np.int16)
    values[0, 0, 0] = 9
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert_boxes(read_labels(write(tmp_path / "map.nii.gz", values), like=CT, names=tmp_path / name))


def test_names_that_say_too_little_are_refused(tmp_path: Path) -> None:
    values = np.choose(boxes(), [0, 50, 0, 70]).astype(np.int16)
    path, names = write(tmp_path / "map.nii.gz", values), tmp_path / "names.toml"
    with pytest.raises(DataError, match=r"labels 50, 70, and nothing says which structures they are.*--names"):
        read_labels(path, like=CT)
    names.write_text('50 = "lv"', encoding="utf-8")
    with pytest.raises(DataError, match=r"names no structure for the labels \[70\]"):
        read_labels(path, like=CT, names=names)
    names.write_text('50 = "Quodlibetius"', encoding="utf-8")
    with pytest.raises(ConfigError, match="the name of label 50 is no structure's; known are left_ventricle") as caught:
        read_labels(path, like=CT, names=names)
    assert "Quodlibetius" not in str(caught.value)
    with pytest.raises(DataError, match="labels 1, and nothing says"):
        read_labels(write(tmp_path / "mask.nii.gz", (boxes() == 1).astype(np.uint8)), like=CT)


def test_the_challenge_numbering_is_known(tmp_path: Path) -> None:
    values = np.choose(boxes(), [0, 500, 0, 420]).astype(np.int16)
    assert_boxes(read_labels(write(tmp_path / "map.nii.gz", values), like=CT))


def test_a_slicer_segmentation_brings_its_names(tmp_path: Path) -> None:
    image = sitk.GetImageFromArray(np.choose(boxes(), [0, 4, 0, 9]).astype(np.uint8))
    for n, (name, value) in enumerate((("Left ventricle", "4"), ("LA", "9"))):
        image.SetMetaData(f"Segment{n}_Name", name)
        image.SetMetaData(f"Segment{n}_LabelValue", value)
    sitk.WriteImage(image, str(tmp_path / "heart.seg.nrrd"))
    assert_boxes(read_labels(tmp_path / "heart.seg.nrrd", like=None))


@pytest.mark.parametrize("ending", [".nii", ".nii.gz"])
def test_the_table_that_totalsegmentator_writes_into_one_map_is_read(tmp_path: Path, ending: str) -> None:
    # Its numbers are not the catalogue's: 1 is its myocardium.
    path = write(tmp_path / "all.nii", np.choose(boxes(), [0, 3, 0, 2]).astype(np.uint8))
    table = (
        b'<?xml version="1.0"?><CaretExtension><VolumeInformation Index="0"><LabelTable>'
        b'<Label Key="2" Red="1">heart_atrium_left</Label><Label Key="3" Red="1">heart_ventricle_left</Label>'
        b"</LabelTable></VolumeInformation></CaretExtension>"
    )
    table += bytes(-(len(table) + 8) % 16)
    extension = (len(table) + 8).to_bytes(4, "little") + (30).to_bytes(4, "little") + table
    data = bytearray(path.read_bytes())
    data[108:112] = np.float32(352 + len(extension)).tobytes()
    packed = bytes(data[:348]) + b"\1\0\0\0" + extension + bytes(data[352:])
    path = tmp_path / f"map{ending}"
    path.write_bytes(gzip.compress(packed) if ending == ".nii.gz" else packed)
    assert_boxes(read_labels(path, like=CT))


@pytest.mark.parametrize("packed", [False, True])
def test_a_folder_of_masks_as_totalsegmentator_writes_it(tmp_path: Path, packed: bool) -> None:
    folder = tmp_path / "masks"
    write(folder / "heart_ventricle_left.nii.gz", (boxes() == 1).astype(np.uint8))
    write(folder / "heart_atrium_left.nii.gz", (boxes() == 3).astype(np.uint8))
    write(folder / "vertebrae_L1.nii.gz", np.ones(CT.grid.shape, np.uint8))
    write(folder / "heart_myocardium.nii.gz", (boxes() > 0).astype(np.uint8))  # the chambers hold where they overlap
    path, said = folder, []
    if packed:
        path = tmp_path / "masks.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for each in folder.iterdir():
                archive.write(each, f"out/{each.name}")
    found = read_labels(path, like=CT, progress=lambda what, _share: said.append(what))
    assert_boxes(found)
    assert not found.mask("myocardium").any()
    assert "Leaving out 1 file whose name is no structure's of a heart" in said


def test_masks_without_a_name_or_a_voxel_are_refused(tmp_path: Path) -> None:
    for name in ("spleen", "liver"):
        write(tmp_path / "other" / f"{name}.nii.gz", (boxes() == 1).astype(np.uint8))
    with pytest.raises(DataError, match="2 masks or surfaces and none has a structure's name"):
        read_labels(tmp_path / "other", like=CT)
    write(tmp_path / "empty" / "aorta.nii.gz", np.zeros(CT.grid.shape, np.uint8))
    with pytest.raises(DataError, match="all masks of the heart are empty"):
        read_labels(tmp_path / "empty", like=CT)


@pytest.mark.parametrize("fractional", [False, True])
@pytest.mark.parametrize("like", [CT, None])
def test_a_dicom_segmentation(tmp_path: Path, fractional: bool, like: Volume | None) -> None:
    written = LabelVolume(boxes(), CT.grid, {1: "left_ventricle", 3: "left_atrium"})
    path = write_segmentation(
        tmp_path / "seg.dcm", written, texts={1: "LV blood", 3: "unclear"}, codes={3: "82471001"}, fractional=fractional
    )
    found = read_labels(path, like=like)
    if like is not None:
        assert_boxes(found)
    else:  # its own grid begins at the first slice that has a voxel
        np.testing.assert_array_equal(found.mask("left_ventricle"), (boxes() == 1)[2:9])
    assert found.volume_ml("left_atrium") == pytest.approx(written.volume_ml("left_atrium"))
    of_folder = read_labels(tmp_path, like=like)
    np.testing.assert_array_equal(of_folder.labels, found.labels)


def test_a_segmentation_of_something_else_is_refused(tmp_path: Path) -> None:
    written = LabelVolume(boxes(), CT.grid, {1: "left_ventricle", 3: "left_atrium"})
    path = write_segmentation(tmp_path / "seg.dcm", written, texts={1: "Quodlibetius", 3: "tumour"})
    with pytest.raises(DataError, match="none of its segments as a structure of a heart") as caught:
        read_labels(path, like=CT)
    assert "Quodlibetius" not in str(caught.value)
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(DataError, match=r"damaged|none of its segments"):
        read_labels(path, like=CT)


def test_stl_parts_fill_their_inside(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=15.0)
    ball.export(tmp_path / "lv_cavity.stl")
    found = read_labels(tmp_path, like=None)
    # Voxels of 0.6 mm on a ball of 15 mm: the error of counting is some 0.1 % of the volume.
    assert found.volume_ml("left_ventricle") == pytest.approx(ball.volume / 1000.0, rel=0.005)
    grid = volume_of(np.zeros((40, 40, 40)), spacing=(1.0, 1.0, 1.0), origin=(-20.0, -20.0, -20.0))
    on_scan = read_labels(tmp_path, like=grid)
    assert on_scan.grid is grid.grid
    assert on_scan.volume_ml("left_ventricle") == pytest.approx(ball.volume / 1000.0, rel=0.02)


def test_a_vessel_given_by_its_wall_is_filled(tmp_path: Path) -> None:
    tilt = trimesh.transformations.rotation_matrix(np.deg2rad(35.0), [1.0, 0.4, 0.0])
    trimesh.creation.annulus(r_min=10.0, r_max=12.0, height=30.0, transform=tilt).export(tmp_path / "aorta_wall.stl")
    found = read_labels(tmp_path, like=None)
    # The tube of 10 mm and 30 mm is 9.4 mL; planes that cut the ends askew give and take some of it.
    assert found.volume_ml("aorta") == pytest.approx(np.pi * 100.0 * 30.0 / 1000.0, rel=0.1)


def test_surfaces_that_cannot_be_filled_are_refused(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(radius=15.0)
    hole = ball.copy()
    hole.update_faces(np.arange(len(hole.faces)) > 3)
    hole.export(tmp_path / "lv.stl")
    with pytest.raises(DataError, match="the surface of left_ventricle is open"):
        read_labels(tmp_path, like=None)
    ball.apply_scale(0.001)
    ball.export(tmp_path / "lv.stl")
    with pytest.raises(DataError, match="in millimetres"):
        read_labels(tmp_path, like=None)
    (tmp_path / "lv.stl").write_bytes(b"solid nonsense")
    with pytest.raises(DataError, match="the surface of left_ventricle"):
        read_labels(tmp_path, like=None)


def test_the_real_pools_keep_their_volumes(shared_data: Path) -> None:
    found = read_labels(shared_data / "heart_rodero01" / "derived_stl", like=None)
    known = {"left_ventricle": 120.6, "right_ventricle": 186.2, "left_atrium": 68.3, "right_atrium": 111.4}
    for key, volume_ml in known.items():
        # The figures are given to 0.1 mL; counting voxels of 0.6 mm adds less than that.
        assert found.volume_ml(key) == pytest.approx(volume_ml, abs=0.15)
    assert found.volume_ml("aorta") > 20.0
