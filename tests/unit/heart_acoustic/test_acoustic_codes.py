"""Tissues, their codes in bytes, and the acoustic volume's file."""

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cathxr.core import DataError
from cathxr.heart.acoustic_codes import CHANNELS, SCALES, AcousticVolume
from cathxr.heart.acoustic_file import read_acoustic, write_acoustic
from cathxr.heart.tissues import TISSUES, hu_knots, properties


def some_volume() -> AcousticVolume:
    rgba = np.random.default_rng(3).integers(0, 256, (5, 6, 7, 4), dtype=np.uint8)
    return AcousticVolume(rgba, np.diag([1.5, 1.5, 1.5, 1.0]), SCALES)


def test_every_tissue_is_on_every_scale_and_reads_back() -> None:
    for tissue in TISSUES.values():
        for channel, value in (
            ("impedance", tissue.impedance_mrayl),
            ("scatter", tissue.scatter),
            ("attenuation", tissue.attenuation),
        ):
            scale = SCALES[channel]
            byte = np.round(scale.code(value) * 255.0)
            step = abs(float(scale.value(min(byte + 1, 255))) - float(scale.value(max(byte - 1, 0)))) / 2.0
            # Half a step of a byte, with a little for the curve's bend within it.
            assert float(scale.value(byte)) == pytest.approx(value, abs=0.6 * step), (tissue.key, channel)


def test_the_impedances_are_those_of_the_literature() -> None:
    # Ranges in Duck 1990, table 4.2 onwards, and the IT'IS database, 4.1.
    for key, low, high in (
        ("blood", 1.60, 1.68),
        ("myocardium", 1.62, 1.76),
        ("muscle", 1.62, 1.76),
        ("fat", 1.25, 1.45),
        ("lung", 0.18, 0.55),
        ("bone", 5.0, 8.0),
    ):
        assert low < TISSUES[key].impedance_mrayl < high
    blood, muscle = TISSUES["blood"], TISSUES["myocardium"]
    assert -30.0 < 20.0 * np.log10(blood.scatter / muscle.scatter) < -20.0


def test_soft_tissues_are_many_bytes_apart() -> None:
    # On a linear scale from lung to bone, blood and myocardium would be one byte apart: no normal comes from that.
    bytes_apart = 255.0 * np.diff(
        SCALES["impedance"].code([TISSUES[each].impedance_mrayl for each in ("blood", "myocardium")])
    )
    assert bytes_apart[0] > 10.0


def test_codes_rise_with_their_values_and_stop_at_the_ends() -> None:
    for channel in CHANNELS:
        scale = SCALES[channel]
        assert (np.diff(scale.value(np.arange(256))) > 0.0).all()
        assert np.allclose(scale.code(scale.value(np.arange(256))) * 255.0, np.arange(256), atol=1e-6)
        assert scale.code(1e6) == 1.0
        assert scale.code(1e-9) == pytest.approx(0.0, abs=1e-3)


def test_ct_numbers_become_the_tissues_they_are() -> None:
    knots, values = hu_knots(450.0)
    assert (np.diff(knots) > 0.0).all()
    for hu, key in ((-850, "lung"), (-100, "fat"), (50, "muscle"), (450, "blood"), (350, "blood"), (1200, "bone")):
        found = [np.interp(hu, knots, values[:, at]) for at in range(3)]
        assert found == pytest.approx(properties([key])[0].tolist()), hu
    without, bone = hu_knots(None)
    assert np.interp(450, without, bone[:, 0]) == pytest.approx(np.log(TISSUES["bone"].impedance_mrayl))


def test_file_reads_back_and_is_the_same_twice(tmp_path: Path) -> None:
    volume = some_volume()
    file = write_acoustic(tmp_path / "acoustic.bin.gz", volume)
    again = read_acoustic(file)
    assert np.array_equal(again.rgba, volume.rgba)
    assert again.grid.shape == (5, 6, 7)
    assert np.array_equal(again.physical("scatter"), volume.physical("scatter"))
    first = file.file.read_bytes()
    write_acoustic(tmp_path / "acoustic.bin.gz", volume)
    assert file.file.read_bytes() == first
    assert gzip.decompress(first) == volume.rgba.tobytes()  # what a browser makes of it


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (lambda data: data[: len(data) // 2], "damaged or cut short"),
        (lambda data: b"hello", "not gzip"),
        (lambda data: gzip.compress(b"short"), "holds 5 bytes"),
        (lambda data: gzip.compress(bytes(100_000)), "holds more bytes"),
        (lambda data: data[:30] + b"\xff\xff\xff\xff" + data[34:], "damaged|cannot be read|holds"),
    ],
)
def test_damaged_file_is_refused_in_one_sentence(tmp_path: Path, damage: object, sentence: str) -> None:
    file = write_acoustic(tmp_path / "acoustic.bin.gz", some_volume())
    file.file.write_bytes(damage(file.file.read_bytes()))  # type: ignore[operator]
    with pytest.raises(DataError, match=sentence):
        read_acoustic(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    file = write_acoustic(tmp_path / "acoustic.bin.gz", some_volume())
    with pytest.raises(DataError, match=r"elsewhere\.gz cannot be read"):
        read_acoustic(replace(file, file=tmp_path / "elsewhere.gz"))


def test_other_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="expected uint8"):
        AcousticVolume(np.zeros((2, 2, 2, 3), np.uint8), np.eye(4), SCALES)
    with pytest.raises(ValueError, match="scales: expected"):
        AcousticVolume(np.zeros((2, 2, 2, 4), np.uint8), np.eye(4), {"impedance": SCALES["impedance"]})
