"""Distances of a path from an expert's: discrete Fréchet, Hausdorff, dynamic time warping."""

from collections.abc import Callable

import numpy as np
from numba import njit

from cathxr.core import FloatArray
from cathxr.geometry import resampled
from cathxr.training.metrics.measure import Measure, Run, none
from cathxr.training.metrics.motion import Motion

_Distance = Callable[[FloatArray, FloatArray], float]
POINTS = 400
_LEAST_MM = 1.0


def frechet_mm(first: FloatArray, second: FloatArray) -> float:
    """Return the discrete Fréchet distance of two paths (N, 3), (M, 3), mm.

    Eiter, Mannila: "Computing discrete Fréchet distance", TU Vienna CD-TR 94/64, 1994. The continuous one is smaller by
    at most the longest step.
    """
    from scipy.spatial.distance import cdist  # as in `motion.smoothed`

    return float(_frechet(cdist(first, second)))


def hausdorff_mm(first: FloatArray, second: FloatArray) -> float:
    """Return the Hausdorff distance of two sets of points (N, 3), (M, 3), mm: the greater of both directions."""
    from scipy.spatial.distance import directed_hausdorff

    return float(max(directed_hausdorff(first, second)[0], directed_hausdorff(second, first)[0]))


def dtw_mm(first: FloatArray, second: FloatArray) -> float:
    """Return the mean distance of the pairs that dynamic time warping makes of two paths (N, 3), (M, 3), mm.

    Sakoe, Chiba: "Dynamic programming algorithm optimization for spoken word recognition", IEEE Trans. ASSP 26(1),
    1978; steps (1, 0), (0, 1), (1, 1) of equal weight. Of pairings of equal cost, the one with the fewest pairs.
    """
    from scipy.spatial.distance import cdist

    cost, pairs = _dtw(cdist(first, second))
    return float(cost / pairs)


@njit(cache=True, nogil=True)
def _frechet(distance: FloatArray) -> float:  # pragma: no cover - compiled
    n, m = distance.shape
    best = np.empty((n, m))
    for i in range(n):
        for j in range(m):
            before = -np.inf if i == 0 and j == 0 else np.inf
            if i > 0:
                before = min(before, best[i - 1, j])
            if j > 0:
                before = min(before, best[i, j - 1])
            if i > 0 and j > 0:
                before = min(before, best[i - 1, j - 1])
            best[i, j] = max(before, distance[i, j])
    return float(best[n - 1, m - 1])


@njit(cache=True, nogil=True)
def _dtw(distance: FloatArray) -> tuple[float, int]:  # pragma: no cover - compiled
    n, m = distance.shape
    cost = np.empty((n, m))
    pairs = np.empty((n, m), np.int64)
    for i in range(n):
        for j in range(m):
            least, count = np.inf, 0
            if i == 0 and j == 0:
                least = 0.0
            if i > 0 and j > 0:
                least, count = cost[i - 1, j - 1], pairs[i - 1, j - 1]
            if i > 0 and (cost[i - 1, j] < least or (cost[i - 1, j] == least and pairs[i - 1, j] < count)):
                least, count = cost[i - 1, j], pairs[i - 1, j]
            if j > 0 and (cost[i, j - 1] < least or (cost[i, j - 1] == least and pairs[i, j - 1] < count)):
                least, count = cost[i, j - 1], pairs[i, j - 1]
            cost[i, j], pairs[i, j] = least + distance[i, j], count + 1
    return cost[n - 1, m - 1], pairs[n - 1, m - 1]


def path_points(motion: Motion) -> FloatArray:
    """Return the path (N, 3) mm as about 400 points, even along each segment; none lie where nothing was seen."""
    paths = [each.tip_box for each in motion.segments()]
    lengths = [float(np.linalg.norm(np.diff(each, axis=0), axis=1).sum()) for each in paths]
    whole = sum(lengths)
    if whole < _LEAST_MM:
        return np.empty((0, 3))
    parts = [
        resampled(path, max(2, round(POINTS * length / whole)))
        for path, length in zip(paths, lengths, strict=True)
        if length > 0.0
    ]
    return np.concatenate(parts)


def _to_expert(run: Run, function: _Distance) -> Measure:
    if run.expert_box is None:
        return none("no expert's path was given")
    if run.blind:
        return none(run.blind)
    points = path_points(run.smooth)
    if len(points) == 0 or len(run.expert_box) == 0:
        return none("a path of less than 1 mm has no shape to compare")
    return Measure(function(points, run.expert_box))


def frechet(run: Run) -> Measure:
    """Return the Fréchet distance to the expert's path, mm."""
    return _to_expert(run, frechet_mm)


def hausdorff(run: Run) -> Measure:
    """Return the Hausdorff distance to the expert's path, mm."""
    return _to_expert(run, hausdorff_mm)


def dtw(run: Run) -> Measure:
    """Return the mean distance of dynamic time warping to the expert's path, mm."""
    return _to_expert(run, dtw_mm)
