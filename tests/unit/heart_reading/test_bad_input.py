"""What cannot be read is told in one sentence that says what to do, and never quotes a header."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk

from cathxr.core import DataError
from cathxr.heart.reading import find_series, read_volume
from cathxr.heart.reading.archive import Limits, unpacked
from cathxr.heart.reading.inflating import check_swelling

from ...heart_support.dicom_series import volume_of, write_series

VOLUME = volume_of(np.arange(5 * 16 * 16).reshape(5, 16, 16) % 300)


def mr(folder: Path) -> Path:
    write_series(folder, VOLUME, modality="MR", tags={"SOPClassUID": "1.2.840.10008.5.1.4.1.1.4"})
    return folder


def one_slice(folder: Path) -> Path:
    return write_series(folder, VOLUME, missing=[1, 2, 3, 4])[0]


def cut_off(folder: Path, *, keep: float = 0.6, syntax: str = "explicit") -> Path:
    path = write_series(folder, VOLUME, syntax=syntax)[2]
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * keep)])
    return folder


def cut_off_in_the_header(folder: Path) -> Path:
    return cut_off(folder, keep=0.2)


def cut_off_compressed(folder: Path) -> Path:
    return cut_off(folder, keep=0.8, syntax="jpeg_2000")


def htj2k(folder: Path) -> Path:
    for path in write_series(folder, VOLUME):
        data = pydicom.dcmread(path)
        data.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.4.201"
        data["PixelData"].is_undefined_length = True
        data.PixelData = pydicom.encaps.encapsulate([data.PixelData])
        data.save_as(path, enforce_file_format=True)
    return folder


def not_dicom(folder: Path) -> Path:
    folder.mkdir()
    (folder / "viewer.exe").write_bytes(b"MZ" + bytes(500))
    return folder


def text_file(folder: Path) -> Path:
    folder.mkdir()
    (folder / "ct.txt").write_text("a letter", encoding="utf-8")
    return folder / "ct.txt"


def empty(folder: Path) -> Path:
    folder.mkdir()
    return folder


def nowhere(folder: Path) -> Path:
    return folder / "nothing"


def encrypted_zip(folder: Path) -> Path:
    path = zipped(folder)
    data = bytearray(path.read_bytes())
    start = data.find(b"PK\x01\x02")
    while start >= 0:  # what the directory of the archive says of each entry: bit 0 of the flags is encryption
        data[start + 8] |= 1
        start = data.find(b"PK\x01\x02", start + 4)
    path.write_bytes(bytes(data))
    return path


def zipped(folder: Path) -> Path:
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for each in write_series(folder, VOLUME):
            archive.write(each, f"study/{each.name}")
    return path


def damaged_zip(folder: Path) -> Path:
    path = zipped(folder)
    path.write_bytes(path.read_bytes()[:-40])
    return path


def damaged_nifti(folder: Path) -> Path:
    folder.mkdir()
    (folder / "ct.nii.gz").write_bytes(b"\x1f\x8b" + bytes(100))
    return folder / "ct.nii.gz"


def cut_off_nifti(folder: Path) -> Path:
    folder.mkdir()
    path = folder / "ct.nii.gz"
    noise = np.random.default_rng(0).integers(-1000, 400, (40, 64, 64)).astype(np.int16)  # does not pack well
    sitk.WriteImage(sitk.GetImageFromArray(noise), path)
    path.write_bytes(path.read_bytes()[:100_000])  # the header and some slices: ITK takes the rest for zeros
    return path


def bomb(folder: Path) -> Path:
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("zeros", bytes(80 << 20))
    return path


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (mr, "holds MR, not CT; a heart is built from a CT with contrast"),
        (one_slice, r"\(only 1 slice\); give the folder of the whole CT series"),
        (cut_off, "damaged or cut off; copy the series again"),
        (cut_off_in_the_header, "damaged or cut off; copy the series again"),
        (cut_off_compressed, "damaged or cut off; copy the series again"),
        (htj2k, "unsupported compression"),
        (not_dicom, "holds no DICOM: none of its 1 files is; .*encrypted, export them again without"),
        (text_file, "neither DICOM nor a ZIP archive, a NIfTI or an NRRD file; give one of these"),
        (empty, "is empty; give a folder that holds DICOM files"),
        (nowhere, "is not there; give a folder of DICOM files"),
        (encrypted_zip, "is encrypted; unpack it with its password and give the folder"),
        (damaged_zip, "is a damaged ZIP archive; copy or export it again"),
        (damaged_nifti, "is damaged, cut off or not what its name says; copy or export it again"),
        (cut_off_nifti, "is damaged, cut off or not what its name says; copy or export it again"),
        (bomb, "unpacks to far more than a CT could .* unpack it yourself and give the folder"),
    ],
    ids=lambda each: getattr(each, "__name__", ""),
)
def test_one_sentence_each(tmp_path: Path, make: Callable[[Path], Path], sentence: str) -> None:
    path = make(tmp_path / "given")
    with pytest.raises(DataError, match=sentence) as caught:
        read_volume(path)
    text = str(caught.value)
    assert str(path) in text or "in name order" in text
    assert "\n" not in text
    assert caught.value.__cause__ is None
    assert caught.value.__suppress_context__ or caught.value.__context__ is None


def test_a_zip_archive_is_read_like_its_folder(tmp_path: Path) -> None:
    found = read_volume(zipped(tmp_path / "given"))
    np.testing.assert_array_equal(found.hu, VOLUME.hu)
    assert find_series(tmp_path / "given.zip")[0].slices == 5


def test_names_in_an_archive_lead_nowhere(tmp_path: Path) -> None:
    path = tmp_path / "evil.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("../../outside.dcm", "/absolute.dcm", "..\\windows.dcm", "C:\\x.dcm"):
            archive.writestr(name, b"content")
    with unpacked(path) as folder:
        assert sorted(each.name for each in folder.rglob("*")) == [f"{n:06d}" for n in range(4)]
    assert not folder.exists()
    assert [each.name for each in tmp_path.iterdir()] == ["evil.zip"]


def test_an_archive_that_lies_about_its_size_is_stopped_while_it_unpacks(tmp_path: Path) -> None:
    path = bomb(tmp_path / "given")
    data = bytearray(path.read_bytes())
    for mark, offset in ((b"PK\x01\x02", 24), (b"PK\x03\x04", 22)):
        start = data.find(mark)
        data[start + offset : start + offset + 4] = (1000).to_bytes(4, "little")
    path.write_bytes(bytes(data))
    with pytest.raises(DataError, match=r"damaged|far more"), unpacked(path):
        pass


def test_too_many_files_are_refused(tmp_path: Path) -> None:
    path = zipped(tmp_path / "given")
    with pytest.raises(DataError, match="holds 5 files, more than 3"), unpacked(path, limits=Limits(files=3)):
        pass


def test_deflated_dicom_has_a_limit(tmp_path: Path) -> None:
    path = write_series(tmp_path, volume_of(np.zeros((1, 512, 512))), syntax="deflated")[0]
    check_swelling(path, max_bytes=1 << 20)
    with pytest.raises(ValueError, match="limit"):
        check_swelling(path, max_bytes=1 << 18)


def test_damage_does_not_hide_the_rest_from_info(tmp_path: Path) -> None:
    cut_off(tmp_path / "given")
    found = find_series(tmp_path / "given")[0]
    assert found.slices == 4
    assert "1 file in the folder is damaged or cut off: copy the series again." in found.technical.remarks
