"""NIfTI and NRRD: their own axes brought to `ct`, and what is no CT refused."""

from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from scipy.spatial.transform import Rotation

from cathxr.core import DataError
from cathxr.heart.reading import find_series, read_volume

VALUES = np.random.default_rng(3).integers(-1000, 800, (7, 9, 11)).astype(np.int16)


def write(path: Path, values: np.ndarray = VALUES, *, direction: np.ndarray | None = None, **metadata: str) -> Path:
    image = sitk.GetImageFromArray(values, isVector=False)
    if values.ndim == 3:
        image.SetSpacing([0.5, 0.75, 1.25])
        image.SetOrigin([-30.0, 20.0, 400.0])
        image.SetDirection((np.eye(3) if direction is None else direction).ravel().tolist())
    for key, value in metadata.items():
        image.SetMetaData(key, value)
    sitk.WriteImage(image, str(path))
    return path


@pytest.mark.parametrize("name", ["ct.nii.gz", "ct.nii", "ct.nrrd", "ct.nhdr", "ct.mha"])
@pytest.mark.parametrize("flip", [(1, 1, 1), (-1, 1, 1), (-1, -1, 1), (1, 1, -1), (-1, -1, -1)])
def test_every_voxel_stays_where_it_is_in_ct(tmp_path: Path, name: str, flip: tuple[int, int, int]) -> None:
    direction = Rotation.from_euler("xyz", [10.0, 20.0, 30.0], degrees=True).as_matrix() * np.array(flip)
    path = write(tmp_path / name, direction=direction)
    found = read_volume(path)
    ijk = np.array([[0, 0, 0], [10, 0, 0], [0, 8, 0], [0, 0, 6], [3, 4, 5]])
    points = np.array([-30.0, 20.0, 400.0]) + (ijk * [0.5, 0.75, 1.25]) @ direction.T
    at = found.grid.to_voxel(points)
    # NIfTI keeps its affine as single-precision numbers: 1e-7 of 400 mm.
    np.testing.assert_allclose(at, np.rint(at), atol=1e-3)
    k, j, i = np.rint(at).astype(int).T[::-1]
    np.testing.assert_array_equal(found.hu[k, j, i], VALUES[ijk[:, 2], ijk[:, 1], ijk[:, 0]])


def test_floats_and_nan_become_hu(tmp_path: Path) -> None:
    values = VALUES.astype(np.float32) + 0.3
    values[0, 0, 0] = np.nan
    found = read_volume(write(tmp_path / "ct.nrrd", values))
    assert found.hu[0, 0, 0] == -1024
    np.testing.assert_array_equal(found.hu[1:], VALUES[1:])


@pytest.mark.parametrize(
    ("low", "high", "sentence"),
    [
        (0, 2500, r"not Hounsfield units.*an MR, or a CT without its offset; convert the CT again"),
        (0, 3, r"not Hounsfield units.*a mask is given with --labels"),
    ],
)
def test_what_is_no_ct_is_refused(tmp_path: Path, low: int, high: int, sentence: str) -> None:
    values = np.random.default_rng(0).integers(low, high + 1, (6, 8, 8)).astype(np.int16)
    values[0, 0, 0] = high
    path = write(tmp_path / "x.nii.gz", values)
    with pytest.raises(DataError, match=sentence):
        read_volume(path)
    assert "not Hounsfield units" in find_series(path)[0].problem


def test_several_volumes_ask_for_one(tmp_path: Path) -> None:
    volumes = [sitk.GetImageFromArray(VALUES + n) for n in range(3)]
    sitk.WriteImage(sitk.JoinSeries(volumes), str(tmp_path / "cine.nii.gz"))
    with pytest.raises(DataError, match=r"holds 3 volumes .*--phase a number from 1 to 3"):
        read_volume(tmp_path / "cine.nii.gz")
    found = read_volume(tmp_path / "cine.nii.gz", phase="3")
    np.testing.assert_array_equal(np.sort(found.hu.ravel()), np.sort((VALUES + 2).ravel()))
    assert find_series(tmp_path / "cine.nii.gz")[0].phases == ("1", "2", "3")


def test_a_phase_of_a_single_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="nothing about phases"):
        read_volume(write(tmp_path / "ct.nrrd"), phase="75")


def test_colours_and_flat_pictures_are_refused(tmp_path: Path) -> None:
    colours = sitk.GetImageFromArray(np.zeros((3, 8, 8, 3), np.uint8), isVector=True)
    sitk.WriteImage(colours, str(tmp_path / "colours.nrrd"))
    with pytest.raises(DataError, match="holds 3 values in each voxel"):
        read_volume(tmp_path / "colours.nrrd")
    sitk.WriteImage(sitk.GetImageFromArray(VALUES[0]), str(tmp_path / "flat.nrrd"))
    with pytest.raises(DataError, match="a single picture, not a volume"):
        read_volume(tmp_path / "flat.nrrd")


def test_a_declared_size_that_no_scan_has_is_refused_before_it_is_read(tmp_path: Path) -> None:
    (tmp_path / "huge.nhdr").write_text(
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 9000 9000 9000\nencoding: raw\nendian: little\ndata file: x.raw\n",
        encoding="utf-8",
    )
    (tmp_path / "x.raw").write_bytes(b"\0" * 10)
    with pytest.raises(DataError, match="declares 9000 x 9000 x 9000 voxels"):
        read_volume(tmp_path / "huge.nhdr")


def test_a_folder_with_one_file_is_that_file(tmp_path: Path) -> None:
    write(tmp_path / "ct.nii.gz")
    assert read_volume(tmp_path).grid.shape == VALUES.shape
    write(tmp_path / "other.nii.gz")
    with pytest.raises(DataError, match="holds 2 volume files"):
        read_volume(tmp_path)
