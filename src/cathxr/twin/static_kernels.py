"""Rays into a static scene: what each pixel sees, and the mean of many rays where outlines pass. Numba, no GIL.

`things` is everything in the camera's frame: block centres (B, 3), axes (B, 3, 3) columns and half sizes (B, 3); disc
centres (D, 3), normals (D, 3) and radii (D,); ball centres (S, 3) and radii (S,); the lamp's direction (3,), unit, from
the scene; and windows (N, 4): least and greatest x/z, then y/z, that a ray needs to meet a thing. A thing's number
counts blocks, discs and balls in this order.
"""

import numpy as np
from numba import njit

SAMPLES = 89
_TURN = 55
"""Rays through a pixel at an outline: a Fibonacci lattice (89 points, generator 55), shifted from pixel to pixel."""
_AMBIENT = 0.35
_SHINE_POWER = 40


@njit(cache=True, nogil=True)
def first_hit(x, y, things):  # type: ignore[no-untyped-def]
    """Return which thing the ray (x, y, 1) hits first (-1: none), at what depth, its shade (0 to 1), and its shine."""
    centre, axes, half, discs, normals, radii, balls, ball_radii, lamp, windows = things
    best, depth, square, shine = -1, np.inf, 0.0, 0.0
    size = np.sqrt(x * x + y * y + 1.0)
    for k in range(centre.shape[0]):
        if x < windows[k, 0] or x > windows[k, 1] or y < windows[k, 2] or y > windows[k, 3]:
            continue
        near, far, face = 0.0, np.inf, 0.0
        for j in range(3):
            way = axes[k, 0, j] * x + axes[k, 1, j] * y + axes[k, 2, j]
            off = axes[k, 0, j] * centre[k, 0] + axes[k, 1, j] * centre[k, 1] + axes[k, 2, j] * centre[k, 2]
            if abs(way) < 1e-12:
                if abs(off) > half[k, j]:
                    far = -1.0
                continue
            first, second = (off - half[k, j]) / way, (off + half[k, j]) / way
            if min(first, second) > near:
                near, face = min(first, second), abs(way) / size
            far = min(far, max(first, second))
        if near < far and near < depth and near > 0.0:
            best, depth, square = k, near, face
    for k in range(discs.shape[0]):
        w = centre.shape[0] + k
        if x < windows[w, 0] or x > windows[w, 1] or y < windows[w, 2] or y > windows[w, 3]:
            continue
        way = normals[k, 0] * x + normals[k, 1] * y + normals[k, 2]
        if abs(way) < 1e-9:
            continue
        at = (normals[k, 0] * discs[k, 0] + normals[k, 1] * discs[k, 1] + normals[k, 2] * discs[k, 2]) / way
        dx, dy, dz = at * x - discs[k, 0], at * y - discs[k, 1], at - discs[k, 2]
        if 0.0 < at <= depth + 0.01 and dx * dx + dy * dy + dz * dz <= radii[k] * radii[k]:
            best, depth, square = centre.shape[0] + k, at, abs(way) / size
    for k in range(balls.shape[0]):
        w = centre.shape[0] + discs.shape[0] + k
        if x < windows[w, 0] or x > windows[w, 1] or y < windows[w, 2] or y > windows[w, 3]:
            continue
        along = x * balls[k, 0] + y * balls[k, 1] + balls[k, 2]
        away = balls[k, 0] ** 2 + balls[k, 1] ** 2 + balls[k, 2] ** 2
        room = along * along - size * size * (away - ball_radii[k] ** 2)
        if room <= 0.0:
            continue
        at = (along - np.sqrt(room)) / (size * size)
        if 0.0 < at < depth:
            best, depth = centre.shape[0] + discs.shape[0] + k, at
            nx, ny, nz = at * x - balls[k, 0], at * y - balls[k, 1], at - balls[k, 2]
            square = max(0.0, (nx * lamp[0] + ny * lamp[1] + nz * lamp[2]) / ball_radii[k])
            # The normal's share along the direction midway between the lamp and the eye (Blinn).
            hx, hy, hz = lamp[0] - x / size, lamp[1] - y / size, lamp[2] - 1.0 / size
            midway = (nx * hx + ny * hy + nz * hz) / (ball_radii[k] * np.sqrt(hx * hx + hy * hy + hz * hz))
            shine = max(0.0, midway) ** _SHINE_POWER
    if best < centre.shape[0] + discs.shape[0]:
        shine = 0.0
    return best, depth, _AMBIENT + (1.0 - _AMBIENT) * square, shine


@njit(cache=True, nogil=True)
def trace(rays, things, which, depth, shade, shine):  # type: ignore[no-untyped-def]
    """Fill what each pixel's centre sees."""
    for row in range(which.shape[0]):
        for column in range(which.shape[1]):
            x, y = rays[row, column, 0], rays[row, column, 1]
            hit = first_hit(x, y, things)
            which[row, column], depth[row, column], shade[row, column], shine[row, column] = hit


@njit(cache=True, nogil=True)
def soften(rays, things, which, colours, gloss, lamp, light, level):  # type: ignore[no-untyped-def]
    """Replace the pixels at the rims of things in level (H, W, 3) by the mean of many rays through each.

    colours (N, 3): light, DN, that each thing sends back where it faces the lamp; gloss (3,): its highlight's; lamp
    (H, W): the front light's unevenness; light (H, W, 3): the background.
    """
    height, width = which.shape
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            rim = False
            for r in range(row - 1, row + 2):
                for c in range(column - 1, column + 2):
                    rim = rim or which[r, c] != which[row, column]
            if not rim:
                continue
            across_x = 0.5 * (rays[row, column + 1, 0] - rays[row, column - 1, 0])
            across_y = 0.5 * (rays[row, column + 1, 1] - rays[row, column - 1, 1])
            down_x = 0.5 * (rays[row + 1, column, 0] - rays[row - 1, column, 0])
            down_y = 0.5 * (rays[row + 1, column, 1] - rays[row - 1, column, 1])
            # Each pixel's lattice is shifted, so that along an edge what one pixel misses its neighbours see.
            shift_u = (0.7548776662466927 * column + 0.5698402909980532 * row) % 1.0
            shift_v = (0.5698402909980532 * column + 0.7548776662466927 * row) % 1.0
            level[row, column] = 0.0
            for i in range(SAMPLES):
                du = ((i + 0.5) / SAMPLES + shift_u) % 1.0 - 0.5
                dv = (i * _TURN % SAMPLES + 0.5) / SAMPLES + shift_v
                dv = dv % 1.0 - 0.5
                x = rays[row, column, 0] + du * across_x + dv * down_x
                y = rays[row, column, 1] + du * across_y + dv * down_y
                best, _, square, shine = first_hit(x, y, things)
                for k in range(3):
                    seen = light[row, column, k]
                    if best >= 0:
                        seen = lamp[row, column] * (colours[best, k] * square + gloss[k] * shine)
                    level[row, column, k] += seen / SAMPLES
