"""Hot loops of naming spots: a camera's pose from a few named spots and what was expected of it, and guided growing.

A pose is a rotation (3, 3) and a translation (3,), camera_from_box; steps are left perturbations, rotation (rad) then
translation (mm), as in `geometry.pose.perturbed`.
"""

import math

import numpy as np
from numba import njit

from cathxr.geometry.camera_kernels import project_one


@njit(cache=True, nogil=True)
def turned(rotation, vector):  # type: ignore[no-untyped-def]
    """Return exp(vector) @ rotation, by Rodrigues' formula."""
    angle = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < 1e-12:
        return rotation.copy()
    x, y, z = vector[0] / angle, vector[1] / angle, vector[2] / angle
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    step = np.empty((3, 3))
    step[0, 0], step[0, 1], step[0, 2] = 1 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y
    step[1, 0], step[1, 1], step[1, 2] = c * x * y + s * z, 1 - c * (x * x + z * z), c * y * z - s * x
    step[2, 0], step[2, 1], step[2, 2] = c * x * z - s * y, c * y * z + s * x, 1 - c * (x * x + y * y)
    return step @ rotation


@njit(cache=True, nogil=True)
def between(first, second):  # type: ignore[no-untyped-def]
    """Return the rotation vector (3,) that takes the rotation `second` to `first`: the logarithm."""
    relative = first @ second.T
    cosine = min(1.0, max(-1.0, 0.5 * (relative[0, 0] + relative[1, 1] + relative[2, 2] - 1.0)))
    angle = math.acos(cosine)
    axis = np.array([relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]])
    length = math.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
    if length < 1e-9:  # none at all, or half a turn about an axis that does not matter here
        return axis if cosine > 0 else np.array([math.pi, 0.0, 0.0])
    return axis * (angle / length)


@njit(cache=True, nogil=True)
def rows_of(point, pixel, rotation, translation, lens, sigma, jacobian, residual):  # type: ignore[no-untyped-def]
    """Fill residual (2,) and jacobian (2, 6) of one named spot, in sigmas; False where it lies behind the camera."""
    focal, centre, distortion = lens
    u, v, by_u, by_v, depth = project_one(
        point[0], point[1], point[2], rotation, translation, focal, centre, distortion
    )
    if depth <= 1.0:
        return False
    residual[0], residual[1] = (pixel[0] - u) / sigma, (pixel[1] - v) / sigma
    q = np.empty(3)
    for k in range(3):
        q[k] = rotation[k, 0] * point[0] + rotation[k, 1] * point[1] + rotation[k, 2] * point[2]
    for r in range(2):
        g = np.empty(3)
        for k in range(3):  # derivative by the point in the camera's frame
            d = by_u if r == 0 else by_v
            g[k] = rotation[k, 0] * d[0] + rotation[k, 1] * d[1] + rotation[k, 2] * d[2]
        jacobian[r, 0] = (q[1] * g[2] - q[2] * g[1]) / sigma
        jacobian[r, 1] = (q[2] * g[0] - q[0] * g[2]) / sigma
        jacobian[r, 2] = (q[0] * g[1] - q[1] * g[0]) / sigma
        for k in range(3):
            jacobian[r, 3 + k] = g[k] / sigma
    return True


@njit(cache=True, nogil=True)
def fit(points, pixels, sigmas, lens, prior, rotation, translation, steps):  # type: ignore[no-untyped-def]
    """Return (rotation, translation, normal matrix (6, 6), cost, good) that suit named spots and the expected pose.

    points (N, 3) mm, pixels (N, 2), sigmas (N,) px. prior: rotation, optical centre (3,) in `box`, sigma rad, sigma mm
    of the expected pose.
    """
    prior_rotation, prior_centre, turn_sigma, shift_sigma = prior
    r, t = rotation.copy(), translation.copy()
    jacobian, residual = np.empty((2, 6)), np.empty(2)
    last, damping = np.inf, 1e-6
    kept_r, kept_t = r, t
    kept = np.eye(6)
    right = np.zeros(6)
    for _ in range(steps + 1):
        normal, gradient, cost, good = np.zeros((6, 6)), np.zeros(6), 0.0, True
        for i in range(len(points)):
            if not rows_of(points[i], pixels[i], r, t, lens, sigmas[i], jacobian, residual):
                good = False
                break
            for row in range(2):
                cost += residual[row] ** 2
                for j in range(6):
                    gradient[j] += jacobian[row, j] * residual[row]
                    for k in range(6):
                        normal[j, k] += jacobian[row, j] * jacobian[row, k]
        if good:
            cost += _expect(r, t, prior_rotation, prior_centre, turn_sigma, shift_sigma, normal, gradient)
        if good and cost <= last:
            done = last - cost < 1e-5 * (1.0 + cost)
            last, kept, right, kept_r, kept_t = cost, normal, gradient, r, t
            damping *= 0.1
            if done:
                break
        else:
            damping = max(damping * 30.0, 1e-4)
            if damping > 1e6:
                break
        damped = kept.copy()
        for j in range(6):
            damped[j, j] += damping * kept[j, j] + 1e-12
        step = np.linalg.solve(damped, right)
        r, t = turned(kept_r, step[:3]), kept_t + step[3:]
    return kept_r, kept_t, kept, last, last < np.inf


