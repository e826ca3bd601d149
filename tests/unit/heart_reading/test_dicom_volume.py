"""DICOM series to volumes: voxels and places as they were written, however the files are called and packed."""

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from cathxr.core import DataError
from cathxr.heart.reading import read_volume
from cathxr.heart.volume import Grid, Volume

from ...heart_support.dicom_multiframe import write_enhanced
from ...heart_support.dicom_series import volume_of, write_series
from ...heart_support.encoders import SYNTAXES

# Positions are written with 6 decimals and cosines with 10: over 100 mm that is well below this.
PLACE_MM = 1e-4


def smooth(shape: tuple[int, int, int] = (12, 40, 48), seed: int = 1) -> np.ndarray:
    """Return smooth random HU: interpolating them costs little, so that tolerances may be tight."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, shape)
    field = ndimage.gaussian_filter(noise, 3.0)
    return np.rint(field / np.abs(field).max() * 900.0)


def assert_same(found: Volume, written: Volume, *, hu: float = 0.0) -> None:
    assert found.grid.shape == written.grid.shape
    np.testing.assert_allclose(found.grid.ct_from_voxel, written.grid.ct_from_voxel, atol=PLACE_MM)
    assert np.abs(found.hu.astype(int) - written.hu).max() <= hu


@pytest.mark.parametrize("syntax", list(SYNTAXES))
def test_every_transfer_syntax_gives_the_same_voxels(tmp_path: Path, syntax: str) -> None:
    written = volume_of(smooth((5, 24, 30)))
    write_series(tmp_path, written, syntax=syntax)
    assert_same(read_volume(tmp_path), written)


@pytest.mark.parametrize("syntax", ["explicit", "jpeg_ls", "rle"])
def test_signed_values_and_those_of_12_bits_are_read(tmp_path: Path, syntax: str) -> None:
    written = volume_of(smooth((5, 24, 30)))
    write_series(tmp_path, written, syntax=syntax, intercept=0.0)
    assert_same(read_volume(tmp_path), written)


def test_order_comes_from_positions_alone(tmp_path: Path) -> None:
    written = volume_of(smooth())
    write_series(tmp_path, written, shuffle=7)
    assert_same(read_volume(tmp_path), written)


def test_oblique_axes_are_kept_without_resampling(tmp_path: Path) -> None:
    rotation = Rotation.from_euler("xyz", [20.0, -33.0, 12.0], degrees=True).as_matrix()
    written = volume_of(smooth(), rotation=rotation)
    write_series(tmp_path, written)
    assert_same(read_volume(tmp_path), written)


@pytest.mark.parametrize("angles", [(90.0, 0.0, 0.0), (0.0, 90.0, 0.0), (180.0, 0.0, 0.0)])
def test_coronal_sagittal_and_upside_down_slices_stay_right_handed(
    tmp_path: Path, angles: tuple[float, float, float]
) -> None:
    written = volume_of(smooth(), rotation=Rotation.from_euler("xyz", angles, degrees=True).as_matrix())
    write_series(tmp_path, written)
    assert_same(read_volume(tmp_path), written)


def test_each_slice_has_its_own_rescale(tmp_path: Path) -> None:
    written = volume_of(smooth((6, 24, 30)))
    slopes = [0.5, 1.0, 0.25, 2.0, 1.0, 0.5]
    write_series(tmp_path, written, slope=slopes, intercept=[-1024.0, -1000.0, -1024.0, -900.0, -1024.0, 0.0])
    # A slope of 2 HU rounds by up to 1 HU.
    assert_same(read_volume(tmp_path), written, hu=1.0)


@pytest.mark.parametrize(("intercept", "padding"), [(-1024.0, 63536), (0.0, -2000)])
def test_padding_becomes_air(tmp_path: Path, intercept: float, padding: int) -> None:
    written = volume_of(np.full((5, 24, 24), 40))
    write_series(tmp_path, written, intercept=intercept, padding=padding)
    found = read_volume(tmp_path)
    assert found.hu[2, 0, 0] == -1024
    assert found.hu[2, 12, 12] == 40


@pytest.mark.parametrize("tilt_deg", [18.0, -9.5])
def test_a_tilted_gantry_is_brought_to_orthogonal_axes(tmp_path: Path, tilt_deg: float) -> None:
    written = volume_of(smooth((16, 48, 48)))
    write_series(tmp_path, written, tilt_deg=tilt_deg)
    found = read_volume(tmp_path)
    assert any("tilted gantry" in each for each in found.technical.remarks)
    axes = found.grid.ct_from_voxel[:3, :3] / found.grid.spacing_mm
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-9)
    # Where the tilted slices show tissue, the same point of `ct` has the same value.
    middle = np.argwhere(np.ones((16, 12, 36), bool)) + np.array([0, 18, 6])
    at = found.grid.to_voxel(written.grid.to_ct(middle[:, ::-1]))[:, ::-1]
    values = ndimage.map_coordinates(found.hu.astype(float), at.T, order=1, mode="nearest")
    # Cubic splines err by a few per mille on structures of 3 voxels, twice (written, read); rounding adds 1.
    assert np.abs(values - written.hu[tuple(middle.T)]).max() < 0.01 * 900.0 + 1.0


def test_one_missing_slice_is_named_and_interpolated(tmp_path: Path) -> None:
    written = volume_of(smooth((30, 24, 30)), spacing=(0.7, 0.7, 3.0), origin=(0.0, 0.0, -142.0))
    write_series(tmp_path, written, missing=[11])
    found = read_volume(tmp_path)
    assert found.technical.remarks == ("Between −112.0 and −106.0 mm a slice is missing: interpolated.",)
    mean = (written.hu[10].astype(float) + written.hu[12]) / 2.0
    assert np.abs(found.hu[11] - mean).max() <= 0.5
    assert_same(Volume(np.delete(found.hu, 11, 0), _shorter(written), found.technical), _without(written, 11))


def test_many_missing_slices_are_refused_and_named(tmp_path: Path) -> None:
    written = volume_of(smooth((30, 16, 16)), spacing=(0.7, 0.7, 1.0), origin=(0.0, 0.0, 5.0))
    write_series(tmp_path, written, missing=range(8, 18))
    with pytest.raises(DataError, match=r"Between 12\.0 and 23\.0 mm 10 slices are missing.*export the whole series"):
        read_volume(tmp_path)


def test_rounded_positions_are_no_uneven_ones(tmp_path: Path) -> None:
    written = volume_of(smooth((40, 16, 16)), spacing=(0.7, 0.7, 0.625), origin=(0.0, 0.0, 0.0))
    moved = {k: round(k * 0.625, 1) - k * 0.625 for k in range(40)}
    write_series(tmp_path, written, moved_mm=moved)
    found = read_volume(tmp_path)
    assert found.technical.remarks == ()
    # Rounded to 0.1 mm: uniform errors of 0.03 mm rms over 40 positions leave the slope uncertain by 4e-4 mm.
    assert found.grid.spacing_mm[2] == pytest.approx(0.625, abs=2e-3)
    np.testing.assert_array_equal(found.hu, written.hu)


def test_uneven_slices_are_interpolated_to_even_ones(tmp_path: Path) -> None:
    ramp = np.broadcast_to(np.arange(20.0)[:, None, None] * 20.0, (20, 16, 16))
    written = volume_of(ramp, spacing=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0))
    write_series(tmp_path, written, moved_mm=dict.fromkeys(range(3, 18, 3), 0.3))
    found = read_volume(tmp_path)
    assert "vary, 0.70 to 1.30 mm" in found.technical.remarks[0]
    # The ramp holds at the slices' true places: 20 HU a millimetre, but for the moved ones, which carry on 6 HU less.
    heights = found.grid.to_ct([[0.0, 0.0, k] for k in range(found.grid.shape[0])])[:, 2]
    assert np.abs(found.hu[:, 8, 8] - 20.0 * heights).max() <= 6.5


def test_copies_are_left_out_and_said(tmp_path: Path) -> None:
    written = volume_of(smooth((8, 16, 16)))
    write_series(tmp_path / "one", written)
    write_series(tmp_path / "two", written, shuffle=3)
    assert_same(read_volume(tmp_path), written)


def test_enhanced_ct_of_one_file(tmp_path: Path) -> None:
    rotation = Rotation.from_euler("xyz", [5.0, 10.0, 0.0], degrees=True).as_matrix()
    written = volume_of(smooth((7, 24, 30)), rotation=rotation)
    path = write_enhanced(tmp_path / "ct.dcm", {None: written}, slopes=(1.0, 0.5))
    assert_same(read_volume(path), written)
    write_enhanced(tmp_path / "packed" / "ct.dcm", {None: written}, slopes=(1.0, 0.5), syntax="jpeg_ls")
    assert_same(read_volume(tmp_path / "packed"), written)


def test_enhanced_ct_of_many_phases(tmp_path: Path) -> None:
    phases = {percent: volume_of(smooth((6, 16, 20), seed=percent)) for percent in (40, 75, 95)}
    path = write_enhanced(tmp_path / "ct.dcm", phases)
    assert_same(read_volume(path), phases[95])
    assert_same(read_volume(path, phase=75), phases[75])


def test_the_real_slices_have_their_true_spacing(shared_data: Path) -> None:
    found = read_volume(shared_data / "cta_thorax" / "dicom_ct_20slices")
    # The headers say SliceThickness 3 and no StudyInstanceUID; the positions are 2.0 mm apart.
    assert found.grid.shape == (20, 512, 512)
    np.testing.assert_allclose(found.grid.spacing_mm, [0.9765625, 0.9765625, 2.0], atol=1e-9)
    np.testing.assert_allclose(found.grid.ct_from_voxel[:3, 3], [-249.51171875, -437.51171875, -804.5], atol=1e-9)
    assert found.hu[:, :40, :40].max() < -900
    assert found.technical.kernel == "Br38f"


def _shorter(volume: Volume) -> Grid:
    depth, rows, columns = volume.grid.shape
    return Grid((depth - 1, rows, columns), volume.grid.ct_from_voxel)


def _without(volume: Volume, k: int) -> Volume:
    return Volume(np.delete(volume.hu, k, 0), _shorter(volume), volume.technical)
