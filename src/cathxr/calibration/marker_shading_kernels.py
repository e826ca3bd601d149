"""Hot loops of the last hundredths of a pixel: how shading and blur shift the edge that is measured at a ball's rim."""

import math

import numpy as np
from numba import njit

from cathxr.calibration.marker_kernels import _edge, _sample

_TAPS = 3.5
_FINE = 4
_MOST_OFF_PX = 1.0


@njit(cache=True, nogil=True)
def shading(picture, x, y, radius, direction):  # type: ignore[no-untyped-def]
    """Return (4,) how the inside of a ball is lit along a colour direction (3,): constant, and along its normal.

    A matt ball's light is linear in its normal where it faces the lamp, constant where not (Lambert). What does not fit
    (a highlight) is left out, step by step.
    """
    height, width = picture.shape[:2]
    inner = max(0.55 * radius, radius - 1.6)
    reach = int(inner) + 1
    cx, cy = int(x + 0.5), int(y + 0.5)
    rows, values = np.empty(((2 * reach + 1) ** 2, 4)), np.empty((2 * reach + 1) ** 2)
    n = 0
    for v in range(max(cy - reach, 0), min(cy + reach + 1, height)):
        for u in range(max(cx - reach, 0), min(cx + reach + 1, width)):
            nx, ny = (u - x) / radius, (v - y) / radius
            if nx * nx + ny * ny > (inner / radius) ** 2:
                continue
            rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = 1.0, nx, ny, math.sqrt(1.0 - nx * nx - ny * ny)
            value = 0.0
            for c in range(3):
                value += direction[c] * picture[v, u, c]
            values[n] = value
            n += 1
    use = np.ones(n)
    answer = np.zeros(4)
    for turn in range(6):
        normal, right = np.zeros((4, 4)), np.zeros(4)
        for i in range(n):
            lit = 1.0
            if turn > 0 and rows[i, 1] * answer[1] + rows[i, 2] * answer[2] + rows[i, 3] * answer[3] < 0.0:
                lit = 0.0
            for j in range(4):
                first = use[i] * rows[i, j] * (lit if j else 1.0)
                right[j] += first * values[i]
                for k in range(4):
                    normal[j, k] += first * rows[i, k] * (lit if k else 1.0)
        trace = normal[0, 0] + 1e-9
        for j in range(1, 4):
            normal[j, j] += 1e-3 * trace
        answer[:] = np.linalg.solve(normal + np.eye(4) * 1e-9, right)
        off = np.empty(n)
        for i in range(n):
            facing = rows[i, 1] * answer[1] + rows[i, 2] * answer[2] + rows[i, 3] * answer[3]
            off[i] = abs(values[i] - answer[0] - max(facing, 0.0))
        limit = max(3.0 * np.median(off), 0.5) if n else 1.0
        for i in range(n):
            use[i] = 1.0 if off[i] < limit else 0.0
    return answer


@njit(cache=True, nogil=True)
def _modelled(constant, gain, along, facing, radius, blur, start, step, fine, profile):  # type: ignore[no-untyped-def]
    """Fill profile (n,) with a blurred ball's section: constant + gain * lit, 0 outside.

    lit: along r/R + facing sqrt(1 - r^2/R^2) where that is positive, else 0.
    """
    tiny = step / _FINE
    taps = int(_TAPS * blur / tiny) + 1
    total = (len(profile) - 1) * _FINE + 1 + 2 * taps
    for i in range(total):
        r = (start + (i - taps) * tiny) / radius
        fine[i] = 0.0
        if r < 1.0:
            fine[i] = constant + gain * max(along * r + facing * math.sqrt(max(1.0 - r * r, 0.0)), 0.0)
        # A sample at the very rim counts by half, so that the edge lies where it should.
        if abs(r - 1.0) * radius < 0.5 * tiny:
            fine[i] *= (0.5 * tiny + (1.0 - r) * radius) / tiny if r < 1.0 else 1.0
            if r >= 1.0:
                fine[i] = (constant + gain * max(along, 0.0)) * (0.5 * tiny - (r - 1.0) * radius) / tiny
    weights = np.empty(2 * taps + 1)
    for k in range(2 * taps + 1):
        weights[k] = math.exp(-0.5 * ((k - taps) * tiny / blur) ** 2)
    whole = weights.sum()
    for j in range(len(profile)):
        value = 0.0
        for k in range(2 * taps + 1):
            value += weights[k] * fine[j * _FINE + k]
        profile[j] = value / whole


@njit(cache=True, nogil=True)
def bias(constant, gain, along, facing, radius, blur, reach, step):  # type: ignore[no-untyped-def]
    """Return (how far outside the true rim the edge of a modelled section is measured, its steepness / its drop)."""
    samples = int(2.0 * reach / step) + 1
    profile = np.empty(samples)
    fine = np.empty((samples + 1) * _FINE + 4 + 2 * int(_TAPS * blur * _FINE / step + 2))
    start = radius - reach
    _modelled(constant, gain, along, facing, radius, blur, start, step, fine, profile)
    at, fall, drop = _edge(profile, step)
    if at < 0.0 or drop <= 0.0:
        return 0.0, 0.0
    return start + at - radius, fall / drop


