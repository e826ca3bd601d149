"""The segmentation of a small phantom whose volumes are known, seeds, and scans that hold no heart."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from cathxr.core import DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.seeds import Seed
from cathxr.heart.segmentation import segment
from cathxr.heart.volume import Grid, Technical, Volume

from ...heart_support.measures import CHAMBERS, agreement
from .conftest import Case


# At 1.5 mm a voxel's tenth, all round, is 1.5 % of a chamber's volume; where veins open into an atrium the cut may be
# 2 mm off over some 6 cm² in all: 1.2 mL of about 50 to 60. The full-size proof holds 3 %.
@pytest.mark.parametrize(("key", "tolerance"), [(key, 0.03 if "ventricle" in key else 0.08) for key in CHAMBERS])
def test_each_chamber_has_its_volume(phantom: Case, key: str, tolerance: float) -> None:
    found = agreement(phantom.found.labels, phantom.truth, key)
    assert abs(found.volume_error) < tolerance
    assert found.mean_mm < 0.5 * 1.5  # half a voxel
    assert found.dice > 0.93


def test_the_boundary_follows_the_scans_own_contrast(phantom: Case) -> None:
    levels = phantom.found.thresholds
    assert 100.0 - 15.0 < levels.tissue_hu < 130.0  # muscle 100, liver 110; the histogram's bins are 5 HU
    assert 300.0 < levels.blood_hu < 420.0  # right 320, left 400


def test_no_bone_and_no_lung_is_labelled(phantom: Case) -> None:
    blood = phantom.truth.labels > 0
    labelled = phantom.found.labels.labels > 0
    # What is labelled beyond the truth is at most the surface's partial volume: a few per cent.
    assert np.count_nonzero(labelled & ~blood) < 0.04 * np.count_nonzero(labelled)


def test_turning_the_axes_round_changes_nothing_beyond_a_voxel(phantom: Case) -> None:
    """The same patient stored feet first and with columns for rows; half the contrast, and a little more of all HU."""
    grid = phantom.volume.grid
    hu = np.ascontiguousarray(np.flip(np.swapaxes(phantom.volume.hu, 1, 2), 0))
    hu = np.round(hu * np.where(hu > 0, 0.5, 1.0) + np.where(hu > 0, 25.0, 0.0)).astype(np.int16)
    matrix = grid.ct_from_voxel[:, [1, 0, 2, 3]].copy()
    matrix[:3, 3] = grid.to_ct([0.0, 0.0, grid.shape[0] - 1.0])
    matrix[:3, 2] *= -1.0
    turned = Volume(hu, Grid(hu.shape, matrix), phantom.volume.technical)
    labels = segment(turned).labels.labels
    back = np.swapaxes(np.flip(labels, 0), 1, 2)
    for key in CHAMBERS:
        mine, other = back == CATALOGUE[key].label, phantom.found.labels.mask(key)
        # A shift of 0.1 voxel all round is 1 % of a chamber this size; a vein's mouth may move by a voxel.
        assert 2.0 * np.count_nonzero(mine & other) > 0.96 * (np.count_nonzero(mine) + np.count_nonzero(other)), key


def test_seeds_are_obeyed(phantom: Case) -> None:
    grid = phantom.volume.grid
    inside = np.argwhere(phantom.truth.mask("left_atrium"))
    middle = inside[len(inside) // 2][::-1]
    where = tuple(float(value) for value in grid.to_ct(middle))
    seeds = [Seed("right_atrium", (where[0], where[1], where[2]), 4.0)]
    labels = segment(phantom.volume, seeds=seeds).labels.labels
    i, j, k = middle
    # Against all evidence, for the test: the ball about the seed is what the person says.
    assert (labels[k - 1 : k + 2, j - 1 : j + 2, i - 1 : i + 2] == CATALOGUE["right_atrium"].label).all()


def test_a_seed_in_a_vessel_takes_the_whole_piece(phantom: Case) -> None:
    vein, artery = phantom.truth.mask("superior_vena_cava"), phantom.found.labels.mask("pulmonary_artery")
    cava = phantom.found.labels.mask("superior_vena_cava")
    seeds = [
        Seed("aorta", _upper(phantom, cava & vein)),
        Seed("none", _upper(phantom, phantom.found.labels.mask("aorta") & phantom.truth.mask("aorta"))),
    ]
    labels = segment(phantom.volume, seeds=seeds).labels
    # The vein bears the name that was given; what joins it to the atrium, one or two voxels thick, may keep its own.
    assert np.count_nonzero(labels.mask("aorta") & cava) > 0.8 * np.count_nonzero(cava)
    # The true aorta, up to where it leaves the ventricle, is gone, and nothing else is.
    assert np.count_nonzero(labels.mask("aorta") & ~cava) < 0.25 * np.count_nonzero(phantom.found.labels.mask("aorta"))
    assert np.count_nonzero(labels.mask("pulmonary_artery") & artery) > 0.95 * np.count_nonzero(artery)
    for key in CHAMBERS:
        assert agreement(labels, phantom.truth, key).dice > 0.93


def _upper(phantom: Case, mask: npt.NDArray[np.bool_]) -> tuple[float, float, float]:
    """Return a place in the middle of the mask's upper part."""
    points = phantom.volume.grid.to_ct(np.argwhere(mask)[:, ::-1])
    height = np.quantile(points[:, 2], 0.8)
    x, y, z = points[np.abs(points[:, 2] - height) < 2.0].mean(axis=0)
    return float(x), float(y), float(z)


