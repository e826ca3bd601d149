"""The registration, its file, and the placement without landmarks."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cathxr.app.register_command import register as register_command
from cathxr.core import ConfigError, DataError, Pose, RegistrationError
from cathxr.heart import builtin_path
from cathxr.registration import (
    BEFORE_MM,
    Kind,
    LandmarkPair,
    Registration,
    default_placement,
    read_registration,
    write_registration,
)

COORDINATE = st.floats(-500.0, 500.0)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE).map(np.array)


def measured() -> Registration:
    pair = LandmarkPair("apex", np.array([80.0, -10.0, 5.0]), np.array([1.0, 2.0, 3.0]), 0.4)
    other = LandmarkPair("mouth", np.array([0.0, 0.0, 0.1]), np.array([4.0, 5.0, 6.0]))
    return Registration(
        ct_from_box=Pose(np.array([0.5, 0.5, 0.5, 0.5]), np.array([1.25, -2.5, 3.0])),
        kind=Kind.SIMILARITY,
        method="landmarks touched with the tip",
        scale=1.02,
        date="2026-01-31",
        fre_mm=0.8,
        tre_mm=1.4,
        predicted_tre_mm=1.1,
        landmarks=(pair, other),
    )


def test_written_file_reads_back_the_same(tmp_path: Path) -> None:
    path = tmp_path / "registration.toml"
    registration = measured()
    write_registration(path, registration)
    again = read_registration(path)
    for name in ("kind", "method", "scale", "date", "fre_mm", "tre_mm", "predicted_tre_mm"):
        assert getattr(again, name) == getattr(registration, name)
    assert np.array_equal(again.matrix, registration.matrix)
    assert [pair.name for pair in again.landmarks] == ["apex", "mouth"]
    assert again.landmarks[0].residual_mm == 0.4
    assert again.landmarks[1].residual_mm is None
    assert [each.name for each in tmp_path.iterdir()] == ["registration.toml"]
    assert b"\r" not in path.read_bytes()


def test_unknown_errors_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "registration.toml"
    write_registration(path, Registration(Pose.identity(), Kind.RIGID, "by hand"))
    text = path.read_text()
    assert "fre_mm" not in text
    assert "date" not in text
    assert read_registration(path).fre_mm is None


def test_a_date_of_toml_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "registration.toml"
    write_registration(path, measured())
    path.write_text(path.read_text().replace('date = "2026-01-31"', "date = 2026-01-31"))
    assert read_registration(path).date == "2026-01-31"


@given(point=POINT)
def test_box_undoes_ct(point: np.ndarray) -> None:
    registration = measured()
    # Two 3x3 products of numbers below 1e3 in float64: rounding stays below 1e-9 mm.
    assert np.allclose(registration.box(registration.ct(point)), point, atol=1e-9)
    homogeneous = registration.matrix @ np.append(point, 1.0)
    assert np.allclose(homogeneous[:3], registration.ct(point), atol=1e-9)


@given(inlet=POINT, offset=POINT, before=st.floats(0.0, 80.0))
def test_placement_puts_the_way_in_and_the_aim_on_x(inlet: np.ndarray, offset: np.ndarray, before: float) -> None:
    try:
        registration = default_placement(inlet, inlet + offset, method="test", before_mm=before)
    except RegistrationError:
        sideways = np.hypot(offset[0], offset[2])
        assert np.linalg.norm(offset) < 1.0 + 1e-9 or sideways < 0.1 * np.linalg.norm(offset) + 1e-9
        return
    assert np.allclose(registration.box(inlet), [before, 0.0, 0.0], atol=1e-9)
    assert np.allclose(registration.box(inlet + offset), [before + float(np.linalg.norm(offset)), 0.0, 0.0], atol=1e-9)
    assert np.linalg.det(registration.ct_from_box.rotation) == pytest.approx(1.0)
    up = registration.ct_from_box.rotation[:, 2]
    side = registration.ct_from_box.rotation[:, 1]
    assert up[1] < 0.0  # towards anterior, which is -y in LPS
    assert abs(side[1]) < 1e-9  # no rotation about x brings +z nearer to anterior
    assert not registration.is_measured


def test_the_command_puts_the_inlet_where_the_default_placement_does() -> None:
    option = next(each for each in register_command.params if each.name == "before")
    assert option.default == BEFORE_MM


def test_placement_of_a_standing_vein_is_a_patient_on_the_back() -> None:
    registration = default_placement(np.zeros(3), np.array([0.0, 0.0, 70.0]), method="test")
    expected = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]  # columns in LPS: superior, right, anterior
    assert np.allclose(registration.ct_from_box.rotation, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"scale": 0.0}, "scale"),
        ({"kind": Kind.RIGID, "scale": 1.1}, "expected 1 with kind 'rigid'"),
        ({"fre_mm": -1.0}, "fre_mm"),
        ({"tre_mm": float("nan")}, "tre_mm"),
        ({"kind": Kind.PLACEMENT, "fre_mm": 0.1}, "measures nothing"),
    ],
)
def test_impossible_registrations_are_refused(fields: dict[str, object], sentence: str) -> None:
    values: dict[str, object] = {"ct_from_box": Pose.identity(), "kind": Kind.SIMILARITY, "method": "test"}
    with pytest.raises(ValueError, match=sentence):
        Registration(**(values | fields))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('kind = "placement"', 'kind = "magic"', "kind is wrong"),
        ('kind = "placement"\n', "", "kind is missing"),
        ("scale = 1.0", "scale = 2.0", "expected 1 with kind 'placement'"),
        ("scale = 1.0", "scale = 1.0\nfre = 2.0", "fre is not a key"),
        ("scale = 1.0", 'scale = "1.0"', "scale is wrong"),
        ("scale = 1.0", "scale = 1.0\nfre_mm = 0.5", "measures nothing"),
        ("    12.71514964423707,\n", "", "ct_from_box.translation_mm is wrong"),
        ("    12.71514964423707,\n", "    nan,\n", "ct_from_box.translation_mm"),
        ("    0.5166828303577236,\n", "    9.0,\n", "quaternion of length 1"),
        ("cathxr-registration/1", "cathxr-registration/2", "schema is wrong"),
        ("[ct_from_box]", "[ct_from_box", "not valid TOML"),
    ],
)
def test_bad_file_is_refused_in_one_sentence(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    text = (builtin_path() / "registration.toml").read_text()
    assert old in text
    path = tmp_path / "registration.toml"
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as caught:
        read_registration(path)
    assert sentence in str(caught.value)
    assert "registration.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read_or_written_are_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be read"):
        read_registration(tmp_path / "none.toml")
    with pytest.raises(DataError, match="cannot be written"):
        write_registration(tmp_path / "no folder" / "registration.toml", measured())
