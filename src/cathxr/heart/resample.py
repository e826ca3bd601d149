"""Samples of a volume, smoothed by a Gaussian, at the voxels of another grid with the same axes: three matrices."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from cathxr.heart.volume import Grid

_REACH = 3.5
"""A Gaussian is cut off at this many standard deviations."""
_LEAST_SIGMA = 0.35
"""In voxels of the source: below it a sampled Gaussian is no Gaussian any more."""

Float32 = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Sampler:
    """Takes a volume on one grid (K, J, I) to smoothed samples on another with the same axes. weights: one per axis.

    blocks: of how many voxels along k, j and i the mean is taken first.
    """

    weights: tuple[Float32, Float32, Float32]
    blocks: tuple[int, int, int]

    def __call__(self, values: npt.NDArray[np.generic]) -> Float32:
        """Return the samples (K', J', I') of values (K, J, I); beyond the source its outermost voxels go on."""
        return self.of_slices(values)

    def of_slices(self, slices: Iterable[npt.NDArray[np.generic]]) -> Float32:
        """Return the samples (K', J', I') of the slices (J, I) of a volume, which are asked for one by one."""
        along_k, along_j, along_i = self.weights
        across = along_i.T.copy()
        flat = np.zeros((along_k.shape[1], along_j.shape[0], along_i.shape[0]), np.float32)
        count = 0
        for each in slices:
            flat[count // self.blocks[0]] += along_j @ (_block_means(each, self.blocks[1:]) @ across)
            count += 1
        flat /= np.float32(self.blocks[0])
        if rest := count % self.blocks[0]:
            flat[-1] *= np.float32(self.blocks[0] / rest)
        out = along_k @ flat.reshape(len(flat), -1)
        return np.ascontiguousarray(out.reshape(-1, along_j.shape[0], along_i.shape[0]), dtype=np.float32)


def sampler(source: Grid, target: Grid, *, sigma_mm: float) -> Sampler:
    """Return the sampler from `source` to `target` with a Gaussian of `sigma_mm` standard deviation.

    Where the source is much finer than the Gaussian, means of blocks of its voxels are taken first, and the Gaussian is
    as much narrower as these are wide.

    Raises:
        ValueError: the two grids' axes are not the same.
    """
    one = source.ct_from_voxel[:3, :3] / source.spacing_mm
    other = target.ct_from_voxel[:3, :3] / target.spacing_mm
    if not np.allclose(one, other, atol=1e-4):
        raise ValueError("sampler: expected two grids with the same axes")
    origin = source.to_voxel(target.to_ct([0.0, 0.0, 0.0]))
    weights, blocks = [], []
    for axis in range(3):
        column = 2 - axis
        spacing = float(source.spacing_mm[column])
        block = max(int(sigma_mm / spacing), 1)
        at = origin[column] + target.spacing_mm[column] / spacing * np.arange(target.shape[axis])
        sigma = max(float(np.sqrt((sigma_mm / spacing) ** 2 - (block**2 - 1) / 12.0)), _LEAST_SIGMA)
        count = -(-source.shape[axis] // block)
        weights.append(_weights((at - (block - 1) / 2.0) / block, count, sigma / block))
        blocks.append(block)
    return Sampler((weights[0], weights[1], weights[2]), (blocks[0], blocks[1], blocks[2]))


def _block_means(values: npt.NDArray[np.generic], blocks: tuple[int, ...]) -> Float32:
    """Return the means of blocks of a slice (J, I); its last row and column go on where a block is not whole."""
    plane: Float32 = np.ascontiguousarray(values, dtype=np.float32)
    if blocks == (1, 1):
        return plane
    rows, columns = (-(-size // block) for size, block in zip(plane.shape, blocks, strict=True))
    below, beside = rows * blocks[0] - plane.shape[0], columns * blocks[1] - plane.shape[1]
    if below or beside:
        plane = np.asarray(cv2.copyMakeBorder(plane, 0, below, 0, beside, cv2.BORDER_REPLICATE), np.float32)
    return np.asarray(cv2.resize(plane, (columns, rows), interpolation=cv2.INTER_AREA), np.float32)


def _weights(at: npt.NDArray[np.float64], count: int, sigma: float) -> Float32:
    """Return Gaussian weights (N, count) around the places `at`; what falls outside goes to the outermost voxel."""
    matrix = np.zeros((len(at), count))
    reach = int(np.ceil(_REACH * sigma))
    nearest = np.round(at).astype(np.int64)
    for offset in range(-reach, reach + 1):
        index = nearest + offset
        np.add.at(
            matrix, (np.arange(len(at)), np.clip(index, 0, count - 1)), np.exp(-0.5 * ((index - at) / sigma) ** 2)
        )
    matrix /= matrix.sum(axis=1, keepdims=True)
    return matrix.astype(np.float32)