def test_a_seed_of_each_chamber_gives_what_none_gives(phantom: Case) -> None:
    seeds = []
    for key in CHAMBERS:
        x, y, z = phantom.volume.grid.to_ct(np.argwhere(phantom.truth.mask(key)).mean(axis=0)[::-1])
        seeds.append(Seed(key, (float(x), float(y), float(z))))
    found = segment(phantom.volume, seeds=seeds)
    for key in CHAMBERS:
        assert agreement(found.labels, phantom.truth, key).dice > 0.93


def test_a_seed_outside_the_scan_is_named(phantom: Case) -> None:
    with pytest.raises(DataError, match=r"seed of aorta.*outside the scan"):
        segment(phantom.volume, seeds=[Seed("aorta", (9000.0, 0.0, 0.0))])


def test_a_scan_without_contrast_is_one_sentence(phantom: Case) -> None:
    rng = np.random.default_rng(4)
    plain = np.minimum(phantom.volume.hu, 60 + rng.normal(0.0, 15.0, phantom.volume.hu.shape)).astype(np.int16)
    with pytest.raises(DataError, match="no contrast-filled heart"):
        segment(replace(phantom.volume, hu=plain))


@pytest.mark.parametrize(
    ("value", "says"), [(0, "no contrast-filled heart"), (-1000, "no soft tissue"), (3071, "no soft tissue")]
)
def test_a_volume_of_one_value_is_one_sentence(value: int, says: str) -> None:
    """Water, air, and nothing but metal."""
    grid = Grid((60, 60, 60), np.diag([1.5, 1.5, 1.5, 1.0]))
    with pytest.raises(DataError, match=says):
        segment(Volume(np.full(grid.shape, value, np.int16), grid, Technical("CT")))


def test_what_is_no_heart_is_not_given_chambers() -> None:
    """A bright ball: bone cement, a full stomach."""
    grid = Grid((60, 60, 60), np.diag([2.0, 2.0, 2.0, 1.0]))
    ball = ((np.indices(grid.shape) - 30.0) ** 2).sum(axis=0) < 15.0**2
    found = segment(Volume(np.where(ball, 400, 40).astype(np.int16), grid, Technical("CT")))
    assert not set(CHAMBERS) & set(found.labels.names.values())
    assert any("could not be told apart" in each for each in found.findings)


def test_a_slab_is_too_small(phantom: Case) -> None:
    volume = phantom.volume
    thin = np.ascontiguousarray(volume.hu[:10])
    with pytest.raises(DataError, match="too small to hold a heart"):
        segment(Volume(thin, replace(volume.grid, shape=thin.shape), volume.technical))


def test_progress_rises_and_may_stop_the_work(phantom: Case) -> None:
    shares: list[float] = []

    def stop(_what: str, share: float | None) -> None:
        shares.append(share or 0.0)
        if len(shares) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        segment(phantom.volume, progress=stop)
    assert shares == sorted(shares)
