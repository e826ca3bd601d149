"""Nothing that names a patient, person, place, date or UID leaves the reader: planted everywhere, found nowhere."""

import gzip
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk

from cathxr.core import CathxrError
from cathxr.heart.reading import find_series, read_labels, read_volume
from cathxr.heart.volume import LabelVolume

from ..heart_support.dicom_multiframe import write_segmentation
from ..heart_support.dicom_series import volume_of, write_series
from ..heart_support.phantoms import four_chambers
from ..heart_support.planted import Planted, plant

PLANTED = Planted()
GIVEN = "gesualdo-folder"
"""The folder that the user names: it may stand in an error on the console, and nowhere in the heart."""


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run cathxr with all it can say."""
    return subprocess.run(
        [sys.executable, "-m", "cathxr", "-vv", *arguments],
        capture_output=True, text=True, encoding="utf-8", errors="replace", timeout=600.0, check=False,
        env=os.environ | {"PYTHONIOENCODING": "utf-8"} | environment,
    )  # fmt: skip


def assert_clean(text: str | bytes, where: str, *, also: tuple[str, ...] = ()) -> None:
    """Find none of what was planted, in upper or lower case, as single or as double bytes."""
    data = (text.encode() if isinstance(text, str) else text).lower()
    for needle in (*PLANTED.needles, *also):
        for encoded in (needle.lower().encode(), needle.lower().encode("utf-16-le")):
            assert encoded not in data, f"{needle} is in {where}"


def contents(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Yield every file's name and content in the folder, packed ones unpacked."""
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        data = path.read_bytes()
        yield path.relative_to(folder).as_posix(), gzip.decompress(data) if path.suffix == ".gz" else data


def planted_segmentation(path: Path, truth: LabelVolume) -> Path:
    """Write the labels as a DICOM segmentation with names planted everywhere."""
    texts = {label: key for label, key in truth.names.items() if truth.mask(key).any()}
    write_segmentation(path, truth, texts=texts)
    data = pydicom.dcmread(path)
    plant(data, PLANTED)
    data.save_as(path)
    return path


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LabelVolume]:
    """A four-chamber heart as a DICOM series with names planted everywhere, and its true labels."""
    volume, truth = four_chambers((72, 96, 96), (1.9, 1.9, 2.2), seed=5)
    folder = tmp_path_factory.mktemp("study") / GIVEN
    write_series(folder, volume, planted=PLANTED)
    return folder, truth


def test_the_names_are_really_there(study: tuple[Path, LabelVolume]) -> None:
    # Every eighth slice has all there is; the others what images commonly have.
    path = max((each for each in study[0].rglob("*") if each.is_file()), key=lambda each: each.stat().st_size)
    data = path.read_bytes().lower()
    for needle in PLANTED.needles:
        if needle != PLANTED.date_written:
            assert needle.lower().encode() in data
    header = pydicom.dcmread(path, stop_before_pixels=True)
    # Every kind of text, technical words too, in the dictionary's groups and in private ones.
    for keyword in ("PatientName", "InstitutionName", "ConvolutionKernel", "SeriesDescription", "ImageComments"):
        assert PLANTED.name in str(header[keyword].value)
    assert len(header) > 2000
    assert PLANTED.name in path.name


def test_a_heart_built_from_planted_dicom_holds_none_of_it(study: tuple[Path, LabelVolume], tmp_path: Path) -> None:
    # Ready labels, for a segmentation sees the voxels alone; they are planted as well.
    masks = planted_segmentation(tmp_path / GIVEN / f"{PLANTED.folder}.dcm", study[1])
    done = run("heart", "build", str(study[0]), "--labels", str(masks.parent), "--out", str(tmp_path / "heart"))
    assert done.returncode == 0, done.stderr
    assert_clean(done.stdout, "the output")
    assert_clean(done.stderr, "the log")
    found = dict(contents(tmp_path / "heart"))
    assert {"heart.toml", "heart.glb", "labels.nii.gz", "quality.html"} <= set(found)
    for name, data in found.items():
        assert_clean(name, "a file's name", also=(GIVEN,))
        assert_clean(data, name, also=(GIVEN,))


def test_info_shows_none_of_it(study: tuple[Path, LabelVolume]) -> None:
    done = run("heart", "info", str(study[0]))
    assert done.returncode == 0, done.stderr
    assert_clean(done.stdout, "the table", also=(PLANTED.age,))
    assert_clean(done.stderr, "the log")
    assert "axial" in done.stdout


