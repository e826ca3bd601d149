"""Where two edges cross, to a few thousandths of a pixel: a model of the picture around a corner, fitted. Compiled.

The model is what a lens makes of two crossing edges between black and white: a + g . u + b erf(d1 / s1) erf(d2 / s2), d
the distance from each edge, s the edge's blur. It looks the same turned by half a turn, and so does what a board's
corner shows (its marker's frames included), so that neither blur nor ink that spreads moves the corner. Raw pixels are
fitted, nothing is interpolated: interpolation is what limits the usual corner refinement to some hundredths of a pixel.
"""

import math

import numpy as np
from numba import njit

from cathxr.core import FloatArray, PixelArray

COUNT = 10
"""Parameters: corner x y, the edges' normals (angles), their blurs, level, its slope x y, contrast."""

_ROUNDS = 25
_ENOUGH_PX = 2e-4
_LEAST_BLUR, _MOST_BLUR = 0.25, 12.0


@njit(cache=True, nogil=True)
def _model(u, v, p, slopes):  # type: ignore[no-untyped-def]
    """Return the model at (u, v) and fill its derivatives by the ten parameters into `slopes`."""
    x, y = u - p[0], v - p[1]
    c1, s1, c2, s2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    q1, q2 = (x * c1 + y * s1) / p[4], (x * c2 + y * s2) / p[5]
    e1, e2 = math.erf(q1 * 0.7071067811865476), math.erf(q2 * 0.7071067811865476)
    g1 = 0.7978845608028654 * math.exp(-0.5 * q1 * q1) / p[4] * e2 * p[9]
    g2 = 0.7978845608028654 * math.exp(-0.5 * q2 * q2) / p[5] * e1 * p[9]
    slopes[0] = -(g1 * c1 + g2 * c2)
    slopes[1] = -(g1 * s1 + g2 * s2)
    slopes[2] = g1 * (y * c1 - x * s1)
    slopes[3] = g2 * (y * c2 - x * s2)
    slopes[4] = -g1 * q1
    slopes[5] = -g2 * q2
    slopes[6] = 1.0
    slopes[7] = x
    slopes[8] = y
    slopes[9] = e1 * e2
    return p[6] + p[7] * x + p[8] * y + p[9] * e1 * e2


@njit(cache=True, nogil=True)
def fit_corners(
    pixels: PixelArray,
    starts: FloatArray,
    lattices: FloatArray,
    reach: float,
    clear: float,
    most_px: float,
) -> tuple[FloatArray, FloatArray]:
    """Return corners' parameters (N, 10), and (N,) root mean square of what the model leaves, as a share of contrast.

    pixels (H, W) grey; starts (N, 2) px; lattices (N, 2, 2) px: rows are the steps along a board's row and column.
    reach: how far from the corner to look, in squares; clear: how far a white square is empty beside its edges, in
    squares; most_px: greatest distance from the corner. The share is infinite where no fit was possible.
    """
    count = len(starts)
    fitted = np.zeros((count, COUNT))
    left = np.full(count, np.inf)
    most = (2 * int(most_px) + 3) ** 2
    where = np.empty((most, 2))
    value = np.empty(most)
    for i in range(count):
        n = _gathered(pixels, starts[i], lattices[i], reach, clear, most_px, where, value)
        if n < 3 * COUNT:
            continue
        if _started(where, value, n, starts[i], lattices[i], fitted[i]):
            left[i] = _fitted(where, value, n, starts[i], fitted[i], 0.5 * most_px)
    return fitted, left


