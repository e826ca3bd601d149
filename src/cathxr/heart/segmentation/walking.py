"""The equations of random walks on a graph of voxels, solved by conjugate gradients."""

import numpy as np
import numpy.typing as npt
from numba import njit

_TOLERANCE = 1e-3
_ROUNDS = 300

Float32 = npt.NDArray[np.float32]
Int32 = npt.NDArray[np.int32]


def graph_of(share: Float32, nodes: npt.NDArray[np.bool_], *, steepness: float, least: float) -> tuple[Int32, Float32]:
    """Return the neighbours (N, 6) of each node, -1 where there is none, and the conductances (N, 6) to them.

    share (K, J, I): the darker of two voxels' shares of blood, below one, keeps walkers apart.
    """
    number = np.full(nodes.shape, -1, np.int32)
    count = int(nodes.sum())
    number[nodes] = np.arange(count, dtype=np.int32)
    neighbours = np.full((count, 6), -1, np.int32)
    conductances = np.zeros((count, 6), np.float32)
    _link(np.clip(share, 0.0, 1.0).astype(np.float32), number, steepness, least, neighbours, conductances)
    return neighbours, conductances


def settled(
    neighbours: Int32, conductances: Float32, pull: npt.NDArray[np.float64], wanted: npt.NDArray[np.floating]
) -> Float32:
    """Return the probability (N,) that walkers end where `wanted` (N,) draws them, with the strength `pull` (N,)."""
    diagonal = (conductances.sum(axis=1, dtype=np.float64) + pull).astype(np.float32)
    start = np.ascontiguousarray(wanted, np.float32)
    right = (pull * wanted).astype(np.float32)
    if not right.any():
        return np.zeros_like(start)
    return _solved(neighbours, conductances, diagonal, right, start.copy(), _TOLERANCE, _ROUNDS)


@njit(cache=True, nogil=True)
def _link(
    share: Float32, number: Int32, steepness: float, least: float, neighbours: Int32, conductances: Float32
) -> None:
    """Write each node's neighbours and the conductances to them."""
    depth, rows, columns = share.shape
    for k in range(depth):
        for j in range(rows):
            for i in range(columns):
                at = number[k, j, i]
                if at < 0:
                    continue
                for axis in range(3):
                    dk, dj, di = int(axis == 0), int(axis == 1), int(axis == 2)
                    if k + dk >= depth or j + dj >= rows or i + di >= columns:
                        continue
                    other = number[k + dk, j + dj, i + di]
                    if other < 0:
                        continue
                    dip = 1.0 - min(share[k, j, i], share[k + dk, j + dj, i + di])
                    weight = np.exp(-steepness * dip * dip) + least
                    neighbours[at, 2 * axis] = other
                    neighbours[other, 2 * axis + 1] = at
                    conductances[at, 2 * axis] = weight
                    conductances[other, 2 * axis + 1] = weight


@njit(cache=True, nogil=True)
def _solved(
    neighbours: Int32,
    conductances: Float32,
    diagonal: Float32,
    right: Float32,
    found: Float32,
    tolerance: float,
    rounds: int,
) -> Float32:
    """Return the solution, from the first guess `found`: conjugate gradients, scaled by the diagonal."""
    count = len(right)
    residual = np.empty(count, np.float32)
    direction = np.empty(count, np.float32)
    product = np.empty(count, np.float32)
    size, slope = 0.0, 0.0
    for n in range(count):
        total = diagonal[n] * found[n]
        for side in range(6):
            if neighbours[n, side] >= 0:
                total -= conductances[n, side] * found[neighbours[n, side]]
        residual[n] = right[n] - total
        direction[n] = residual[n] / diagonal[n]
        slope += residual[n] * direction[n]
        size += right[n] * right[n]
    enough = tolerance * tolerance * size
    for _ in range(rounds):
        curvature, left = 0.0, 0.0
        for n in range(count):
            total = diagonal[n] * direction[n]
            for side in range(6):
                if neighbours[n, side] >= 0:
                    total -= conductances[n, side] * direction[neighbours[n, side]]
            product[n] = total
            curvature += direction[n] * total
        if curvature <= 0.0:
            break
        step = slope / curvature
        fresh = 0.0
        for n in range(count):
            found[n] += step * direction[n]
            residual[n] -= step * product[n]
            left += residual[n] * residual[n]
            fresh += residual[n] * residual[n] / diagonal[n]
        if left <= enough:
            break
        ratio = fresh / slope
        slope = fresh
        for n in range(count):
            direction[n] = residual[n] / diagonal[n] + ratio * direction[n]
    return found
