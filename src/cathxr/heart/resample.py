"""Samples of a volume, smoothed by a Gaussian, at the voxels of another grid with the same axes: three matrices."""

from dataclasses import dataclass

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
    """Takes a volume on one grid (K, J, I) to smoothed samples on another with the same axes. weights: one per axis."""

    weights: tuple[Float32, Float32, Float32]

    def __call__(self, values: npt.NDArray[np.generic]) -> Float32:
        """Return the samples (K', J', I') of values (K, J, I); beyond the source its outermost voxels go on."""
        out = values.astype(np.float32)
        along_k, along_j, along_i = self.weights
        out = (out.reshape(-1, out.shape[2]) @ along_i.T).reshape(out.shape[0], out.shape[1], -1)
        out = np.matmul(along_j, out)
        flat = along_k @ out.reshape(out.shape[0], -1)
        return np.ascontiguousarray(flat.reshape(-1, out.shape[1], out.shape[2]), dtype=np.float32)


def sampler(source: Grid, target: Grid, *, sigma_mm: float) -> Sampler:
    """Return the sampler from `source` to `target` with a Gaussian of `sigma_mm` standard deviation.

    Raises:
        ValueError: the two grids' axes are not the same.
    """
    one = source.ct_from_voxel[:3, :3] / source.spacing_mm
    other = target.ct_from_voxel[:3, :3] / target.spacing_mm
    if not np.allclose(one, other, atol=1e-4):
        raise ValueError("sampler: expected two grids with the same axes")
    origin = source.to_voxel(target.to_ct([0.0, 0.0, 0.0]))
    weights = []
    for axis in range(3):
        column = 2 - axis
        step = target.spacing_mm[column] / source.spacing_mm[column]
        at = origin[column] + step * np.arange(target.shape[axis])
        sigma = max(sigma_mm / source.spacing_mm[column], _LEAST_SIGMA)
        weights.append(_weights(at, source.shape[axis], sigma))
    return Sampler((weights[0], weights[1], weights[2]))


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