@njit(cache=True, nogil=True)
def _gathered(pixels, start, lattice, reach, clear, most_px, where, value):  # type: ignore[no-untyped-def]
    """Fill in the pixels around a corner that the model speaks of, and return how many."""
    height, width = pixels.shape
    determinant = lattice[0, 0] * lattice[1, 1] - lattice[0, 1] * lattice[1, 0]
    if abs(determinant) < 4.0:
        return 0
    span = int(most_px) + 1
    column, row = int(np.rint(start[0])), int(np.rint(start[1]))
    if column - span < 0 or row - span < 0 or column + span >= width or row + span >= height:
        return 0
    n = 0
    for v in range(row - span, row + span + 1):
        for u in range(column - span, column + span + 1):
            x, y = u - start[0], v - start[1]
            if x * x + y * y > most_px * most_px:
                continue
            s = abs((x * lattice[1, 1] - y * lattice[1, 0]) / determinant)
            t = abs((y * lattice[0, 0] - x * lattice[0, 1]) / determinant)
            if s > reach or t > reach or min(s, t) > clear:
                continue
            where[n, 0] = u
            where[n, 1] = v
            value[n] = pixels[v, u]
            n += 1
    return n


@njit(cache=True, nogil=True)
def _started(where, value, n, start, lattice, p):  # type: ignore[no-untyped-def]
    """Fill in where the fit begins, and return whether there is contrast to fit."""
    p[0], p[1] = start[0], start[1]
    # The edge along a row has its normal across it, and the other way round.
    p[2] = math.atan2(lattice[1, 0], -lattice[1, 1])
    p[3] = math.atan2(-lattice[0, 0], lattice[0, 1])
    p[4] = p[5] = 1.0
    slopes = np.zeros(COUNT)
    p[9] = 1.0
    total_e = total_v = total_ee = total_ev = 0.0
    for k in range(n):
        _model(where[k, 0], where[k, 1], p, slopes)
        total_e += slopes[9]
        total_v += value[k]
        total_ee += slopes[9] * slopes[9]
        total_ev += slopes[9] * value[k]
    spread = total_ee - total_e * total_e / n
    if spread <= 1e-9:
        return False
    p[9] = (total_ev - total_e * total_v / n) / spread
    p[6] = (total_v - p[9] * total_e) / n
    return abs(p[9]) >= 2.0


@njit(cache=True, nogil=True)
def _fitted(where, value, n, start, p, furthest):  # type: ignore[no-untyped-def]
    """Fit by Levenberg and Marquardt's method; return what the model leaves, infinite where it wandered off."""
    slopes, tried = np.zeros(COUNT), np.zeros(COUNT)
    normal, right = np.zeros((COUNT, COUNT)), np.zeros(COUNT)
    damping = 1e-3
    best = _squares(where, value, n, p, slopes)
    for _ in range(_ROUNDS):
        normal[:] = 0.0
        right[:] = 0.0
        for k in range(n):
            rest = value[k] - _model(where[k, 0], where[k, 1], p, slopes)
            for a in range(COUNT):
                right[a] += slopes[a] * rest
                for b in range(a + 1):
                    normal[a, b] += slopes[a] * slopes[b]
        for a in range(COUNT):
            for b in range(a):
                normal[b, a] = normal[a, b]
            normal[a, a] = normal[a, a] * (1.0 + damping) + 1e-9
        step = np.linalg.solve(normal, right)
        for a in range(COUNT):
            tried[a] = p[a] + step[a]
        tried[4] = min(max(abs(tried[4]), _LEAST_BLUR), _MOST_BLUR)
        tried[5] = min(max(abs(tried[5]), _LEAST_BLUR), _MOST_BLUR)
        squares = _squares(where, value, n, tried, slopes)
        if squares <= best:
            moved = max(abs(step[0]), abs(step[1]))
            for a in range(COUNT):
                p[a] = tried[a]
            best = squares
            damping = max(0.1 * damping, 1e-9)
            if moved < _ENOUGH_PX:
                break
        else:
            damping *= 10.0
            if damping > 1e8:
                break
    if math.hypot(p[0] - start[0], p[1] - start[1]) > furthest or abs(p[9]) < 2.0:
        return np.inf
    return math.sqrt(best / max(n - COUNT, 1)) / abs(p[9])


@njit(cache=True, nogil=True)
def _squares(where, value, n, p, slopes):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(n):
        rest = value[k] - _model(where[k, 0], where[k, 1], p, slopes)
        total += rest * rest
    return total
