"""The curves' hot loops, compiled: even sampling, and the frame at the tip. `curves.py` says what they mean."""

import math

from numba import njit

from cathxr.core import FloatArray

GOOD, COINCIDE, TURNS_BACK, PARALLEL = 0, 1, 2, 3
_SMALL = 1e-8


@njit(cache=True, nogil=True)
def resample(points: FloatArray, result: FloatArray) -> float:
    """Fill `result` (K, D) with points uniform in arc length along a polyline (N, D); return its length.

    The first and last are exact. A length of 0 leaves the rest undefined.
    """
    total = 0.0
    for i in range(len(points) - 1):
        total += _apart(points, i)
    count, last = len(result), len(points) - 1
    result[0] = points[0]
    result[count - 1] = points[last]
    if not total > 0.0:
        return total
    j = 0
    begun, step = 0.0, _apart(points, 0)
    for i in range(1, count - 1):
        wanted = total * i / (count - 1)
        while j < last - 1 and begun + step < wanted:
            begun += step
            j += 1
            step = _apart(points, j)
        share = min((wanted - begun) / step, 1.0) if step > 0.0 else 0.0
        for axis in range(points.shape[1]):
            result[i, axis] = points[j, axis] + share * (points[j + 1, axis] - points[j, axis])
    return total


@njit(cache=True, nogil=True)
def tip_frame(shape, zero, roll_rad, frame):  # type: ignore[no-untyped-def]
    """Fill `frame` (3, 3) with box_from_tip's rotation for a centreline (N, 3), tip first; return GOOD or why not.

    The frame at the entry, x along `zero` (3,) made normal to the tangent, is carried to the tip by double reflection
    (see `curves.transported`) and turned by roll_rad about the tangent there.
    """
    last = len(shape) - 1
    code, ax, ay, az = _tangent(shape, last)
    if code != GOOD:
        return code
    along = zero[0] * ax + zero[1] * ay + zero[2] * az
    nx, ny, nz = zero[0] - along * ax, zero[1] - along * ay, zero[2] - along * az
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length < _SMALL:
        return PARALLEL
    nx, ny, nz = nx / length, ny / length, nz / length
    for i in range(last, 0, -1):
        code, bx, by, bz = _tangent(shape, i - 1)
        if code != GOOD:
            return code
        cx, cy, cz = shape[i - 1, 0] - shape[i, 0], shape[i - 1, 1] - shape[i, 1], shape[i - 1, 2] - shape[i, 2]
        twice = 2.0 / (cx * cx + cy * cy + cz * cz)
        of_n, of_a = twice * (cx * nx + cy * ny + cz * nz), twice * (cx * ax + cy * ay + cz * az)
        nx, ny, nz = nx - of_n * cx, ny - of_n * cy, nz - of_n * cz
        sx, sy, sz = bx - ax + of_a * cx, by - ay + of_a * cy, bz - az + of_a * cz
        squared = sx * sx + sy * sy + sz * sz
        if squared > 0.0:
            of_n = 2.0 / squared * (sx * nx + sy * ny + sz * nz)
            nx, ny, nz = nx - of_n * sx, ny - of_n * sy, nz - of_n * sz
        ax, ay, az = bx, by, bz
    along = nx * ax + ny * ay + nz * az
    nx, ny, nz = nx - along * ax, ny - along * ay, nz - along * az
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length < _SMALL:
        return PARALLEL
    nx, ny, nz = nx / length, ny / length, nz / length
    c, s = math.cos(roll_rad), math.sin(roll_rad)
    for row, (x, y, z) in enumerate(
        ((nx, ay * nz - az * ny, ax), (ny, az * nx - ax * nz, ay), (nz, ax * ny - ay * nx, az))
    ):
        frame[row, 0] = c * x + s * y
        frame[row, 1] = c * y - s * x
        frame[row, 2] = z
    return GOOD


@njit(cache=True, nogil=True)
def _apart(points, i):  # type: ignore[no-untyped-def]
    """Return the distance of point i from the one after it."""
    total = 0.0
    for axis in range(points.shape[1]):
        total += (points[i + 1, axis] - points[i, axis]) ** 2
    return math.sqrt(total)


