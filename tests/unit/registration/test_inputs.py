"""Files of landmarks, and the pairs made of them with a heart's points and a rig's fiducials."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cathxr.app.register_inputs import fiducial_pairs, file_pairs, left_out
from cathxr.core import ConfigError, DataError
from cathxr.heart import HeartFolder, Landmark, builtin_path, read_heart
from cathxr.registration import Kind, register, registration_toml
from cathxr.registration.pairs_file import read_landmarks
from cathxr.storage.rig_file import example_rig

CSV = "name,box_x_mm,box_y_mm,box_z_mm,ct_x_mm,ct_y_mm,ct_z_mm,box_std_mm,ct_std_mm\n"


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def heart() -> HeartFolder:
    return read_heart(builtin_path())


def test_a_table_and_toml_say_the_same(tmp_path: Path) -> None:
    table = read_landmarks(written(tmp_path / "l.csv", CSV + "apex,1,2,3,4,5,6,0.5,\nmouth,7,8,9,,,,,\n"))
    toml = read_landmarks(
        written(
            tmp_path / "l.toml",
            'schema = "cathxr-landmarks/1"\n[landmarks.apex]\nbox_mm = [1, 2, 3.0]\nct_mm = [4, 5, 6]\n'
            "box_std_mm = 0.5\n[landmarks.mouth]\nbox_mm = [7, 8, 9]\n",
        )
    )
    for one, other in zip(table, toml, strict=True):
        assert one.name == other.name
        for name in ("box_mm", "ct_mm", "box_std_mm", "ct_std_mm"):
            first, second = getattr(one, name), getattr(other, name)
            assert (first is None) == (second is None)
            assert first is None or np.array_equal(first, second)
    assert table[0].box_std_mm is not None
    assert table[0].box_std_mm.tolist() == [0.5, 0.5, 0.5]
    assert table[1].ct_mm is None


def test_a_table_from_a_spreadsheet_reads_too(tmp_path: Path) -> None:
    path = tmp_path / "l.csv"
    path.write_bytes(b"\xef\xbb\xbfname;box_x_mm;box_y_mm;box_z_mm\r\napex; 1.5 ;2;3\r\n;;;\r\n")
    assert read_landmarks(path)[0].box_mm is not None


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "has no landmarks"),
        ("name,box_x_mm\napex,1\n", "the columns box_y_mm, box_z_mm are missing"),
        ("box_x_mm,box_y_mm,box_z_mm\n1,2,3\n", "the column name is missing"),
        ("name\napex\n", "the columns box_x_mm, box_y_mm, box_z_mm are missing"),
        ("name,box_x_mm,box_y_mm,box_z_mm,weight\napex,1,2,3,4\n", "the column 'weight' is not known"),
        ("name,name,box_x_mm,box_y_mm,box_z_mm\na,a,1,2,3\n", "the column 'name' is there twice"),
        ("name,box_x_mm,box_y_mm,box_z_mm\napex,1,2,3\napex,4,5,6\n", "'apex' is there twice (row 3 again)"),
        ("name,box_x_mm,box_y_mm,box_z_mm\napex,1,nan,3\n", "row 2 (apex): box_y_mm is 'nan'; give a finite number"),
        ("name,box_x_mm,box_y_mm,box_z_mm\napex,1,two,3\n", "box_y_mm is 'two', which is no number"),
        ("name,box_x_mm,box_y_mm,box_z_mm\napex,1,,3\n", "box_y_mm is empty"),
        ("name,box_x_mm,box_y_mm,box_z_mm\napex,1,2\n", "row 2 has 3 columns and the first row 4"),
        ("name,box_x_mm,box_y_mm,box_z_mm\n,1,2,3\n", "row 2 has no name"),
        (CSV + "apex,1,2,3,4,5,6,-1,\n", "box_std_mm must be greater than zero, -1 was given"),
    ],
)
def test_a_wrong_table_is_told_in_a_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_landmarks(written(tmp_path / "l.csv", text))
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("schema = 3", "schema is wrong"),
        ('schema = "cathxr-landmarks/1"', "landmarks is missing"),
        ('schema = "cathxr-landmarks/1"\n[landmarks.a]\nbox_mm = [1, 2]\n', "landmarks.a.box_mm is wrong"),
        ('schema = "cathxr-landmarks/1"\n[landmarks.a]\nbox_mm = [1, nan, 2]\n', "give a finite number"),
        ('schema = "cathxr-landmarks/1"\n[landmarks.a]\nplace = [1, 2, 3]\n', "landmarks.a.place is not a key"),
        ('schema = "cathxr-landmarks/1"\n[landmarks.a]\n[landmarks.a]\n', "is not valid TOML"),
    ],
)
def test_wrong_toml_is_told_in_a_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read_landmarks(written(tmp_path / "l.toml", text))
    assert sentence in str(caught.value)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be read"):
        read_landmarks(tmp_path / "none.csv")
    (tmp_path / "l.csv").write_bytes(b"name\xff")
    with pytest.raises(ConfigError, match="not UTF-8"):
        read_landmarks(tmp_path / "l.csv")


def test_the_heart_gives_the_places_that_a_file_leaves_out(tmp_path: Path, heart: HeartFolder) -> None:
    name, opening = next(iter(heart.openings.items()))
    path = written(tmp_path / "l.csv", f"name,box_x_mm,box_y_mm,box_z_mm\n{name},1,2,3\n")
    (pair,) = file_pairs(path, heart)
    assert np.array_equal(pair.ct_mm, opening.centroid_mm)
    with pytest.raises(ConfigError, match="no such landmark; there are"):
        left_out((pair,), ("nobody",))
    assert left_out((pair,), (name,)) == ()


def test_an_unknown_landmark_is_answered_with_the_nearest_name(tmp_path: Path, heart: HeartFolder) -> None:
    path = written(tmp_path / "l.csv", "name,box_x_mm,box_y_mm,box_z_mm\nsuperior_vena_cave,1,2,3\n")
    with pytest.raises(ConfigError, match=r"did you mean superior_vena_cava\?"):
        file_pairs(path, heart)
    path = written(tmp_path / "m.csv", "name,ct_x_mm,ct_y_mm,ct_z_mm\napex,1,2,3\n")
    with pytest.raises(ConfigError, match="apex has no place in the box; add box_mm"):
        file_pairs(path, heart)


def test_an_earlier_registration_can_be_solved_again(tmp_path: Path, heart: HeartFolder) -> None:
    rng = np.random.default_rng(1)
    rows = [f"{key},{','.join(str(value) for value in rng.uniform(0, 90, 3))}" for key in list(heart.openings)[:5]]
    path = written(tmp_path / "l.csv", "\n".join(["name,box_x_mm,box_y_mm,box_z_mm", *rows]))
    solution = register(file_pairs(path, heart))
    again = file_pairs(written(tmp_path / "r.toml", registration_toml(solution.registration)), heart)
    second = register(again, Kind.RIGID)
    assert np.allclose(second.registration.matrix, solution.registration.matrix, atol=1e-12)


# --- the paper's way --------------------------------------------------------------------------------------------------


def with_fiducials(heart: HeartFolder) -> HeartFolder:
    """Return a heart whose model holds the rig's fiducials, stretched by 3 % along z and moved."""
    markers = [each for group in example_rig().markers.values() for each in group]
    landmarks = {
        each.name.lower(): Landmark(each.name.lower(), each.name, each.position_mm * [1, 1, 1.03] + [5, -9, 200])
        for each in markers
    }
    return replace(heart, landmarks=landmarks)


