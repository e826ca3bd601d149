"""Hot loops of finding coloured spots: growing regions from peaks of chroma, and the rims of round things."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cathxr.core import FloatArray

Float32 = NDArray[np.float32]
REGION_FIELDS = 9
"""peak, area, mean x, mean y, variances xx, xy, yy, chroma a, chroma b."""
_MOST_REGIONS = 400
_HOLD = 4.0
_TRIALS = 64
"""How much an expected size weighs, relative to all of the rim."""


@njit(cache=True, nogil=True)
def chroma_of(picture: NDArray[np.uint8], mix: FloatArray) -> tuple[Float32, Float32]:
    """Return (strength (H, W), plane (H, W, 2)): each pixel of picture (H, W, 3) through mix (2, 3), and its length."""
    height, width = picture.shape[:2]
    strength = np.empty((height, width), dtype=np.float32)
    plane = np.empty((height, width, 2), dtype=np.float32)
    m = mix.astype(np.float32)
    for y in range(height):
        for x in range(width):
            b, g, r = np.float32(picture[y, x, 0]), np.float32(picture[y, x, 1]), np.float32(picture[y, x, 2])
            first = m[0, 0] * b + m[0, 1] * g + m[0, 2] * r
            second = m[1, 0] * b + m[1, 1] * g + m[1, 2] * r
            plane[y, x, 0], plane[y, x, 1] = first, second
            strength[y, x] = np.sqrt(first * first + second * second)
    return strength, plane


@njit(cache=True, nogil=True)
def peaks(strength: Float32, block: int, floor: float) -> NDArray[np.int64]:
    """Return (K, 2) x and y of the greatest strength in each block of pixels that reaches `floor`."""
    height, width = strength.shape
    found = np.empty(((height // block + 1) * (width // block + 1), 2), dtype=np.int64)
    count = 0
    for top in range(0, height, block):
        for left in range(0, width, block):
            best, bx, by = floor, -1, -1
            for y in range(top, min(top + block, height)):
                for x in range(left, min(left + block, width)):
                    if strength[y, x] >= best:
                        best, bx, by = strength[y, x], x, y
            if bx >= 0:
                found[count, 0], found[count, 1] = bx, by
                count += 1
    return found[:count]


@njit(cache=True, nogil=True)
def _flood(strength, plane, stamp, own, x0, y0, level, cosine, stack):  # type: ignore[no-untyped-def]
    """Return how many pixels, listed in `stack`, hang together with (x0, y0), reach `level` and have its hue."""
    height, width = strength.shape
    ha, hb = plane[y0, x0, 0] / strength[y0, x0], plane[y0, x0, 1] / strength[y0, x0]
    stamp[y0, x0] = own
    stack[0] = y0 * width + x0
    count, done = 1, 0
    while done < count:
        y, x = stack[done] // width, stack[done] % width
        done += 1
        for k in range(4):
            nx = x + (k == 0) - (k == 1)
            ny = y + (k == 2) - (k == 3)
            if nx < 0 or ny < 0 or nx >= width or ny >= height or stamp[ny, nx] == own:
                continue
            value = strength[ny, nx]
            if value < level or plane[ny, nx, 0] * ha + plane[ny, nx, 1] * hb < cosine * value:
                continue
            if count == stack.size:
                return -1
            stamp[ny, nx] = own
            stack[count] = ny * width + nx
            count += 1
    return count


@njit(cache=True, nogil=True)
def regions(
    strength: Float32, plane: Float32, seeds: NDArray[np.int64], shares: FloatArray, cosine: float, most_area: int
) -> FloatArray:
    """Return (R, REGION_FIELDS): around each seed, strongest first, what hangs together above a share of its strength.

    strength (H, W) and plane (H, W, 2): chroma and its two parts. A region that grows over `most_area` is tried again
    with the next share, then given up. Seeds inside an earlier region are skipped.
    """
    height, width = strength.shape
    taken = np.zeros((height, width), dtype=np.uint8)
    stamp = np.zeros((height, width), dtype=np.int32)
    stack = np.empty(most_area, dtype=np.int64)
    result = np.empty((min(len(seeds), _MOST_REGIONS), REGION_FIELDS))
    found, own = 0, 0
    for i in range(len(seeds)):
        x0, y0 = seeds[i, 0], seeds[i, 1]
        if found == len(result):
            break
        if taken[y0, x0]:
            continue
        count = -1
        for j in range(len(shares)):
            own += 1
            count = _flood(strength, plane, stamp, own, x0, y0, shares[j] * strength[y0, x0], cosine, stack)
            if count >= 0:
                break
        for j in range(count if count >= 0 else stack.size):
            taken[stack[j] // width, stack[j] % width] = 1
        if count < 4:
            continue
        _sum_up(stack, count, plane, width, result[found])
        result[found, 0] = strength[y0, x0]
        found += 1
    return result[:found]


@njit(cache=True, nogil=True)
def _sum_up(stack, count, plane, width, out):  # type: ignore[no-untyped-def]
    """Fill in what is known of the `count` pixels of a region."""
    out[:] = 0.0
    out[1] = count
    for j in range(count):
        y, x = stack[j] // width, stack[j] % width
        out[2] += x / count
        out[3] += y / count
        out[7] += plane[y, x, 0] / count
        out[8] += plane[y, x, 1] / count
    for j in range(count):
        dy, dx = stack[j] // width - out[3], stack[j] % width - out[2]
        out[4] += dx * dx / count
        out[5] += dx * dy / count
        out[6] += dy * dy / count


@njit(cache=True, nogil=True)
def _sample(picture, x, y, direction):  # type: ignore[no-untyped-def]
    """Return a picture (H, W, 3) along a colour direction (3,) at (x, y), bilinear."""
    column, row = int(x), int(y)
    fx, fy = x - column, y - row
    value = 0.0
    for c in range(3):
        upper = picture[row, column, c] * (1.0 - fx) + picture[row, column + 1, c] * fx
        lower = picture[row + 1, column, c] * (1.0 - fx) + picture[row + 1, column + 1, c] * fx
        value += direction[c] * (upper * (1.0 - fy) + lower * fy)
    return value


@njit(cache=True, nogil=True)
def rim(picture, direction, x, y, radii, reach, step, out):  # type: ignore[no-untyped-def]
    """Fill out (N, 4): x, y of the rim on each of N rays from (x, y), fall there (DN per px), total fall; fall 0: none.

    picture (H, W, 3) uint8; direction (3,): the colour's own direction across grey. radii (N,): where the rim is looked
    for on each ray, px, to within `reach`.
    """
    height, width = picture.shape[:2]
    count = len(out)
    samples = int(2.0 * reach / step) + 1
    profile = np.empty(samples)
    for i in range(count):
        angle = 2.0 * math.pi * i / count
        dx, dy = math.cos(angle), math.sin(angle)
        out[i, :] = 0.0
        start = max(radii[i] - reach, 0.5)
        last = start + (samples - 1) * step
        ends_x, ends_y = x + last * dx, y + last * dy
        if not (1.0 <= ends_x < width - 2.0 and 1.0 <= ends_y < height - 2.0):
            continue
        if not (1.0 <= x < width - 2.0 and 1.0 <= y < height - 2.0):
            continue
        for j in range(samples):
            t = start + j * step
            profile[j] = _sample(picture, x + t * dx, y + t * dy, direction)
        at, fall, drop = _edge(profile, step)
        if at < 0.0:
            continue
        t = start + at
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = x + t * dx, y + t * dy, fall, drop


@njit(cache=True, nogil=True)
def _edge(profile, step):  # type: ignore[no-untyped-def]
    """Return where along a profile it falls most steeply, how steeply per px, and how far in all; (-1, 0, 0): nowhere.

    The steepest fall over about 2 px is found first; then the middle of the fall around it, by its first moment.
    """
    n = len(profile)
    half = max(1, int(1.0 / step + 0.5))
    best, where = 0.0, -1
    for j in range(half, n - half):
        fall = profile[j - half] - profile[j + half]
        if fall > best:
            best, where = fall, j
    if where < 0:
        return -1.0, 0.0, 0.0
    middle = where + 0.0
    top, bottom = profile[where - half], profile[where + half]
    for _ in range(3):  # the window follows the edge, so that it does not pull it towards a sample
        weight, moment = 0.0, 0.0
        for j in range(max(int(middle) - 3 * half, 0), min(int(middle) + 3 * half + 1, n - 1)):
            fall = profile[j] - profile[j + 1]
            near = 1.0 - abs((j + 0.5 - middle) / (3.0 * half))
            if fall > 0.0 and near > 0.0:
                weight += fall * near
                moment += fall * near * (j + 0.5)
            top, bottom = max(top, profile[j]), min(bottom, profile[j + 1])
        if weight <= 0.0:
            return -1.0, 0.0, 0.0
        middle = moment / weight
    return middle * step, best / (2.0 * half * step), top - bottom


@njit(cache=True, nogil=True)
def _solve3(rows, target, weight, out):  # type: ignore[no-untyped-def]
    """Fill out (3,) with the weighted least-squares solution of rows (N, 3) @ out = target, and return its normals."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for i in range(len(rows)):
        w = weight[i]
        if w > 0.0:
            for j in range(3):
                right[j] += w * rows[i, j] * target[i]
                for k in range(3):
                    normal[j, k] += w * rows[i, j] * rows[i, k]
    if abs(np.linalg.det(normal)) < 1e-300:
        return normal, False
    out[:] = np.linalg.solve(normal, right)
    return normal, True


