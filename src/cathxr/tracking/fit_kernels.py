"""The fit's hot loop, compiled: Gauss-Newton on the control points, each point touching only a few of them."""

import math

import numpy as np
from numba import njit

from cathxr.core import FloatArray
from cathxr.geometry.camera_kernels import project_one
from cathxr.tracking.spline import cubic_pieces

HUBER = 2.5
MAX_NOISE = 50.0
_STILL_MM = 1e-3
_LONGEST_STEP = 0.03


@njit(cache=True, nogil=True)
def seen(spans, control, cameras, view, t):  # type: ignore[no-untyped-def]
    """Return (first control point, basis values, velocity, u, v, derivatives of u, of v) of the curve at `t` in a view.

    cameras (V, 21): see `packed`. velocity: derivative of the curve by `t`.
    """
    piece, values, slopes = cubic_pieces(spans, t)
    x = y = z = dx = dy = dz = 0.0
    for k in range(4):
        x += values[k] * control[piece + k, 0]
        y += values[k] * control[piece + k, 1]
        z += values[k] * control[piece + k, 2]
        dx += slopes[k] * control[piece + k, 0]
        dy += slopes[k] * control[piece + k, 1]
        dz += slopes[k] * control[piece + k, 2]
    row = cameras[view]
    u, v, by_u, by_v, _ = project_one(x, y, z, row[:9].reshape(3, 3), row[9:12], row[12:14], row[14:16], row[16:21])
    return piece, values, (dx, dy, dz), u, v, by_u, by_v


@njit(cache=True, nogil=True)
def follow(spans, control, cameras, at, view, curve):  # type: ignore[no-untyped-def]
    """Move each measured point's parameter `at` (M,) to the foot of its perpendicular on the projected curve, in place.

    Negative parameters are points without a part in the curve and stay so. The first point of each view is the cap's
    centre, the curve's beginning by definition; a point beyond the curve's end is dropped.
    """
    for i in range(len(at)):
        if at[i] < 0.0:
            continue
        if i == 0 or view[i] != view[i - 1]:
            at[i] = 0.0
            continue
        t = min(max(at[i], 0.0), 1.0)
        _, _, (dx, dy, dz), u, v, by_u, by_v = seen(spans, control, cameras, view[i], t)
        su = by_u[0] * dx + by_u[1] * dy + by_u[2] * dz
        sv = by_v[0] * dx + by_v[1] * dy + by_v[2] * dz
        step = ((curve[i, 0] - u) * su + (curve[i, 1] - v) * sv) / max(su * su + sv * sv, 1e-6)
        moved = max(t + min(max(step, -_LONGEST_STEP), _LONGEST_STEP), 0.0)
        at[i] = -1.0 if moved > 1.001 else min(moved, 1.0)


@njit(cache=True, nogil=True)
def rows_of(spans, control, cameras, at, view, curve, normal, sigma, tip_along, tip_sigma):  # type: ignore[no-untyped-def]
    """Return (piece, weights of the 12 unknowns, residual px, sigma px) of every measurement that takes part.

    One row a point, along its normal; one more a view, of the cap's centre along the catheter.
    """
    capacity = len(at) + len(tip_sigma)
    pieces = np.empty(capacity, dtype=np.int64)
    design = np.empty((capacity, 12))
    residuals = np.empty(capacity)
    sigmas = np.empty(capacity)
    count = 0
    for i in range(len(at)):
        if at[i] < 0.0:
            continue
        piece, values, _, seen_u, seen_v, by_u, by_v = seen(spans, control, cameras, view[i], at[i])
        first = i == 0 or view[i] != view[i - 1]
        for which in range(2 if first else 1):
            if which == 0:
                u, v, spread = normal[i, 0], normal[i, 1], sigma[i]
            else:
                u, v, spread = tip_along[view[i], 0], tip_along[view[i], 1], tip_sigma[view[i]]
            for axis in range(3):
                slope = u * by_u[axis] + v * by_v[axis]
                for k in range(4):
                    design[count, 3 * k + axis] = values[k] * slope
            pieces[count] = piece
            residuals[count] = u * (curve[i, 0] - seen_u) + v * (curve[i, 1] - seen_v)
            sigmas[count] = spread
            count += 1
    return pieces[:count], design[:count], residuals[:count], sigmas[:count]


@njit(cache=True, nogil=True)
def gauss_newton(  # type: ignore[no-untyped-def]
    spans, control, prior, cameras, at, view, curve, normal, sigma, tip_along, tip_sigma, iterations
):
    """Return (control points, normal matrix (3n, 3n)) after robust Gauss-Newton; `at` is moved in place.

    prior (n, n): information on the control points, the same for each axis.
    """
    control = control.copy()
    size = len(control)
    matrix = np.empty((3 * size, 3 * size))
    right = np.empty(3 * size)
    for _ in range(iterations):
        follow(spans, control, cameras, at, view, curve)
        pieces, design, residuals, sigmas = rows_of(
            spans, control, cameras, at, view, curve, normal, sigma, tip_along, tip_sigma
        )
        noise = min(max(1.0, 1.4826 * np.median(np.abs(residuals / sigmas))), MAX_NOISE)
        matrix[:] = 0.0
        right[:] = 0.0
        for i in range(size):
            for j in range(size):
                if prior[i, j] != 0.0:
                    for axis in range(3):
                        matrix[3 * i + axis, 3 * j + axis] = prior[i, j]
                        right[3 * i + axis] -= prior[i, j] * control[j, axis]
        for i in range(len(residuals)):
            scaled = residuals[i] / (sigmas[i] * noise)
            weight = min(1.0, HUBER / max(abs(scaled), 1e-12)) / (sigmas[i] * noise) ** 2
            start = 3 * pieces[i]
            for a in range(12):
                part = weight * design[i, a]
                right[start + a] += part * residuals[i]
                for b in range(12):
                    matrix[start + a, start + b] += part * design[i, b]
        step = np.linalg.solve(matrix, right)
        largest = 0.0
        for i in range(size):
            for axis in range(3):
                control[i, axis] += step[3 * i + axis]
                largest = max(largest, abs(step[3 * i + axis]))
        if not largest < 1e6 or largest < _STILL_MM:
            break
    return control, matrix


@njit(cache=True, nogil=True)
def misfit(spans, control, cameras, at, view, curve, normal):  # type: ignore[no-untyped-def]
    """Return (rms px along the normals, largest distance px of a cap's centre from the projected one)."""
    total = 0.0
    count = 0
    gap = 0.0
    for i in range(len(at)):
        if at[i] < 0.0:
            continue
        _, _, _, u, v, _, _ = seen(spans, control, cameras, view[i], at[i])
        du, dv = curve[i, 0] - u, curve[i, 1] - v
        total += (du * normal[i, 0] + dv * normal[i, 1]) ** 2
        count += 1
        if i == 0 or view[i] != view[i - 1]:
            gap = max(gap, math.hypot(du, dv))
    return math.sqrt(total / max(count, 1)), gap


def packed(rotation: FloatArray, translation: FloatArray, intrinsics: FloatArray) -> FloatArray:
    """Return one camera's row (21,): rotation (9), translation (3), focal, centre, distortion (9)."""
    return np.concatenate([rotation.reshape(-1), translation, intrinsics])