def test_the_rigs_fiducials_are_matched_with_the_models(heart: HeartFolder) -> None:
    pairs = fiducial_pairs(example_rig(), with_fiducials(heart), None)
    assert sorted(each.name for each in pairs) == [f"m{side}{n}" for side in "FT" for n in range(1, 5)]
    found = register(pairs, Kind.AFFINE).registration
    assert np.allclose(found.linear_ct_from_box, np.diag([1, 1, 1.03]), atol=1e-9)
    assert np.allclose(found.ct(np.zeros(3)), [5, -9, 200], atol=1e-9)


def test_the_fiducials_places_may_come_from_a_file(tmp_path: Path, heart: HeartFolder) -> None:
    text = "name,ct_x_mm,ct_y_mm,ct_z_mm\nmT1,0,-60,0\nMF2,120,0,-60\n"
    pairs = fiducial_pairs(example_rig(), heart, written(tmp_path / "f.csv", text))
    assert [each.name for each in pairs] == ["mT1", "mF2"]
    assert pairs[1].box_mm.tolist() == [120.0, 0.0, -60.0]
    path = written(tmp_path / "g.csv", "name,ct_x_mm,ct_y_mm,ct_z_mm\nmX1,0,-60,0\n")
    with pytest.raises(ConfigError, match="the rig has no fiducial 'mX1'"):
        fiducial_pairs(example_rig(), heart, path)


def test_missing_fiducials_are_told(heart: HeartFolder) -> None:
    with pytest.raises(ConfigError, match="no landmarks named as the rig's fiducials"):
        fiducial_pairs(example_rig(), replace(heart, landmarks={}), None)
    with pytest.raises(ConfigError, match=r"The rig has no \[markers\]"):
        fiducial_pairs(replace(example_rig(), markers={}), heart, None)
