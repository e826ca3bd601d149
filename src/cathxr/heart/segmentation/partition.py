"""Random walks with priors: which group each voxel of the blood belongs to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, sparse
from scipy.sparse.linalg import cg

_STEEPNESS = 12.0
_LEAST_CONDUCTANCE = 1e-3
_PRIOR_WEIGHT = 0.02
_SEED_WEIGHT = 50.0
_FADING_MM = 2.5
_OTHER_MM = 10.0
_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Pinned:
    """Voxels (N,) as flat indices that belong to the group of this index (the last is: none)."""

    voxels: npt.NDArray[np.int64]
    group: int


def beliefs(distances: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return how likely each group, and last none of them, is (G + 1, N), from the distances (G, N) mm to each."""
    nearest = distances.min(axis=0)
    none = np.maximum(_OTHER_MM - nearest, 0.0)
    powers = -np.concatenate([np.maximum(distances, -_OTHER_MM), none[None]]) / _FADING_MM
    powers -= powers.max(axis=0)
    likely = np.exp(powers)
    return np.asarray(likely / likely.sum(axis=0), np.float32)


def walks(
    share: npt.NDArray[np.float32],
    nodes: npt.NDArray[np.bool_],
    prior: npt.NDArray[np.float32],
    pinned: Sequence[Pinned] = (),
) -> npt.NDArray[np.float32]:
    """Return the probability of each group (G + 1, N) at the N nodes.

    share (K, J, I): 0 tissue, 1 blood; what lies between two voxels that is darker than blood keeps walkers apart, so
    that borders follow walls and, where there are none, the narrowest place near where `prior` (G + 1, N) has them.
    L. Grady, "Multilabel random walker image segmentation using prior models", CVPR 2005.
    """
    number = np.full(nodes.shape, -1, np.int64)
    count = int(nodes.sum())
    number[nodes] = np.arange(count)
    rows, columns, weights = [], [], []
    for axis in range(3):
        low = tuple(slice(None, -1) if each == axis else slice(None) for each in range(3))
        high = tuple(slice(1, None) if each == axis else slice(None) for each in range(3))
        both = nodes[low] & nodes[high]
        dip = 1.0 - np.clip(np.minimum(share[low][both], share[high][both]), 0.0, 1.0)
        rows.append(number[low][both])
        columns.append(number[high][both])
        weights.append(np.exp(-_STEEPNESS * dip**2) + _LEAST_CONDUCTANCE)
    row, column, weight = (np.concatenate(each) for each in (rows, columns, weights))
    graph = sparse.coo_matrix((weight, (row, column)), shape=(count, count)).tocsr()
    graph = graph + graph.T
    pull = np.full(count, _PRIOR_WEIGHT)
    wanted = np.asarray(prior, float)
    for pin in pinned:
        at = number.ravel()[pin.voxels]
        at = at[at >= 0]
        pull[at] = _SEED_WEIGHT
        wanted[:, at] = 0.0
        wanted[pin.group, at] = 1.0
    diagonal = np.asarray(graph.sum(axis=1)).ravel() + pull
    system = (sparse.diags(diagonal) - graph).tocsr()
    inverse = sparse.diags(1.0 / diagonal)
    solved = np.empty_like(prior)
    for index in range(len(prior)):
        right = pull * wanted[index]
        if not right.any():
            solved[index] = 0.0
            continue
        result, _ = cg(system, right, x0=wanted[index], rtol=_TOLERANCE, maxiter=300, M=inverse)
        solved[index] = np.clip(result, 0.0, 1.0)
    return solved


def spread(values: npt.NDArray[np.float32], nodes: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
    """Return the nodes' values (G, N) on the whole grid (G, K, J, I), each other voxel taking its nearest node's."""
    index = ndimage.distance_transform_edt(~nodes, return_distances=False, return_indices=True)
    number = np.zeros(nodes.shape, np.int64)
    number[nodes] = np.arange(int(nodes.sum()))
    return np.asarray(values[:, number[tuple(index)]])