@njit(cache=True, nogil=True)
def _expect(r, t, prior_rotation, prior_centre, turn_sigma, shift_sigma, normal, gradient):  # type: ignore[no-untyped-def]
    """Add to the normal equations what was expected of the pose, and return its cost."""
    turn = between(r, prior_rotation)
    cost = 0.0
    for j in range(3):
        cost += (turn[j] / turn_sigma) ** 2
        normal[j, j] += 1.0 / turn_sigma**2
        gradient[j] -= turn[j] / turn_sigma**2
    off = -r.T @ t - prior_centre
    # The centre moves by -R^T step + R^T (turn x t).
    jacobian = np.empty((3, 6))
    for k in range(3):
        a, b, c = r[0, k], r[1, k], r[2, k]
        jacobian[k, 0] = c * t[1] - b * t[2]
        jacobian[k, 1] = a * t[2] - c * t[0]
        jacobian[k, 2] = b * t[0] - a * t[1]
        jacobian[k, 3], jacobian[k, 4], jacobian[k, 5] = -a, -b, -c
    for k in range(3):
        cost += (off[k] / shift_sigma) ** 2
        for i in range(6):
            gradient[i] -= jacobian[k, i] * off[k] / shift_sigma**2
            for j in range(6):
                normal[i, j] += jacobian[k, i] * jacobian[k, j] / shift_sigma**2
    return cost


@njit(cache=True, nogil=True)
def grow(points, pixels, radii, fits, sigmas, lens, prior, rotation, translation, named, most_ratio, gate):  # type: ignore[no-untyped-def]
    """Return (rotation, translation, cost) after naming, one by one, each spot that lies where a marker must.

    points (M, 3): the markers; pixels (B, 2), radii (B,), sigmas (B,): the spots; fits (M, B): score of colours, -inf
    where they do not. named (M,): the spot of each marker or -1; those given are the start, and it is filled in.
    most_ratio: of two apparent sizes at one distance. gate: squared distance in sigmas. cost is inf where the
    start fits nothing.
    """
    markers, spots = fits.shape
    used = np.zeros(spots, dtype=np.uint8)
    chosen = np.empty(markers, dtype=np.int64)
    count = 0
    for m in range(markers):
        if named[m] >= 0:
            used[named[m]] = 1
            chosen[count] = m
            count += 1
    r, t, cost = rotation, translation, np.inf
    jacobian, residual = np.empty((2, 6)), np.empty(2)
    for _ in range(markers + 1):
        at = np.empty((count, 3))
        seen, sigma = np.empty((count, 2)), np.empty(count)
        for i in range(count):
            at[i], seen[i], sigma[i] = points[chosen[i]], pixels[named[chosen[i]]], sigmas[named[chosen[i]]]
        r, t, normal, cost, good = fit(at, seen, sigma, lens, prior, r, t, 12)
        if not good or cost > gate * (count + 1):
            return r, t, np.inf
        size, low, high = 0.0, np.inf, 0.0
        for i in range(count):
            depth = r[2] @ at[i] + t[2]
            each = radii[named[chosen[i]]] * depth
            size += each / count
            low, high = min(low, each), max(high, each)
        if high > most_ratio * low:
            return r, t, np.inf
        covariance = np.linalg.inv(normal)
        best, best_m, best_b = gate, -1, -1
        for m in range(markers):
            if named[m] >= 0:
                continue
            depth = r[2] @ points[m] + t[2]
            if depth <= 1.0 or not rows_of(points[m], np.zeros(2), r, t, lens, 1.0, jacobian, residual):
                continue
            spread = jacobian @ covariance @ jacobian.T
            for b in range(spots):
                if used[b] or fits[m, b] == -np.inf:
                    continue
                ratio = radii[b] * depth / size
                if ratio > most_ratio or ratio * most_ratio < 1.0:
                    continue
                dx, dy = pixels[b, 0] + residual[0], pixels[b, 1] + residual[1]
                xx, yy = spread[0, 0] + sigmas[b] ** 2, spread[1, 1] + sigmas[b] ** 2
                xy = spread[0, 1]
                far = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
                if far < best:
                    best, best_m, best_b = far, m, b
        if best_m < 0:
            break
        named[best_m], used[best_b] = best_b, 1
        chosen[count] = best_m
        count += 1
    return r, t, cost


@njit(cache=True, nogil=True)
def sweep(points, pixels, radii, fits, sigmas, lens, prior, starts, most_ratio, gate):  # type: ignore[no-untyped-def]
    """Return (named (K, M), rotations (K, 3, 3), translations (K, 3), costs (K,)) grown from pairs of named spots.

    starts (S, 4): marker, spot, marker, spot; a pair that an earlier result of at least 4 holds already is skipped.
    """
    markers = len(points)
    count = 0
    names = np.full((len(starts), markers), -1, dtype=np.int64)
    rotations, translations = np.empty((len(starts), 3, 3)), np.empty((len(starts), 3))
    costs = np.empty(len(starts))
    translation = -prior[0] @ prior[1]
    for i in range(len(starts)):
        m, b, n, c = starts[i]
        known = False
        for k in range(count):
            if names[k, m] == b and names[k, n] == c and (names[k] >= 0).sum() >= 4:
                known = True
                break
        if known:
            continue
        named = names[count]
        named[:] = -1
        named[m], named[n] = b, c
        r, t, cost = grow(
            points, pixels, radii, fits, sigmas, lens, prior, prior[0], translation, named, most_ratio, gate
        )
        if cost < np.inf and (named >= 0).sum() >= 3:
            rotations[count], translations[count], costs[count] = r, t, cost
            count += 1
    return names[:count], rotations[:count], translations[:count], costs[:count]