@njit(cache=True, nogil=True)
def rim_towards(picture, direction, mode, x, y, radius, reach, step, out):  # type: ignore[no-untyped-def]
    """Fill out (N, 6): x, y of the rim on N rays, steepness, drop, the ball's own share of the contrast, and angle.

    mode: 0 looks along `direction` (3,); 1, on each ray, along the difference of the colours inside and outside; 2 at
    brightness (luma) alone, which is what cameras that compress colour leave sharp.
    The share says how much of a change of the ball's light is seen relative to the drop: 1 before black.
    """
    height, width = picture.shape[:2]
    samples = int(2.0 * reach / step) + 1
    profile = np.empty(samples)
    colours = np.empty((samples, 3))
    basis = np.eye(3)
    near = max(1.2, 0.12 * radius)
    for i in range(len(out)):
        out[i, :] = 0.0
        angle = 2.0 * math.pi * i / len(out)
        dx, dy = math.cos(angle), math.sin(angle)
        out[i, 5] = angle
        start = radius - reach
        last = start + (samples - 1) * step
        inside_picture = 1.0 <= x + last * dx < width - 2.0 and 1.0 <= y + last * dy < height - 2.0
        if not inside_picture or not (1.0 <= x < width - 2.0 and 1.0 <= y < height - 2.0):
            continue
        inner, outer = np.zeros(3), np.zeros(3)
        inner_n, outer_n = 0, 0
        for j in range(samples):
            t = start + j * step
            for c in range(3):
                colours[j, c] = _sample(picture, x + t * dx, y + t * dy, basis[c])
            if radius - 2.0 * near <= t <= radius - near:
                inner += colours[j]
                inner_n += 1
            if radius + near <= t <= radius + 2.0 * near:
                outer += colours[j]
                outer_n += 1
        if inner_n == 0 or outer_n == 0:
            continue
        inner, outer = inner / inner_n, outer / outer_n
        way = direction.copy()
        if mode == 1:
            way = inner - outer
        elif mode == 2:
            way = np.array([0.114, 0.587, 0.299])
            if (inner - outer) @ way < 0.0:
                way = -way
        length = math.sqrt(way @ way)
        if length < 1e-6:
            continue
        way = way / length
        for j in range(samples):
            profile[j] = (colours[j] - outer) @ way
        at, fall, drop = _edge(profile, step)
        contrast = (inner - outer) @ way
        if at < 0.0 or contrast <= 0.0:
            continue
        t = start + at
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = x + t * dx, y + t * dy, fall, drop
        out[i, 4] = (inner @ way) / contrast


@njit(cache=True, nogil=True)
def corrected(points, light, radius, reach, step, blurs, out):  # type: ignore[no-untyped-def]
    """Fill out (N, 4) with rim points as `marker_kernels.rim` gives them, moved to where the model says the rim is.

    points (N, 6): of `rim_towards`; light (4,): of `shading`; blurs (B,): from which the lens's blur is chosen, px.
    """
    count = len(points)
    seen = np.flatnonzero(points[:, 3] > 0.0)
    out[:] = points[:, :4]
    if len(seen) == 0:
        return
    inner = 1.0 - 1.5 * max(1.2, 0.12 * radius) / radius
    deep = math.sqrt(max(1.0 - inner * inner, 0.0))
    along, own = np.empty(count), np.empty(count)
    for i in range(count):
        along[i] = light[1] * math.cos(points[i, 5]) + light[2] * math.sin(points[i, 5])
        own[i] = light[0] + max(along[i] * inner + light[3] * deep, 0.0)
    least = 0.15 * max(own.max(), 1e-6)
    sections = np.empty((count, 3))
    for i in range(count):
        share = min(max(points[i, 4], -2.0), 2.0)
        sections[i, 1] = share / max(own[i], least)
        sections[i, 0] = 1.0 - share + sections[i, 1] * light[0]
        sections[i, 2] = along[i]
    sharpness = np.median(points[seen, 2] / points[seen, 3])
    blur = _blur_of(sections[seen[:: max(1, len(seen) // 9)]], light[3], radius, reach, step, blurs, sharpness)
    for k in range(len(seen)):
        i = seen[k]
        off, _ = bias(sections[i, 0], sections[i, 1], sections[i, 2], light[3], radius, blur, reach, step)
        off = min(max(off, -_MOST_OFF_PX), _MOST_OFF_PX)
        out[i, 0] -= off * math.cos(points[i, 5])
        out[i, 1] -= off * math.sin(points[i, 5])


@njit(cache=True, nogil=True)
def _blur_of(sections, facing, radius, reach, step, blurs, sharpness):  # type: ignore[no-untyped-def]
    """Return the blur (px, standard deviation) with which modelled sections look as sharp as the picture's."""
    each = np.empty(len(sections))
    before = 0.0
    for k in range(len(blurs)):
        for i in range(len(sections)):
            s = sections[i]
            each[i] = bias(s[0], s[1], s[2], facing, radius, blurs[k], reach, step)[1]
        now = np.median(each)
        if now <= sharpness:
            if k == 0 or before <= now:
                return blurs[k]
            share = (before - sharpness) / (before - now)
            return blurs[k - 1] + share * (blurs[k] - blurs[k - 1])
        before = now
    return blurs[-1]
