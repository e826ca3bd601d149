"""A flat print seen through a lens: the mean of what each pixel sees of it, over its area and the exposure. Numba."""

import numpy as np
from numba import njit

MIXED, PLAIN, BESIDE = 0, 1, 2
"""What the print is like around a texel: changing, all of one grey, or not there."""


@njit(cache=True, nogil=True)
def see_print(rays, texture, state, pad, samples, texels_from_rays, window, seen):  # type: ignore[no-untyped-def]
    """Fill a window of seen (H, W, 2) float32: the print's grey (0 to 255) times its cover, and its cover (0 to 1).

    rays (H, W, 2): every pixel's x/z and y/z; texture (h, w) float32; state (h + 2 pad, w + 2 pad) uint8: `MIXED` where
    a pixel's whole footprint at this texel is not known to be alike; samples (K, 2): offsets within a pixel;
    texels_from_rays (K, 3, 3): what takes (x/z, y/z, 1) to a texel's (column, row) times the third, at the instant of
    each sample; the third is positive before the camera. Texel (0, 0) reaches from 0 to 1.
    """
    height, width = rays.shape[:2]
    rows, columns = texture.shape
    left, top, right, bottom = window
    middle = texels_from_rays[texels_from_rays.shape[0] // 2]
    for row in range(top, bottom):
        for column in range(left, right):
            x, y = rays[row, column, 0], rays[row, column, 1]
            depth = middle[2, 0] * x + middle[2, 1] * y + middle[2, 2]
            if depth <= 0.0:
                continue
            i = int(np.floor((middle[0, 0] * x + middle[0, 1] * y + middle[0, 2]) / depth))
            j = int(np.floor((middle[1, 0] * x + middle[1, 1] * y + middle[1, 2]) / depth))
            if i < -pad or j < -pad or i >= columns + pad or j >= rows + pad:
                continue
            kind = state[j + pad, i + pad]
            if kind == BESIDE:
                continue
            if kind == PLAIN:
                seen[row, column, 0], seen[row, column, 1] = texture[j, i], 1.0
                continue
            before, after = max(column - 1, 0), min(column + 1, width - 1)
            above, below = max(row - 1, 0), min(row + 1, height - 1)
            across, down = 1.0 / (after - before), 1.0 / (below - above)
            across_x = across * (rays[row, after, 0] - rays[row, before, 0])
            across_y = across * (rays[row, after, 1] - rays[row, before, 1])
            down_x = down * (rays[below, column, 0] - rays[above, column, 0])
            down_y = down * (rays[below, column, 1] - rays[above, column, 1])
            grey, cover = 0.0, 0.0
            for k in range(samples.shape[0]):
                a = x + samples[k, 0] * across_x + samples[k, 1] * down_x
                b = y + samples[k, 0] * across_y + samples[k, 1] * down_y
                m = texels_from_rays[k]
                scale = 1.0 / (m[2, 0] * a + m[2, 1] * b + m[2, 2])
                u = (m[0, 0] * a + m[0, 1] * b + m[0, 2]) * scale
                v = (m[1, 0] * a + m[1, 1] * b + m[1, 2]) * scale
                # Between the middles of texels linearly: a symmetric, narrow filter, which moves no edge.
                share = min(1.0, max(0.0, min(min(u, columns - u), min(v, rows - v)) + 0.5))
                if share <= 0.0:
                    continue
                u, v = min(max(u - 0.5, 0.0), columns - 1.001), min(max(v - 0.5, 0.0), rows - 1.001)
                i, j = int(u), int(v)
                s, t = u - i, v - j
                upper = texture[j, i] + s * (texture[j, i + 1] - texture[j, i])
                lower = texture[j + 1, i] + s * (texture[j + 1, i + 1] - texture[j + 1, i])
                grey += share * (upper + t * (lower - upper))
                cover += share
            seen[row, column, 0] = grey / samples.shape[0]
            seen[row, column, 1] = cover / samples.shape[0]


@njit(cache=True, nogil=True, fastmath=True)
def light_up(seen, light, lamp, ink, paper, tint, level):  # type: ignore[no-untyped-def]
    """Fill level (H, W, 3), DN, with the print before the background light (H, W, 3).

    seen (H, W, 2): from `see_print`; lamp (H, W): the front light, DN on white; ink, paper: reflectances of grey 0 and
    255, already times how squarely they face the lamp; tint (3,): the light's colour.
    """
    height, width = lamp.shape
    for row in range(height):
        for column in range(width):
            cover = seen[row, column, 1]
            if cover <= 0.0:
                for c in range(3):
                    level[row, column, c] = light[row, column, c]
                continue
            sent = lamp[row, column] * (ink * cover + (paper - ink) / 255.0 * seen[row, column, 0])
            for c in range(3):
                level[row, column, c] = light[row, column, c] * (1.0 - cover) + sent * tint[c]