@njit(cache=True, nogil=True)
def _residuals(rows, target, solution, is_cone, scale, out):  # type: ignore[no-untyped-def]
    """Fill out (N,) with distances from the rim in units of 1 / scale, and return the slope that made them so."""
    if is_cone:  # rows: unit rays u, target 1; solution n = axis / cos(half angle)
        length = math.sqrt(solution[0] ** 2 + solution[1] ** 2 + solution[2] ** 2)
        slope = scale / math.sqrt(max(length * length - 1.0, 1e-12))
    else:  # rows: (2 x, 2 y, 1), target x^2 + y^2; solution: centre, r^2 - centre^2
        radius2 = solution[2] + solution[0] ** 2 + solution[1] ** 2
        slope = scale / (2.0 * math.sqrt(max(radius2, 1e-12)))
    for i in range(len(rows)):
        value = rows[i, 0] * solution[0] + rows[i, 1] * solution[1] + rows[i, 2] * solution[2] - target[i]
        out[i] = value * slope
    return slope


@njit(cache=True, nogil=True)
def robust_circle(rows, target, weight, is_cone, scale, gate, expected):  # type: ignore[no-untyped-def]
    """Return (solution (3,), residuals (N,) px, inlier weights (N,), normal matrix (3, 3) in 1/px^2) of a rim.

    A consensus of points three at a time, then re-weighted least squares (Tukey's biweight). gate: px. expected (2,):
    length of a cone's solution that is expected and how far off it may be; (0, 0): anything. All weights 0: no rim.
    """
    n = len(rows)
    solution, best = np.zeros(3), np.zeros(3)
    residual, use = np.empty(n), np.zeros(n)
    third, most = n // 3, 0.0
    three, ones, trial = np.empty((3, 3)), np.ones(3), np.empty(3)
    for i in range(_TRIALS):
        first = (i * n * 2 // _TRIALS) % n
        second = (first + (third if i % 2 else n // 5)) % n
        last = (second + (third if i % 2 else n // 4)) % n
        if weight[first] <= 0.0 or weight[second] <= 0.0 or weight[last] <= 0.0:
            continue
        three[0], three[1], three[2] = rows[first], rows[second], rows[last]
        trial[0], trial[1], trial[2] = target[first], target[second], target[last]
        _, good = _solve3(three, trial, ones, solution)
        if not good:
            continue
        if expected[1] > 0.0 and abs(math.sqrt(solution @ solution) - expected[0]) > expected[1]:
            continue
        _residuals(rows, target, solution, is_cone, scale, residual)
        agree = 0.0
        for j in range(n):
            if weight[j] > 0.0 and abs(residual[j]) < gate:
                agree += 1.0 - (residual[j] / gate) ** 2
        if agree > most:
            most = agree
            best[:] = solution
    normal = np.zeros((3, 3))
    if most < 6.0:
        return best, residual, use, normal
    solution[:] = best
    width = gate
    more, aims, weights = np.empty((n + 1, 3)), np.empty(n + 1), np.empty(n + 1)
    for _ in range(8):
        slope = _residuals(rows, target, solution, is_cone, scale, residual)
        total, squares = 0.0, 0.0
        for j in range(n):
            ratio = residual[j] / width
            use[j] = (1.0 - ratio * ratio) ** 2 * weight[j] if abs(ratio) < 1.0 and weight[j] > 0.0 else 0.0
            total += use[j]
            squares += use[j] * residual[j] ** 2
        if total <= 0.0:
            return best, residual, use, normal
        if expected[1] > 0.0:
            more[:n], aims[:n], weights[:n] = rows, target, use
            more[n] = solution / math.sqrt(solution @ solution)
            aims[n], weights[n] = expected[0], _HOLD * n
            normal, good = _solve3(more, aims, weights, solution)
        else:
            normal, good = _solve3(rows, target, use, solution)
        if not good:
            use[:] = 0.0
            return best, residual, use, normal
        width = min(gate, max(5.0 * math.sqrt(squares / total), 0.25))
    slope = _residuals(rows, target, solution, is_cone, scale, residual)
    return solution, residual, use, normal * slope * slope