@njit(cache=True, nogil=True)
def _tangent(shape, i):  # type: ignore[no-untyped-def]
    """Return (code, x, y, z): the unit tangent towards the first point at point i: of the parabola through neighbours.

    At either end it is twice the first chord less the tangent beside it: `curves.tangents`.
    """
    count = len(shape)
    if count == 2:
        step = _apart(shape, 0)
        if not step > 0.0:
            return COINCIDE, 0.0, 0.0, 0.0
        x, y, z = shape[0, 0] - shape[1, 0], shape[0, 1] - shape[1, 1], shape[0, 2] - shape[1, 2]
        return GOOD, x / step, y / step, z / step
    middle = min(max(i, 1), count - 2)
    before, after = _apart(shape, middle), _apart(shape, middle - 1)
    if not (before > 0.0 and after > 0.0):
        return COINCIDE, 0.0, 0.0, 0.0
    bx, by, bz = _chord(shape, middle, before)
    cx, cy, cz = _chord(shape, middle - 1, after)
    share = after / (before + after)
    x, y, z = share * bx + (1.0 - share) * cx, share * by + (1.0 - share) * cy, share * bz + (1.0 - share) * cz
    if i == 0:
        x, y, z = 2.0 * cx - x, 2.0 * cy - y, 2.0 * cz - z
    elif i == count - 1:
        x, y, z = 2.0 * bx - x, 2.0 * by - y, 2.0 * bz - z
    length = math.sqrt(x * x + y * y + z * z)
    if not length > 0.0:
        return TURNS_BACK, 0.0, 0.0, 0.0
    return GOOD, x / length, y / length, z / length


@njit(cache=True, nogil=True)
def _chord(shape, i, length):  # type: ignore[no-untyped-def]
    """Return the unit chord from point i + 1 to point i."""
    return (
        (shape[i, 0] - shape[i + 1, 0]) / length,
        (shape[i, 1] - shape[i + 1, 1]) / length,
        (shape[i, 2] - shape[i + 1, 2]) / length,
    )


@njit(cache=True, nogil=True)
def quaternion_of(rotation: FloatArray, result: FloatArray) -> None:
    """Fill `result` (4,) with the unit quaternion w-x-y-z, w >= 0, of a rotation (3, 3); as `Pose.from_matrix`."""
    trace = rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    best, most = 0, trace
    for i in range(3):
        if rotation[i, i] > most:
            best, most = i + 1, rotation[i, i]
    if best == 0:
        result[0] = 1.0 + trace
        result[1] = rotation[2, 1] - rotation[1, 2]
        result[2] = rotation[0, 2] - rotation[2, 0]
        result[3] = rotation[1, 0] - rotation[0, 1]
    else:
        i = best - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        result[0] = rotation[k, j] - rotation[j, k]
        result[1 + i] = 1.0 + 2.0 * rotation[i, i] - trace
        result[1 + j] = rotation[j, i] + rotation[i, j]
        result[1 + k] = rotation[k, i] + rotation[i, k]
    length = math.sqrt(result[0] ** 2 + result[1] ** 2 + result[2] ** 2 + result[3] ** 2)
    if result[0] < 0.0:
        length = -length
    for i in range(4):
        result[i] /= length


@njit(cache=True, nogil=True)
def carry_on(last, before, ahead, farthest_mm, result):  # type: ignore[no-untyped-def]
    """Fill `result` with the curve `last` (K, 3) moved on by `ahead` times its way from `before`, within limits."""
    most = 0.0
    for i in range(len(last)):
        squared = 0.0
        for axis in range(3):
            squared += (last[i, axis] - before[i, axis]) ** 2
        most = max(most, squared)
    limit = ahead * min(1.0, farthest_mm / max(ahead * math.sqrt(most), 1e-9))
    for i in range(len(last)):
        for axis in range(3):
            result[i, axis] = last[i, axis] + limit * (last[i, axis] - before[i, axis])
