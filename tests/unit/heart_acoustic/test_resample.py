"""Samples through blocks of voxels, against a Gaussian that is taken on every voxel."""

import numpy as np
import pytest
from scipy import ndimage

from cathxr.heart.resample import sampler
from cathxr.heart.volume import Grid

SOURCE = Grid((41, 60, 71), np.diag([0.5, 0.5, 0.5, 1.0]))


def target() -> Grid:
    matrix = np.diag([2.0, 2.0, 2.0, 1.0])
    matrix[:3, 3] = [1.0, 2.0, 0.7]
    return Grid((10, 14, 16), matrix)


def ball() -> np.ndarray:
    k, j, i = np.meshgrid(*(np.arange(n) for n in SOURCE.shape), indexing="ij")
    away = SOURCE.to_ct(np.stack([i, j, k], axis=-1)) - [17.0, 15.0, 10.0]
    return (np.linalg.norm(away, axis=-1) < 8.0).astype(np.float32)


@pytest.mark.parametrize(("sigma_mm", "block"), [(0.6, 1), (1.2, 2), (2.0, 4)])
def test_blocks_change_little(sigma_mm, block):
    values, grid = ball(), target()
    take = sampler(SOURCE, grid, sigma_mm=sigma_mm)
    assert take.blocks == (block, block, block)
    k, j, i = np.meshgrid(*(np.arange(n) for n in grid.shape), indexing="ij")
    at = SOURCE.to_voxel(grid.to_ct(np.stack([i, j, k], axis=-1)))[..., ::-1]
    smooth = ndimage.gaussian_filter(values, sigma_mm / 0.5, mode="nearest", truncate=5.0)
    expected = ndimage.map_coordinates(smooth, np.moveaxis(at, -1, 0), order=3, mode="nearest")
    # 0.02 of an edge of height 1 is a twentieth of its width: a tenth of a millimetre.
    assert np.abs(take(values) - expected).max() < 0.02


def test_a_constant_stays_one():
    take = sampler(SOURCE, target(), sigma_mm=1.7)
    assert take(np.full(SOURCE.shape, 3.0)) == pytest.approx(3.0, abs=1e-5)
