"""The cut of least area through a body of voxels, drawn to where it is likely to belong."""

import numpy as np
import numpy.typing as npt
from numba import njit

_ROUNDS = 250
_STEP = 0.28
"""Below one over the square root of twelve: the largest steps that converge in three dimensions."""

Float32 = npt.NDArray[np.float32]
Int32 = npt.NDArray[np.int32]


def least_cut(
    mask: npt.NDArray[np.bool_], against: Float32, spacing_mm: float, *, dear: Float32 | None = None
) -> npt.NDArray[np.bool_]:
    """Return the part (K, J, I) of the mask for which the cut's area plus the sum of `against` over the part is least.

    against (K, J, I): per mm, negative where a voxel belongs to the part. Where mask ends nothing is cut.
    dear (K, J, I): the cost of cutting beside a voxel, 1 if not given; along walls it is less.
    The relaxed problem's minimum, thresholded, is the true one: T. Chan, S. Esedoglu, M. Nikolova, "Algorithms for
    finding global minimizers of image segmentation and denoising models", SIAM J. Appl. Math. 66 (2006); solved by
    A. Chambolle, T. Pock, "A first-order primal-dual algorithm for convex problems", J. Math. Imaging Vis. 40 (2011).
    """
    number = np.full(mask.shape, -1, np.int32)
    count = int(mask.sum())
    number[mask] = np.arange(count, dtype=np.int32)
    after = np.full((count, 3), -1, np.int32)
    before = np.full((count, 3), -1, np.int32)
    for axis in range(3):
        low = tuple(slice(None, -1) if each == axis else slice(None) for each in range(3))
        high = tuple(slice(1, None) if each == axis else slice(None) for each in range(3))
        both = mask[low] & mask[high]
        one, other = number[low][both], number[high][both]
        after[one, axis] = other
        before[other, axis] = one
    cost = (against[mask] * spacing_mm).astype(np.float32)
    limit = np.ones(count, np.float32) if dear is None else dear[mask].astype(np.float32)
    part = np.zeros(mask.shape, bool)
    part[mask] = _minimised(after, before, cost, limit, _ROUNDS) > 0.5
    return part


@njit(cache=True, nogil=True)
def _minimised(after: Int32, before: Int32, cost: Float32, limit: Float32, rounds: int) -> Float32:
    """Return each voxel's share (N,) of the part, 0 to 1."""
    count = len(cost)
    share = np.empty(count, np.float32)
    for n in range(count):
        share[n] = 1.0 if cost[n] < 0.0 else 0.0
    ahead = share.copy()
    flow = np.zeros((count, 3), np.float32)
    for _ in range(rounds):
        for n in range(count):
            square = np.float32(0.0)
            for axis in range(3):
                other = after[n, axis]
                if other >= 0:
                    flow[n, axis] += np.float32(_STEP) * (ahead[other] - ahead[n])
                    square += flow[n, axis] * flow[n, axis]
            if square > limit[n] * limit[n]:
                scale = limit[n] / np.sqrt(square)
                for axis in range(3):
                    flow[n, axis] *= scale
        for n in range(count):
            gain = -cost[n]
            for axis in range(3):
                gain += flow[n, axis]
                other = before[n, axis]
                if other >= 0:
                    gain -= flow[other, axis]
            old = share[n]
            new = min(max(old + np.float32(_STEP) * gain, np.float32(0.0)), np.float32(1.0))
            share[n] = new
            ahead[n] = new + new - old
    return share
