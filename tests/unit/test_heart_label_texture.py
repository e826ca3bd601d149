"""The labels as a browser gets them: read without any reader of medical images, made small, nothing lost in between."""

import gzip
import struct
from pathlib import Path

import numpy as np
import pytest

from cathxr.core import DataError
from cathxr.heart import builtin_path, read_heart
from cathxr.heart.label_texture import label_texture
from cathxr.heart.labels_file import read_labels
from cathxr.heart.volume import Grid, LabelVolume


def _ball(shape: tuple[int, int, int], radius_mm: float, spacing: tuple[float, float, float]) -> LabelVolume:
    """Return a ball of label 3 in the middle of a grid that is turned in space. spacing: along i, j, k."""
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(spacing)
    matrix[:3, 3] = [10.0, -20.0, 30.0]
    grid = Grid(shape, matrix)
    kji = np.indices(shape).reshape(3, -1).T
    middle = grid.to_ct((np.array(shape[::-1]) - 1) / 2.0)
    inside = np.linalg.norm(grid.to_ct(kji[:, ::-1]) - middle, axis=1) <= radius_mm
    return LabelVolume(np.where(inside, 3, 0).astype(np.uint8).reshape(shape), grid, {3: "left_atrium"})


@pytest.mark.parametrize("most", [192, 64, 33])
def test_a_small_label_volume_lies_where_the_large_one_does(most: int) -> None:
    volume = _ball((70, 90, 110), 24.0, (0.6, 0.7, 0.8))
    small = label_texture(volume, most=most)
    assert max(small.labels.shape) <= most
    rim = np.ones(small.labels.shape, dtype=bool)
    rim[1:-1, 1:-1, 1:-1] = False
    assert not small.labels[rim].any()
    middle = volume.grid.to_ct((np.array(volume.labels.shape[::-1]) - 1) / 2.0)
    found = small.grid.to_ct(np.argwhere(small.labels == 3)[:, ::-1])
    step = float(small.grid.spacing_mm.max())
    # A voxel is given the label of the nearest one: no surface moves by more than half a diagonal of both grids.
    slack = np.sqrt(3.0) / 2.0 * (step + 0.8)
    assert np.linalg.norm(found.mean(axis=0) - middle) < 0.2 * step
    assert abs(np.linalg.norm(found - middle, axis=1).max() - 24.0) < slack
    assert small.volume_ml("left_atrium") == pytest.approx(
        volume.volume_ml("left_atrium"), rel=3.0 * 0.1 * step / 24.0 + 0.02
    )


def test_voxels_are_no_finer_than_the_labels_are() -> None:
    volume = _ball((40, 40, 40), 10.0, (1.0, 1.0, 1.0))
    small = label_texture(volume)
    assert np.allclose(small.grid.spacing_mm, 1.0)
    assert np.array_equal(
        small.labels[1:-1, 1:-1, 1:-1][small.labels[1:-1, 1:-1, 1:-1] > 0].size, (volume.labels > 0).sum()
    )


def test_nothing_labelled_is_said() -> None:
    grid = Grid((4, 4, 4), np.eye(4))
    with pytest.raises(DataError, match="empty"):
        label_texture(LabelVolume(np.zeros((4, 4, 4), np.uint8), grid, {}))


def test_the_built_in_heart_s_labels_are_read_as_the_image_library_reads_them() -> None:
    volume_files = pytest.importorskip("cathxr.heart.reading.volume_files")
    heart = read_heart(builtin_path())
    assert heart.labels is not None
    volume = read_labels(heart.labels, {each.label: key for key, each in heart.structures.items()})
    expected, grid = volume_files.read_grid(heart.labels, heart.labels)
    assert np.array_equal(volume.labels, expected)
    assert np.abs(volume.grid.ct_from_voxel - grid.ct_from_voxel).max() < 1e-6
    for key, structure in heart.structures.items():
        if structure.volume_ml is not None:
            assert volume.volume_ml(key) == pytest.approx(structure.volume_ml, rel=0.001)


def _nifti(
    *, sizes: tuple[int, int, int] = (3, 4, 5), code: int = 2, magic: bytes = b"n+1\0", affine: int = 1
) -> bytes:
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *sizes, 1, 1, 1, 1)
    struct.pack_into("<h", header, 70, code)
    struct.pack_into("<3f", header, 108, 352.0, 1.0, 0.0)
    struct.pack_into("<2h", header, 252, 0, affine)
    struct.pack_into("<12f", header, 280, -2, 0, 0, 1, 0, -2, 0, 2, 0, 0, 2, 3)
    header[344:348] = magic
    return bytes(header) + bytes(range(60))


def _saved(folder: Path, content: bytes, *, packed: bool = True) -> Path:
    path = folder / "labels.nii.gz"
    path.write_bytes(gzip.compress(content) if packed else content)
    return path


def test_a_small_file_s_voxels_axes_and_names(tmp_path: Path) -> None:
    volume = read_labels(_saved(tmp_path, _nifti()), {1: "aorta", 59: "left_atrium"})
    assert volume.labels.shape == (5, 4, 3)
    assert volume.labels[0, 0, 1] == 1
    assert volume.labels[4, 3, 2] == 59
    assert np.count_nonzero(volume.labels) == 2  # what has no name is nothing
    assert np.allclose(volume.grid.to_ct([1, 0, 0]), [1.0, -2.0, 3.0])  # RAS (-1, 2, 3) is LPS (1, -2, 3)


@pytest.mark.parametrize(
    ("content", "packed", "words"),
    [
        (b"no header", True, "no NIfTI-1"),
        (_nifti(magic=b"ni1\0"), True, "no NIfTI-1"),
        (_nifti(code=16), True, "other values"),
        (_nifti(affine=0), True, "other values"),
        (_nifti(sizes=(0, 4, 5)), True, "dimensions"),
        (_nifti(sizes=(32000, 32000, 32000)), True, "larger than any"),
        (_nifti()[:-1], True, "ends before"),
        (_nifti(), False, "cannot be read"),
        (gzip.compress(_nifti())[:-20], False, "damaged or cut short"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path: Path, content: bytes, packed: bool, words: str) -> None:
    with pytest.raises(DataError, match=words):
        read_labels(_saved(tmp_path, content, packed=packed), {1: "aorta"})
    with pytest.raises(DataError, match="cannot be read"):
        read_labels(tmp_path / "none.nii.gz", {1: "aorta"})