@pytest.mark.parametrize(
    ("fault", "debug"),
    [
        ("cut off", {}),
        ("cut off", {"CATHXR_DEBUG": "1"}),
        ("MR", {}),
        ("no positions", {"CATHXR_DEBUG": "1"}),
        ("several phases", {}),
        ("missing slices", {}),
    ],
)
def test_errors_quote_none_of_it(tmp_path: Path, fault: str, debug: dict[str, str]) -> None:
    small = volume_of(np.arange(12 * 16 * 16).reshape(12, 16, 16) % 500)
    folder = tmp_path / GIVEN
    if fault == "cut off":
        path = write_series(folder, small, planted=PLANTED)[4]
        path.write_bytes(path.read_bytes()[:-100])
    elif fault == "MR":
        write_series(folder, small, planted=PLANTED, modality="MR", tags={"SOPClassUID": "1.2.840.10008.5.1.4.1.1.4"})
    elif fault == "no positions":
        for path in write_series(folder, small, planted=PLANTED):
            data = pydicom.dcmread(path)
            data.add_new(0x00200032, "LO", PLANTED.name)
            data.save_as(path)
    elif fault == "several phases":
        for number in (1, 2):
            tags = {"AcquisitionNumber": number}
            paths = write_series(folder / str(number), small, planted=PLANTED, tags=tags)
            for each, path in enumerate(paths):
                data = pydicom.dcmread(path)
                data.AcquisitionNumber, data.InstanceNumber = number, each
                data.PixelData = bytes([number]) * len(data.PixelData)
                data.save_as(path)
    else:
        write_series(folder, small, planted=PLANTED, missing=range(3, 9))
    done = run("heart", "build", str(folder), "--out", str(tmp_path / "heart"), **debug)
    assert done.returncode != 0
    assert "Error" in done.stderr
    assert_clean(done.stdout + done.stderr, f"the error about {fault}")
    assert not (tmp_path / "heart").exists()


def test_only_technical_fields_leave_the_reader(study: tuple[Path, LabelVolume]) -> None:
    volume = read_volume(study[0])
    said: list[str] = []
    read_volume(study[0], progress=lambda what, _share: said.append(what))
    assert_clean(repr(volume.technical), "what leaves the reader", also=(PLANTED.age,))
    assert_clean(repr(find_series(study[0])), "the summaries")
    assert_clean(" ".join(said), "the progress", also=(GIVEN,))
    assert (volume.technical.modality, volume.technical.kernel, volume.technical.tube_voltage_kv) == ("CT", "", None)


def test_files_of_other_kinds_keep_theirs_to_themselves(tmp_path: Path, study: tuple[Path, LabelVolume]) -> None:
    values = np.random.default_rng(0).integers(-1000, 500, (6, 12, 12)).astype(np.int16)
    image = sitk.GetImageFromArray(values)
    image.SetMetaData("patient", PLANTED.name)
    nrrd = tmp_path / f"{PLANTED.folder}.nrrd"
    sitk.WriteImage(image, str(nrrd))
    nifti = tmp_path / f"{PLANTED.folder}.nii"
    sitk.WriteImage(image, str(nifti))
    data = bytearray(nifti.read_bytes())
    data[148 : 148 + 40] = f"{PLANTED.name} {PLANTED.date}".encode().ljust(40)  # descrip
    data[228 : 228 + 20] = PLANTED.name.encode().ljust(20)  # aux_file
    nifti.write_bytes(bytes(data))
    for path in (nrrd, nifti):
        assert PLANTED.name.encode() in path.read_bytes()
        assert_clean(repr(read_volume(path).technical), path.suffix)
        assert_clean(repr(find_series(path)), path.suffix)


def test_a_planted_segmentation_gives_labels_alone(tmp_path: Path, study: tuple[Path, LabelVolume]) -> None:
    path = planted_segmentation(tmp_path / f"{PLANTED.folder}.dcm", study[1])
    found = read_labels(path, like=None)
    assert_clean(repr(found.names), "the labels' names")
    assert set(found.names.values()) == {key for key in study[1].names.values() if study[1].mask(key).any()}
    data = pydicom.dcmread(path)
    data.SegmentSequence[0].SegmentLabel = PLANTED.name
    del data.SegmentSequence[1:]
    data.save_as(path)
    with pytest.raises(CathxrError) as caught:
        read_labels(path, like=None)
    assert_clean(str(caught.value).replace(str(path), ""), "the error")
