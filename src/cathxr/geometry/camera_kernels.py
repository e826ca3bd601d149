"""The camera model's hot loop, compiled: projection with its derivative. `camera.py` holds the readable NumPy twin."""

import numpy as np
from numba import njit

from cathxr.core import FloatArray

_FOLD_SAMPLES = 64
"""The slope of the radial model is a cubic in r^2: what it does between this many samples is immaterial."""


@njit(cache=True, nogil=True)
def project_one(  # type: ignore[no-untyped-def]
    px, py, pz, rotation, translation, focal, centre, distortion
):
    """Return (u, v, derivatives of u by x y z, derivatives of v by x y z, depth) of one point of `box`.

    Where the depth is not positive the other results mean nothing.
    """
    first = (rotation[0, 0], rotation[0, 1], rotation[0, 2])
    second = (rotation[1, 0], rotation[1, 1], rotation[1, 2])
    third = (rotation[2, 0], rotation[2, 1], rotation[2, 2])
    cx = first[0] * px + first[1] * py + first[2] * pz + translation[0]
    cy = second[0] * px + second[1] * py + second[2] * pz + translation[1]
    cz = third[0] * px + third[1] * py + third[2] * pz + translation[2]
    lens = (distortion[0], distortion[1], distortion[2], distortion[3], distortion[4])
    return _seen(cx, cy, cz, first, second, third, focal[0], focal[1], centre[0], centre[1], lens)


@njit(cache=True, nogil=True)
def project_row(px, py, pz, row):  # type: ignore[no-untyped-def]
    """Return `project_one` of a camera's numbers (21,), see `packed`: views of parts of them would cost more time."""
    first, second, third = (row[0], row[1], row[2]), (row[3], row[4], row[5]), (row[6], row[7], row[8])
    cx = first[0] * px + first[1] * py + first[2] * pz + row[9]
    cy = second[0] * px + second[1] * py + second[2] * pz + row[10]
    cz = third[0] * px + third[1] * py + third[2] * pz + row[11]
    lens = (row[16], row[17], row[18], row[19], row[20])
    return _seen(cx, cy, cz, first, second, third, row[12], row[13], row[14], row[15], lens)


@njit(cache=True, nogil=True)
def _seen(cx, cy, cz, first, second, third, fx, fy, ux, uy, lens):  # type: ignore[no-untyped-def]
    """Return `project_one` of a point of the camera's frame; first, second, third: the rotation's rows."""
    if cz <= 0.0:
        return 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), cz
    k1, k2, p1, p2, k3 = lens
    near = 1.0 / cz
    x = cx * near
    y = cy * near
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3)
    u = fx * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + ux
    v = fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + uy
    cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    xx = fx * (radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x) * near
    yy = fy * (radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x) * near
    xy = fx * cross * near
    yx = fy * cross * near
    x0, y0 = first[0] - x * third[0], second[0] - y * third[0]
    x1, y1 = first[1] - x * third[1], second[1] - y * third[1]
    x2, y2 = first[2] - x * third[2], second[2] - y * third[2]
    by_u = (xx * x0 + xy * y0, xx * x1 + xy * y1, xx * x2 + xy * y2)
    by_v = (yx * x0 + yy * y0, yx * x1 + yy * y1, yx * x2 + yy * y2)
    return u, v, by_u, by_v, cz


def packed(rotation: FloatArray, translation: FloatArray, intrinsics: FloatArray) -> FloatArray:
    """Return one camera's numbers (21,): rotation (9), translation (3), focal, centre, distortion (9)."""
    return np.concatenate([rotation.reshape(-1), translation, intrinsics])


@njit(cache=True, nogil=True)
def project_with_jacobian(
    points: FloatArray,
    rotation: FloatArray,
    translation: FloatArray,
    focal: FloatArray,
    centre: FloatArray,
    distortion: FloatArray,
) -> tuple[FloatArray, FloatArray, float]:
    """Return pixels (N, 2), their derivative (N, 2, 3) by points (N, 3) of `box`, and the least depth, mm.

    Where the least depth is not positive the other results mean nothing.
    """
    count = len(points)
    pixels = np.empty((count, 2))
    jacobian = np.empty((count, 2, 3))
    nearest = np.inf
    for i in range(count):
        u, v, by_u, by_v, depth = project_one(
            points[i, 0], points[i, 1], points[i, 2], rotation, translation, focal, centre, distortion
        )
        nearest = min(nearest, depth)
        if depth <= 0.0:
            return pixels, jacobian, nearest
        pixels[i, 0] = u
        pixels[i, 1] = v
        for k in range(3):
            jacobian[i, 0, k] = by_u[k]
            jacobian[i, 1, k] = by_v[k]
    return pixels, jacobian, nearest


@njit(cache=True, nogil=True)
def undistort(distorted: FloatArray, coefficients: FloatArray) -> tuple[FloatArray, bool]:
    """Return ideal normalised coordinates (N, 2) of distorted ones, and whether all could be undone.

    Damped Newton from the distorted point itself, in steps of at most 0.2. What it finds beyond the fold (another sheet
    of the model, where the picture is turned over or seen twice) counts as not undone.
    """
    k1, k2, p1, p2, k3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3], coefficients[4]
    ideal = distorted.copy()
    good = True
    furthest = 0.0
    for i in range(len(distorted)):
        x, y = distorted[i, 0], distorted[i, 1]
        error = 1.0
        determinant = 1.0
        for _ in range(40):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3)
            ex = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) - distorted[i, 0]
            ey = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y - distorted[i, 1]
            error = max(abs(ex), abs(ey))
            cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
            xx = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
            yy = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
            determinant = xx * yy - cross * cross
            if error < 1e-13 or abs(determinant) < 1e-9:
                break
            sx = (yy * ex - cross * ey) / determinant
            sy = (xx * ey - cross * ex) / determinant
            scale = min(1.0, 0.2 / max((sx * sx + sy * sy) ** 0.5, 1e-300))
            x -= scale * sx
            y -= scale * sy
        if not (error < 1e-9 and determinant > 0.0):
            good = False
        ideal[i, 0] = x
        ideal[i, 1] = y
        furthest = max(furthest, x * x + y * y)
    return ideal, good and not _folds_within(coefficients, furthest)


@njit(cache=True, nogil=True)
def _folds_within(coefficients: FloatArray, furthest: float) -> bool:
    """Return whether the radial model turns back before r^2 = `furthest`, by more than tangential terms can make up."""
    k1, k2, p1, p2, k3 = coefficients[0], coefficients[1], coefficients[2], coefficients[3], coefficients[4]
    for i in range(1, _FOLD_SAMPLES + 1):
        r2 = furthest * i / _FOLD_SAMPLES
        slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3))
        if slope < -6.0 * (abs(p1) + abs(p2)) * r2**0.5:
            return True
    return False
