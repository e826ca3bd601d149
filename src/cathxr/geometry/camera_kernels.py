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
    cx = rotation[0, 0] * px + rotation[0, 1] * py + rotation[0, 2] * pz + translation[0]
    cy = rotation[1, 0] * px + rotation[1, 1] * py + rotation[1, 2] * pz + translation[1]
    cz = rotation[2, 0] * px + rotation[2, 1] * py + rotation[2, 2] * pz + translation[2]
    if cz <= 0.0:
        return 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), cz
    k1, k2, p1, p2, k3 = distortion[0], distortion[1], distortion[2], distortion[3], distortion[4]
    x = cx / cz
    y = cy / cz
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3)
    u = focal[0] * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + centre[0]
    v = focal[1] * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + centre[1]
    cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    xx = focal[0] * (radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x)
    yy = focal[1] * (radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x)
    xy = focal[0] * cross
    yx = focal[1] * cross
    x0, y0 = (rotation[0, 0] - x * rotation[2, 0]) / cz, (rotation[1, 0] - y * rotation[2, 0]) / cz
    x1, y1 = (rotation[0, 1] - x * rotation[2, 1]) / cz, (rotation[1, 1] - y * rotation[2, 1]) / cz
    x2, y2 = (rotation[0, 2] - x * rotation[2, 2]) / cz, (rotation[1, 2] - y * rotation[2, 2]) / cz
    by_u = (xx * x0 + xy * y0, xx * x1 + xy * y1, xx * x2 + xy * y2)
    by_v = (yx * x0 + yy * y0, yx * x1 + yy * y1, yx * x2 + yy * y2)
    return u, v, by_u, by_v, cz


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
